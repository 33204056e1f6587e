"""The entries of a diagnosis, from the smallest to the whole."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Final, Protocol

import numpy as np
import numpy.typing as npt

from pamrs.findings._entry import Entry, told

__all__ = [
    "VERDICTS",
    "Asked",
    "BlockMismatch",
    "BlockResidual",
    "BlockVerdict",
    "ChannelError",
    "Condition",
    "ConditionMap",
    "Curves",
    "EffectFound",
    "EffectParameterFound",
    "Findings",
    "FitErrors",
    "MismatchSize",
    "MismatchStages",
    "ModelFile",
    "NextExperiment",
    "ParameterFound",
    "RankedExperiment",
    "StageError",
    "Trace",
    "Tried",
    "Unexplained",
    "Where",
    "WrongParameter",
]

FloatArray = npt.NDArray[np.float64]

VERDICTS: Final = ("none", "parameters", "effects", "unlisted")
"""Allowed verdicts."""


class ModelFile(Protocol):
    """Anything that can write itself as a model file; normally a `pamrs.Rig`."""

    def to_toml_text(self) -> str:
        """Return the model as TOML."""


@dataclass(frozen=True)
class Trace:
    """One channel of one recording, measured and simulated.

    Parameters
    ----------
    recording, role : str
        Name of the recording; role ``fit`` or ``held_out``.
    channel, unit : str
        Canonical channel and its SI unit.
    time : array_like, shape (n,)
        Time in s.
    measured, before : array_like, shape (n,)
        Measurement and simulation with the nominal model, in `unit`; NaN where masked.
    refit, after : array_like or None, shape (n,)
        Simulation after the refit of parameters only, and with the effect; None becomes NaN.
    residual_before, residual_after : array_like or None, shape (n,)
        Residual of the refitted baseline and of the model with the effect; by default measured
        minus `refit` (or `before` when there is no refit) and measured minus `after`.

    Raises
    ------
    ValueError
        If an array has not the shape of `time`.
    """

    recording: str
    role: str
    channel: str
    unit: str
    time: FloatArray
    measured: FloatArray
    before: FloatArray
    refit: FloatArray | None = None
    after: FloatArray | None = None
    residual_before: FloatArray | None = None
    residual_after: FloatArray | None = None

    def __post_init__(self) -> None:
        def put(name: str, array: FloatArray) -> None:
            object.__setattr__(self, name, array)

        put("time", np.asarray(self.time, dtype=np.float64))
        curves = ("measured", "before", "refit", "after", "residual_before", "residual_after")
        for name in curves:
            value = getattr(self, name)
            if value is None:
                continue
            array = np.asarray(value, dtype=np.float64)
            if array.shape != self.time.shape or array.ndim != 1:
                raise ValueError(
                    f"trace {self.recording}/{self.channel}: {name} has shape {array.shape}, "
                    f"time has shape {self.time.shape}; both must be the same (n,)"
                )
            put(name, array)
        nan = np.full(self.time.shape, np.nan)
        baseline = self.before if self.refit is None else self.refit
        after = nan.copy() if self.after is None else self.after
        put("refit", nan.copy() if self.refit is None else self.refit)
        put("after", after)
        if self.residual_before is None:
            put("residual_before", self.measured - baseline)
        if self.residual_after is None:
            put("residual_after", self.measured - after)


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
        Mean residual there [noises].
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
    """Where the mismatch is.

    Attributes
    ----------
    block, channel : str or None
        Block of the chain that carries the excess residual, and the channel that tells.
    intervals : list of (start, stop)
        When [s].
    conditions : list of Condition
        Under which conditions, the most telling first.
    text : str
        In words.
    recording : str or None
        Recording to which the intervals belong.
    """

    block: str | None = field(
        default=None, metadata=told("block of the chain that carries the excess residual")
    )
    channel: str | None = field(default=None, metadata=told("channel that tells"))
    intervals: list[list[float]] = field(
        default_factory=list, metadata=told("start and stop in s", kind="pairs")
    )
    conditions: list[Condition] = field(
        default_factory=list, metadata=told("operating conditions that carry the excess")
    )
    text: str = ""
    recording: str | None = field(default=None, metadata=told(json=False, optional=True))


@dataclass(frozen=True, eq=False)
class EffectParameterFound(Entry):
    """A parameter of an effect, as fitted; SI.

    Attributes
    ----------
    value : float
        Its value.
    std : float or None
        Standard deviation; None where the value was chosen of a few.
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
    interval: list[float] | None = field(
        default=None, metadata=told("95 % interval", optional=True, kind="pair")
    )
    identifiable: bool | None = field(default=None, metadata=told(optional=True))


