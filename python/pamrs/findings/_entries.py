"""The entries of a diagnosis that JSON has: where, effects, blocks, parameters, errors."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any, Final

from pamrs.findings._entry import NOT_WRITTEN, OMIT_EMPTY, OPTIONAL, Entry

VERDICTS: Final = ("none", "parameters", "effects", "unlisted", "units")
"""Allowed verdicts."""
HEALTHY: Final = VERDICTS[:2]
"""Verdicts, and hypotheses, by which no physics is missing."""
NOT_JUDGED: Final = "not_judged"
"""Entry in place of a verdict for a block that these recordings cannot judge."""


@dataclass(frozen=True, eq=False)
class Condition(Entry):
    """An operating condition that carries an excess.

    Attributes
    ----------
    name : str
        Which one, ``valve closed``.
    share, time : float
        Share of the excess that lies there, and share of the time.
    mean : float
        Mean residual there [noise levels].
    text : str
        The same as a sentence.
    """

    name: str
    share: float
    time: float
    mean: float
    text: str


@dataclass(frozen=True, eq=False)
class Where(Entry):
    """Place and times of the mismatch.

    Attributes
    ----------
    block, channel : str or None
        Block of the chain that carries the excess residual, and the channel that tells.
    probability : float or None
        Probability that something is missing there or that a value of the rig file is wrong,
        whatever its name.
    intervals : list of (start, stop)
        When [s].
    conditions : list of Condition
        Under which conditions, the most significant first.
    text : str
        In words.
    recording : str or None
        Recording to which the intervals belong.
    """

    block: str | None = None
    channel: str | None = None
    probability: float | None = field(default=None, metadata=OPTIONAL)
    intervals: list[list[float]] = field(default_factory=list)
    conditions: list[Condition] = field(default_factory=list)
    text: str = ""
    recording: str | None = field(default=None, metadata=NOT_WRITTEN | OPTIONAL)


@dataclass(frozen=True, eq=False)
class EffectParameterFound(Entry):
    """A parameter of an effect, as fitted; SI.

    Attributes
    ----------
    value : float
        Its value.
    std : float or None
        Standard deviation; None where the value was chosen of a few, and where no recording
        depends on it.
    unit : str
        SI unit.
    interval : list of two floats, optional
        95 % interval.
    identifiable : bool, optional
        Whether the recordings determine it.
    """

    value: float
    std: float | None
    unit: str
    interval: list[float] | None = field(default=None, metadata=OPTIONAL)
    identifiable: bool | None = field(default=None, metadata=OPTIONAL)


@dataclass(frozen=True, eq=False)
class EffectFound(Entry):
    """An effect that is named, or that comes closest.

    Attributes
    ----------
    id, name : str
        Id in the catalogue, and in words.
    at : str
        Name of the block at which it acts, where the rig has several of that kind; empty where it
        acts at every one.
    form : str
        Which form of its equation predicts best, where it has several; empty for the usual one.
    probability : float
        Of the effect, whatever its form and whatever else acts.
    parameters : dict of str to EffectParameterFound
        By name.
    events : list of dict
        What happened in single recordings: ``recording``, ``time`` and the effect's other
        parameters, SI.
    correction : str
        Form of what its equation lacks, in words, where the model contains one.
    """

    id: str
    name: str = ""
    at: str = ""
    form: str = ""
    probability: float = math.nan
    parameters: dict[str, EffectParameterFound] = field(default_factory=dict)
    events: list[dict[str, Any]] = field(default_factory=list, metadata=OMIT_EMPTY)
    correction: str = field(default="", metadata=OMIT_EMPTY)

    @property
    def term(self) -> str:
        """Name in hypotheses: its id, and behind an ``@`` the block at which it acts."""
        return f"{self.id}@{self.at}" if self.at else self.id


@dataclass(frozen=True, eq=False)
class MismatchSize(Entry):
    """Size of a residual beyond the noise.

    Attributes
    ----------
    noises, size : float
        In units of the noise, and in the unit of the channel.
    more_than_noise : bool
        Whether it is more than noise could leave.
    """

    noises: float
    size: float
    more_than_noise: bool


@dataclass(frozen=True, eq=False)
class MismatchStages(Entry):
    """Sizes of a residual beyond the noise, before and after.

    Attributes
    ----------
    before, refit, after : MismatchSize
        With the nominal model, refitted inside its tolerances, and with what was found.
    """

    before: MismatchSize
    refit: MismatchSize
    after: MismatchSize


@dataclass(frozen=True, eq=False)
class BlockMismatch(Entry):
    """Mismatch of one block, on fitted and on held-out recordings.

    Attributes
    ----------
    block, channel, unit : str
        The block, the channel that it predicts, and its SI unit.
    fitted : MismatchStages
        On the recordings that were fitted.
    held_out : MismatchStages or None
        On those held out; None where there are none.
    model_error : float
        What the error that is taken for the model's own does to the channel [unit], one standard
        deviation: what is left inside it is not called missing.
    """

    block: str
    channel: str
    unit: str
    fitted: MismatchStages
    held_out: MismatchStages | None
    model_error: float = 0.0


@dataclass(frozen=True, eq=False)
class BlockVerdict(Entry):
    """The verdict of a group of blocks that is judged by itself, or that a block is not judged.

    Attributes
    ----------
    blocks : list of str
        Names of its blocks.
    verdict : str
        ``none``, ``parameters``, ``effects`` or ``unlisted``; ``not_judged`` of a block that these
        recordings cannot judge.
    probabilities : dict of str to float
        Over its hypotheses: effects by id, wrong parameters by dotted name, sets joined by ``+``.
    effects, wrong_parameters : list of str
        What is named.
    ambiguity : list of list of str
        Sets that the data cannot separate.
    mismatch : list of BlockMismatch
        What each block misses.
    covers : str
        Of a block that is not judged, what of the rig it stands for, in words.
    reason : str
        Why it is not judged; empty where it is.
    block : str or None
        Which of its blocks has the mismatch, or the value that is wrong; None where nothing is.
    unseen : float
        Part of the probability of ``unlisted``: that nothing is seen, and an effect acts that the
        recordings would hardly show at its usual sizes (``limits``).
    """

    blocks: list[str]
    verdict: str
    probabilities: dict[str, float]
    effects: list[str]
    wrong_parameters: list[str]
    ambiguity: list[list[str]]
    mismatch: list[BlockMismatch] = field(default_factory=list)
    covers: str = ""
    reason: str = ""
    block: str | None = None
    unseen: float = 0.0


@dataclass(frozen=True, eq=False)
class Unexplained(Entry):
    """A block with a mismatch that stays unexplained.

    Attributes
    ----------
    block, channel, unit : str
        The block, the channel that it predicts, and its SI unit.
    noises, size : float
        Error of the channel with what is named (refitted, where nothing is), noise included, as
        the table of errors has it: in units of the noise, and in the unit of the channel.
    verdict : str
        Of its group of blocks.
    share : float or None
        Of the nominal model's excess variance over the noise; None where the nominal model has
        none on these recordings.
    interval : list of two floats or None
        95 % interval of the share.
    conditions : list of Condition
        Under which it is largest, the most significant first.
    form : str
        What it is a function of, in words, where such a form carries over to other recordings.
    role : str
        Of the recordings that its size is of: ``held_out`` or ``fit``.
    """

    block: str
    channel: str
    unit: str
    noises: float
    size: float
    verdict: str
    share: float | None = None
    interval: list[float] | None = None
    conditions: list[Condition] = field(default_factory=list)
    form: str = ""
    role: str = ""


@dataclass(frozen=True, eq=False)
class BudgetTerm(Entry):
    """One term of a block's mismatch budget; the shares of a block add up to 1.

    Attributes
    ----------
    block : str
        The block.
    kind : str
        ``held`` (an effect that the nominal model holds already), ``parameters`` (inside their
        tolerances), ``wrong_parameter``, ``effect``, ``form`` (without a name) or ``unexplained``.
    id : str
        Id of the effect, or dotted names of the parameters joined by ``+``; else empty.
    form : str
        Form of the effect where it is not the usual one.
    share : float
        Share of the excess variance over the noise (of the nominal model, without the effects that
        it holds), with all values as in the final model. Parameters inside their tolerances take
        what they take by themselves, names what the final model takes beyond that. Several names
        divide it in proportion to the squares of what each changes in the prediction. Negative
        where a step predicts worse.
    interval : list of two floats
        95 % interval of the share.
    probability : float or None
        Of the name, whatever else acts in the blocks that are judged with this one.
    noises, size : float
        What the block keeps with it and all terms before it, in units of the noise and in the
        channel's unit, with all values as in the final model.
    unit : str
        SI unit.
    at : str
        Name of the block at which the effect acts; empty where it acts at every block of its kind.
    parameters : dict of str to EffectParameterFound
        Values of the term: those of the effect, or of the wrong parameters by dotted name, SI.
    """

    block: str
    kind: str
    id: str
    form: str
    share: float
    interval: list[float]
    probability: float | None
    noises: float
    size: float
    unit: str
    at: str = ""
    parameters: dict[str, EffectParameterFound] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class StageError(Entry):
    """Root mean square error of a channel, before and after, SI.

    Attributes
    ----------
    before, refit, after : float
        Of the nominal model, refitted inside its tolerances, and with what was found.
    """

    before: float
    refit: float
    after: float


@dataclass(frozen=True, eq=False)
class ChannelError(Entry):
    """Root mean square error of a channel, and its noise, SI.

    Attributes
    ----------
    noise : float
        Standard deviation of the sensor's noise.
    before, refit, after : float
        Error of the nominal model, after refitting parameters only, and with what was found.
    """

    noise: float
    before: float
    refit: float
    after: float


@dataclass(frozen=True, eq=False)
class Misread(Entry):
    """Channels that are likely in another unit, or pressures with another zero, than the log says.

    Attributes
    ----------
    channels : list of str
        Which ones.
    said, likely : str
        The unit that the log says, and the one that fits; ``gauge`` and ``absolute`` where the zero
        is another one.
    factors : list of float
        By which the values of each channel are to be multiplied.
    offset : float
        What is to be added to them then, SI.
    before, after : float
        Mean square of what the refitted baseline leaves of all blocks, in variances of the noise,
        as the log says and read so.
    text : str
        The same in words.
    gain, std : float
        Of a factor of a few per cent: the one that is free, and its standard error; NaN of others.
    """

    channels: list[str]
    said: str
    likely: str
    factors: list[float]
    offset: float
    before: float
    after: float
    text: str
    gain: float = field(default=math.nan, metadata=NOT_WRITTEN)
    std: float = field(default=math.nan, metadata=NOT_WRITTEN)


@dataclass(frozen=True, eq=False)
class Faulty(Entry):
    """A channel that its sensor or logger spoiled, so that the rest is judged without it.

    Attributes
    ----------
    channel : str
        Which one.
    kind : str
        ``clipped``: the samples at the end of its sensor's range are masked; ``not_logged``: a
        command of one value, which cannot be what the valve got, is left out.
    text : str
        The same in words, with the evidence.
    """

    channel: str
    kind: str
    text: str


@dataclass(frozen=True, eq=False)
class OtherLaw(Entry):
    """A law that the recordings follow instead of that which the rig file chooses.

    Attributes
    ----------
    name, stated, other : str
        Key of the rig file, its choice, and the choice under which all of the rest is judged.
    channel, unit : str
        The channel that tells most, and its SI unit.
    before, after, noise : float
        Its error with values refitted inside their tolerances, under ``stated`` and under
        ``other``, and its noise, SI.
    """

    name: str
    stated: str
    other: str
    channel: str
    unit: str
    before: float
    after: float
    noise: float


@dataclass(frozen=True, eq=False)
class WrongParameter(Entry):
    """A value of the rig file that is wrong; SI.

    Attributes
    ----------
    name : str
        Dotted name, ``chamber.dead_volume``.
    block : str or None
        Block of the chain that tells.
    nominal, tolerance : float
        Value in the rig file, and one standard deviation by it.
    value, std : float
        Value that the recordings ask for, and its standard deviation.
    interval : list of two floats
        95 % interval.
    unit : str
        SI unit.
    moved_sigmas : float
        Distance of the two values in tolerances; downwards, of a positive value, by their ratio.
    probability : float
        That the file is wrong about it.
    held_out : dict of str to StageError
        Error of each channel that it acts on.
    """

    name: str
    block: str | None
    nominal: float
    tolerance: float
    value: float
    std: float
    interval: list[float]
    unit: str
    moved_sigmas: float
    probability: float
    held_out: dict[str, StageError]


@dataclass(frozen=True, eq=False)
class ParameterFound(Entry):
    """A parameter of the baseline, as fitted; SI.

    Attributes
    ----------
    nominal, value, std : float
        Value in the rig file, fitted value and its standard deviation.
    unit : str
        SI unit.
    moved_sigmas : float
        Distance of the two values in tolerances; downwards, of a positive value, by their ratio.
    identifiable : bool, optional
        Whether the recordings determine it.
    """

    nominal: float
    value: float
    std: float
    unit: str
    moved_sigmas: float
    identifiable: bool | None = field(default=None, metadata=OPTIONAL)

    @property
    def known(self) -> bool:
        """True where the recordings determine how far it moved."""
        return self.identifiable is not False and math.isfinite(self.moved_sigmas)


@dataclass(frozen=True, eq=False)
class FitErrors(Entry):
    """Errors of the models by channel, and the share of the gap to the noise that is closed.

    Attributes
    ----------
    channels, held_out : dict of str to ChannelError
        On the recordings that were fitted, and on those held out.
    gap_closed : float or None
        (refit - after)/(refit - noise), held-out recordings, channels pooled in units of their
        noise; 1 is down to the noise.
    """

    channels: dict[str, ChannelError] = field(default_factory=dict)
    held_out: dict[str, ChannelError] = field(default_factory=dict)
    gap_closed: float | None = None


@dataclass(frozen=True, eq=False)
class FreeRunError(Entry):
    """Root mean square error of a channel in a free run, and in the cut chain.

    Attributes
    ----------
    unit : str
        SI unit of all of them.
    before, after : float
        Of the whole rig from its commands alone: nominal model, and with what was found; NaN where
        the simulation left its range.
    cut_before, cut_after : float or None
        Of the block driven by its measured neighbours; None where no block predicts the channel.
    noise : float or None
        Sample noise of the channel, with what the drives of its block bring into it.
    off : bool
        Whether `after` is many noise levels, and more than the values of the rig, as far as they
        are known, explain: evidence that something is missing, whatever the blocks say.
    """

    unit: str
    before: float
    after: float
    cut_before: float | None
    cut_after: float | None
    noise: float | None = None
    off: bool = False

    @property
    def noises(self) -> float:
        """`after` in units of the noise; NaN where that is not known."""
        return self.after / self.noise if self.noise else math.nan

    @property
    def times_before(self) -> float:
        """`before` in units of the noise; nothing where that is not known."""
        times = self.before / self.noise if self.noise else 0.0
        return times if math.isfinite(times) else 0.0


@dataclass(frozen=True, eq=False)
class FreeRun(Entry):
    """One recording simulated as a whole, from its commands and its first measured values.

    Attributes
    ----------
    recording, role : str
        Its name; ``fit`` or ``held_out``.
    seconds : float
        How long it is [s].
    channels : dict of str to FreeRunError
        By measured channel.
    note : str
        Why a model gives no numbers; empty where both do.
    """

    recording: str
    role: str
    seconds: float
    channels: dict[str, FreeRunError]
    note: str = ""