@dataclass(frozen=True, eq=False)
class EffectFound(Entry):
    """An effect that is named, or that comes closest.

    Attributes
    ----------
    id, name : str
        Id in the catalogue, and in words.
    probability : float
        Of the effect, whatever else acts.
    inclusion : float or None
        Share of resampled recordings in which the screen would have taken it.
    parameters : dict of str to EffectParameterFound
        By name.
    events : list of dict
        What happened in single recordings: ``recording``, ``time`` and the effect's other
        parameters, SI.
    """

    id: str = field(metadata=told(least_length=1))
    name: str = field(default="", metadata=told(json=False))
    probability: float = field(default=math.nan, metadata=told(kind="probability"))
    inclusion: float | None = field(
        default=None,
        metadata=told(
            "share of resampled recordings in which the screen would have taken the effect",
            kind="probability",
            omit_empty=True,
        ),
    )
    parameters: dict[str, EffectParameterFound] = field(default_factory=dict)
    events: list[dict[str, Any]] = field(
        default_factory=list,
        metadata=told("what happened in single recordings, SI", omit_empty=True, kind="events"),
    )


@dataclass(frozen=True, eq=False)
class MismatchSize(Entry):
    """What is more than noise.

    Attributes
    ----------
    noises, size : float
        In units of the noise, and in the unit of the channel.
    more_than_noise : bool
        Whether it is more than noise could leave.
    """

    noises: float = field(metadata=told("in units of the noise"))
    size: float = field(metadata=told("in the unit of the channel"))
    more_than_noise: bool = field(metadata=told("whether it is more than noise could leave"))


@dataclass(frozen=True, eq=False)
class MismatchStages(Entry):
    """What is more than noise, before and after.

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
    """What one block misses.

    Attributes
    ----------
    block, channel, unit : str
        The block, the channel that it predicts, and its SI unit.
    fitted : MismatchStages
        On the recordings that were fitted.
    held_out : MismatchStages or None
        On those held out; None where there are none.
    """

    block: str
    channel: str
    unit: str
    fitted: MismatchStages
    held_out: MismatchStages | None = field(metadata=told("null where nothing was held out"))


@dataclass(frozen=True, eq=False)
class BlockVerdict(Entry):
    """The verdict of a group of blocks that is judged by itself.

    Attributes
    ----------
    blocks : list of str
        Names of its blocks.
    verdict : str
        ``none``, ``parameters``, ``effects`` or ``unlisted``.
    probabilities : dict of str to float
        Over its hypotheses: effects by id, wrong parameters by dotted name, sets joined by ``+``.
    effects, wrong_parameters : list of str
        What is named.
    ambiguity : list of list of str
        Sets that the data cannot separate.
    mismatch : list of BlockMismatch
        What each block misses.
    """

    blocks: list[str] = field(metadata=told("names of its blocks"))
    verdict: str = field(metadata=told(enum=VERDICTS))
    probabilities: dict[str, float] = field(
        metadata=told(
            "over its hypotheses: effects by id, wrong parameters by dotted name, sets joined by +",
            kind="probability",
        )
    )
    effects: list[str] = field(metadata=told("ids that are named"))
    wrong_parameters: list[str] = field(metadata=told("parameters that are named"))
    ambiguity: list[list[str]]
    mismatch: list[BlockMismatch] = field(default_factory=list)


@dataclass(frozen=True, eq=False)
class Unexplained(Entry):
    """A block that keeps a mismatch.

    Attributes
    ----------
    block, channel, unit : str
        The block, the channel that it predicts, and its SI unit.
    noises, size : float
        How much, in units of the noise and in the unit of the channel.
    verdict : str
        Of its group of blocks.
    """

    block: str
    channel: str
    unit: str
    noises: float = field(metadata=told("in units of the noise"))
    size: float = field(metadata=told("in the unit of the channel"))
    verdict: str = field(metadata=told("of its group of blocks", enum=VERDICTS[1:]))


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
    """Root mean square error of a channel beside its noise, SI.

    Attributes
    ----------
    noise : float
        Standard deviation of the sensor's noise.
    before, refit, after : float
        Error of the nominal model, after refitting parameters only, and with what was found.
    """

    noise: float = field(metadata=told("standard deviation of the sensor noise"))
    before: float = field(metadata=told("root mean square error of the nominal model"))
    refit: float = field(
        metadata=told("root mean square error after refitting parameters only")
    )
    after: float = field(metadata=told("root mean square error with the effect"))


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
        Distance of the two values in tolerances.
    probability : float
        That the file is wrong about it.
    held_out : dict of str to StageError
        Error of each channel that it acts on.
    """

    name: str
    block: str | None
    nominal: float = field(metadata=told("value in the rig file"))
    tolerance: float = field(metadata=told("one standard deviation, by the rig file"))
    value: float = field(metadata=told("value that the recordings ask for"))
    std: float
    interval: list[float] = field(metadata=told("95 %", kind="pair"))
    unit: str
    moved_sigmas: float = field(metadata=told("distance of the two in tolerances"))
    probability: float = field(metadata=told(kind="probability"))
    held_out: dict[str, StageError] = field(
        metadata=told(
            "root mean square error of each channel it acts on: nominal model, refitted inside "
            "the tolerances, with the other value"
        )
    )


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
        Distance of the two values in tolerances.
    identifiable : bool, optional
        Whether the recordings determine it.
    """

    nominal: float
    value: float
    std: float
    unit: str
    moved_sigmas: float
    identifiable: bool | None = field(default=None, metadata=told(optional=True))


@dataclass(frozen=True, eq=False)
class FitErrors(Entry):
    """How well the models predict each channel.

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
    gap_closed: float | None = field(
        default=None,
        metadata=told(
            "(refit - after)/(refit - noise), held-out data, channels pooled in units of their "
            "noise; 1 is down to the noise"
        ),
    )


@dataclass(frozen=True, eq=False)
class RankedExperiment(Entry):
    """An experiment that was compared.

    Attributes
    ----------
    name, text, sensor : str
        Its kind, in words, and the channel that it needs besides those there are.
    bits : float
        Expected information about the model [bit].
    effort_s : float
        What it costs, as time [s].
    """

    name: str
    text: str
    sensor: str
    bits: float
    effort_s: float


@dataclass(frozen=True, eq=False)
class Curves(Entry):
    """The channel that separates hypotheses most, in the next experiment.

    Attributes
    ----------
    experiment, text : str
        Which one, and in words.
    channel, unit : str
        The channel and its SI unit.
    time : (n,) array
        [s].
    predicted : dict of str to (n,) array
        The channel by hypothesis (key ``values``).
    leading : str
        The most probable hypothesis.
    bin_time : (m,) array
        [s].
    left : dict of str to (m,) array
        What each other hypothesis cannot explain of the leading one's outcome.
    noise : float
        Noise level of a bin.
    command : (n,) array or None
        Valve command [V].
    samples_counted : float
        Independent samples that a recording counts as.
    """

    experiment: str
    text: str
    channel: str
    unit: str
    time: FloatArray
    predicted: Mapping[str, FloatArray] = field(metadata=told(key="values"))
    leading: str
    bin_time: FloatArray
    left: Mapping[str, FloatArray]
    noise: float
    command: FloatArray | None
    samples_counted: float


@dataclass(frozen=True, eq=False)
class NextExperiment(Entry):
    """What to record next.

    Attributes
    ----------
    text : str
        What to do and why.
    excitation : dict
        The same for a program: ``kind`` and numbers with their unit in the name.
    expected_information_bits : float or None
        What it would tell about the model; None where it was not simulated.
    ranking : list of RankedExperiment
        The experiments that were compared, the most telling first.
    curves : Curves or None
        The channel that separates most.
    """

    text: str = ""
    excitation: dict[str, Any] = field(default_factory=dict)
    expected_information_bits: float | None = None
    ranking: list[RankedExperiment] = field(default_factory=list, metadata=told(json=False))
    curves: Curves | None = field(default=None, metadata=told(json=False))


@dataclass(frozen=True, eq=False)
class BlockResidual(Entry):
    """Residual of a block's refitted baseline against its noise.

    Attributes
    ----------
    rms, noise : float
        Residual and noise level of single samples, in the channel's unit.
    excess : float
        What is not noise, in units of the noise.
    p_value : float
        Chance of that from noise.
    channel : str
        Channel that the block predicts.
    """

    rms: float
    noise: float
    excess: float
    p_value: float
    channel: str


@dataclass(frozen=True, eq=False)
class ConditionMap(Entry):
    """Mean residual over two conditions.

    Attributes
    ----------
    x_label, y_label : str
        The conditions.
    x_edges, y_edges : list of float
        Edges of the cells, lengths m + 1 and n + 1.
    z, z_after : (n, m) list of list of float
        Mean residual in units of the noise before and after; NaN where there are no data.
    block : str
        The block.
    """

    x_label: str
    y_label: str
    x_edges: Any
    y_edges: Any
    z: Any
    z_after: Any = None
    block: str = ""


@dataclass(frozen=True, eq=False)
class Tried(Entry):
    """A set of effects, or of wrong values, that was fitted.

    Attributes
    ----------
    blocks, effects, wrong_parameters : list of str
        Blocks of its group, and what it names.
    fitted, held_out : dict of str to float
        What it leaves of each block's variance, in units of the noise's.
    gap_closed : float
        Share of the baseline's excess that it takes on held-out recordings.
    scatter : float
        Relative scatter of its size between recordings.
    fitted_values, std : dict of str to float
        Parameters of its effects, SI (key ``values``), and their standard deviations.
    prior : float
        Sum of squares of the baseline's movement [tolerances].
    suspects : list of str
        Blocks that kept an excess.
    gain : float
        Gain in chi-square that the screen promised.
    """

    blocks: list[str]
    effects: list[str]
    wrong_parameters: list[str]
    fitted: dict[str, float]
    held_out: dict[str, float]
    gap_closed: float
    scatter: float
    fitted_values: dict[str, float] = field(metadata=told(key="values"))
    std: dict[str, float]
    prior: float
    suspects: list[str]
    gain: float


@dataclass(frozen=True, eq=False)
class Asked(Entry):
    """A persistent effect that acts where the mismatch is.

    Attributes
    ----------
    id : str
        Its id.
    blocks : list of str
        Where.
    promised : float
        Share of the mismatch that its signature could take before any fit.
    left : float or None
        Share that it leaves fitted alone; None where it promised too little.
    """

    id: str
    blocks: list[str]
    promised: float
    left: float | None


@dataclass(frozen=True)
class Findings:
    """What a diagnosis found, as plain data; `pamrs.Diagnosis` adds what can be done with it.

    Attributes
    ----------
    case : str
        Name of the case.
    verdict : str
        ``none``, ``parameters``, ``effects`` or ``unlisted``.
    where : Where
        Block, channel, intervals, conditions, and a sentence.
    effects : list of EffectFound
        What is named (with the verdict ``unlisted`` what comes closest), most probable first.
    ambiguity : list of list of str
        Sets of names (effects, wrong parameters by dotted name, ``unlisted``, ``parameters``) that
        the data cannot separate; empty when settled.
    probabilities : dict
        Probability of what the case may be told to have: names of all its blocks joined by ``+``,
        ``none``, ``parameters`` (that moved inside their tolerances), or ``unlisted`` (something
        is missing and nothing has a name). Those of each block are in ``blocks``.
    blocks : list of BlockVerdict
        The verdict of each group of blocks.
    unexplained : list of Unexplained
        Blocks that keep a mismatch, the largest first.
    wrong_parameters : list of WrongParameter
        Values of the rig file that are wrong.
    parameters : dict of str to ParameterFound
        Parameters of the baseline, SI.
    fit : FitErrors
        Error of each channel, and how much of the gap to the noise is closed.
    next_experiment : NextExperiment
        What to record next.
    warnings : list of str
        What the user should know before trusting the rest.
    seconds : float
        Wall time.
    text : str
        The verdict in words, several sentences; paragraphs are separated by a blank line.
    rig : Rig or None
        Final model, with what was found.
    traces : list of Trace
        Measured and simulated channels.
    residuals : dict of str to BlockResidual
        Residual of each block's refitted baseline against its noise.
    condition_map : ConditionMap or None
        Mean residual over two conditions.
    timings : dict
        Seconds of each stage, optional.
    tried : list of Tried
        Every set of effects that was fitted.
    asked : list of Asked
        Every persistent effect that acts where the mismatch is.

    Raises
    ------
    ValueError
        If `verdict` is none of the allowed four.
    """

    case: str = field(metadata=told(json=False))
    verdict: str = field(metadata=told(enum=VERDICTS))
    where: Where = field(default_factory=Where)
    effects: list[EffectFound] = field(
        default_factory=list, metadata=told("the named physics, most probable first")
    )
    ambiguity: list[list[str]] = field(
        default_factory=list,
        metadata=told("sets of effects that the data cannot separate; empty when settled"),
    )
    probabilities: dict[str, float] = field(
        default_factory=dict, metadata=told("over all hypotheses", kind="probability")
    )
    blocks: list[BlockVerdict] = field(
        default_factory=list,
        metadata=told(
            "the verdict of each group of blocks that is judged by itself", required=False
        ),
    )
    unexplained: list[Unexplained] = field(
        default_factory=list,
        metadata=told("blocks that keep a mismatch, the largest first", required=False),
    )
    wrong_parameters: list[WrongParameter] = field(
        default_factory=list,
        metadata=told("values of the rig file that are wrong", required=False),
    )
    parameters: dict[str, ParameterFound] = field(default_factory=dict)
    fit: FitErrors = field(default_factory=FitErrors)
    next_experiment: NextExperiment = field(default_factory=NextExperiment)
    warnings: list[str] = field(default_factory=list)
    seconds: float = 0.0
    text: str = field(default="", metadata=told(json=False))
    rig: ModelFile | None = field(default=None, metadata=told(json=False))
    traces: list[Trace] = field(default_factory=list, metadata=told(json=False))
    residuals: dict[str, BlockResidual] = field(default_factory=dict, metadata=told(json=False))
    condition_map: ConditionMap | None = field(default=None, metadata=told(json=False))
    timings: dict[str, float] = field(default_factory=dict, metadata=told(json=False))
    tried: list[Tried] = field(default_factory=list, metadata=told(json=False))
    asked: list[Asked] = field(default_factory=list, metadata=told(json=False))

    def __post_init__(self) -> None:
        if self.verdict not in VERDICTS:
            raise ValueError(f"verdict is {self.verdict!r}; allowed are {', '.join(VERDICTS)}")

    @property
    def model(self) -> str:
        """The model with the effect, as TOML; empty when there is no model."""
        return "" if self.rig is None else self.rig.to_toml_text()

    @property
    def proof(self) -> str:
        """The recordings on which the gap was measured, in words."""
        if self.fit.held_out:
            return "held-out recordings"
        return "the fitted recordings (none was held out)"
