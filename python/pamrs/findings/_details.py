"""Entries of a result next to the answer: next experiment, residuals, everything that was tried."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from pamrs._arrays import Array
from pamrs.findings._entry import NOT_WRITTEN, OPTIONAL, Entry

DETECTED = 3.86
"""Signature left [standard deviations] that is detected in 90 %, with 1 % of false alarms."""
TOLD_APART = 4.0
"""Distance of two effects [standard deviations] from which one is told from the other."""


@dataclass(frozen=True, eq=False)
class Limit(Entry):
    """Sizes from which some recordings show an effect, and from which they can name it.

    Attributes
    ----------
    effect : str
        Its id, with a place where it may act at one of several blocks: ``leak_muscle@flexor``.
    left : float
        Signature at the typical size after parameters took what they can inside their tolerances,
        root mean square in the recording where that is largest [noise levels].
    block, recording : str
        Where; empty when it acts in no block that the channels surround.
    seen, distance : float
        Signature at the typical size after the error of the model took what it can as well, and
        after its nearest rival did at any size [standard deviations].
    rival : str
        That rival: another effect, or a parameter of the rig file by its dotted name.
    size : str
        Dotted name of the parameter that scales the effect; empty where no number does.
    typical, seen_from, named_from : float
        A typical value of that parameter, the one from which the effect is detected (in 90 %, with
        1 % of false alarms), and the one from which it is named, as it is four standard deviations
        from its rival; of a restriction's conductance the largest ones [SI]; NaN without one.
    """

    effect: str
    left: float = 0.0
    block: str = ""
    recording: str = ""
    seen: float = 0.0
    distance: float = 0.0
    rival: str = ""
    size: str = ""
    typical: float = math.nan
    seen_from: float = math.nan
    named_from: float = math.nan

    @property
    def verdict(self) -> str:
        """``named``, ``seen`` or ``not seen`` at the typical size."""
        if self.distance >= TOLD_APART:
            return "named"
        return "seen" if self.seen >= DETECTED else "not seen"


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
        What is sent to the first chain of the rig: a valve's command [V], or the set pressure of a
        regulator [Pa, gauge]; every command by its channel is in ``protocol``.
    samples_counted : float
        Independent samples that a recording counts as.
    """

    experiment: str
    text: str
    channel: str
    unit: str
    time: Array
    predicted: Mapping[str, Array] = field(metadata={"key": "values"})
    leading: str
    bin_time: Array
    left: Mapping[str, Array]
    noise: float
    command: Array | None
    samples_counted: float


@dataclass(frozen=True, eq=False)
class PairExperiment(Entry):
    """Experiment or measurement that separates two hypotheses that are both left open.

    Attributes
    ----------
    between : list of str
        The two, names joined by ``+``; ``unlisted`` for something without a name.
    text : str
        What to record or to measure, and what it shows.
    experiment : str
        Kind of the experiment; empty where there is none that a program could play.
    noises : float or None
        What the one misses of what the other predicts there, the smaller of both ways, in noise
        levels; where the one is a case of the other, and of a name against ``unlisted``, what the
        model without the name misses. None where it was not simulated.
    """

    between: list[str]
    text: str
    experiment: str = ""
    noises: float | None = None


@dataclass(frozen=True, eq=False)
class Protocol(Entry):
    """Commands of an experiment, as a rig can play them.

    Attributes
    ----------
    name : str
        Kind of the experiment.
    time : (n,) array
        [s].
    commands : dict of str to (n,) array
        By channel: ``valve_command`` [V], ``supply_command`` and ``pressure_command`` [Pa, gauge],
        ``length`` [m].
    units : dict of str to str
        SI unit of each channel.
    """

    name: str
    time: Array
    commands: Mapping[str, Array]
    units: Mapping[str, str]

    def to_csv(self) -> str:
        """The commands as CSV text, one row per sample, headings with units; as a file it is a
        recording of inputs that ``pamrs simulate RIG --input`` plays.
        """
        headings = ["time [s]", *(f"{name} [{self.units[name]}]" for name in self.commands)]
        columns = np.column_stack([self.time, *self.commands.values()])
        rows = [",".join(f"{value:.9g}" for value in row) for row in columns]
        return "\n".join([",".join(headings), *rows]) + "\n"


@dataclass(frozen=True, eq=False)
class Form(Entry):
    """Function that a mismatch without a name follows in one block.

    Attributes
    ----------
    block, covers : str
        The block, and what it covers.
    closure : str
        Id of the closure that was fitted.
    effective, largest : float
        Root mean square over the recordings, and the 99th percentile of its size [SI].
    taken : float
        Share of the block's mismatch that it takes.
    shares : dict of str to float
        Share of each kind of dependence (``static``, ``even``, ``odd``, ``time``, ``distance``).
    memory : dict of str to float or None
        Time [s] or distance [rad] over which it remembers, by kind.
    terms : dict of str to (float, float)
        Coefficient of each term and its standard deviation [SI].
    """

    block: str
    covers: str
    closure: str
    effective: float
    largest: float
    taken: float
    shares: dict[str, float]
    memory: dict[str, float | None]
    terms: dict[str, tuple[float, float]]


@dataclass(frozen=True, eq=False)
class NextExperiment(Entry):
    """Experiment to record next, and its reason.

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
    pairs : list of PairExperiment
        What tells each two hypotheses that are left open from each other.
    protocol : Protocol or None
        The commands; None where nothing is sent, or no experiment is proposed.
    instruction : str
        What to record, whole; empty where nothing is to be recorded.
    hypotheses : list of (str, model, float)
        What was left and has a model: label, rig as fitted, probability.
    noise : dict of str to float
        Sample noise of the recordings by channel [SI].
    """

    text: str = ""
    excitation: dict[str, Any] = field(default_factory=dict)
    expected_information_bits: float | None = None
    ranking: list[RankedExperiment] = field(default_factory=list, metadata=NOT_WRITTEN)
    curves: Curves | None = field(default=None, metadata=NOT_WRITTEN)
    pairs: list[PairExperiment] = field(default_factory=list)
    protocol: Protocol | None = field(default=None, metadata=OPTIONAL)
    instruction: str = ""
    hypotheses: list[tuple[str, Any, float]] = field(default_factory=list, metadata=NOT_WRITTEN)
    noise: dict[str, float] = field(default_factory=dict, metadata=NOT_WRITTEN)


@dataclass(frozen=True, eq=False)
class BlockResidual(Entry):
    """Residual of a block's refitted baseline against the noise level.

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
    fitted_values, std : dict of str to float
        Parameters of its effects, SI (key ``values``), and their standard deviations.
    prior : float
        Sum of squares of the baseline's movement [tolerances].
    suspects : list of str
        Blocks whose residual exceeds the noise.
    gain : float
        Gain in chi-square that the screen predicted.
    """

    blocks: list[str]
    effects: list[str]
    wrong_parameters: list[str]
    fitted: dict[str, float]
    held_out: dict[str, float]
    gap_closed: float
    fitted_values: dict[str, float] = field(metadata={"key": "values"})
    std: dict[str, float]
    prior: float
    suspects: list[str]
    gain: float


@dataclass(frozen=True, eq=False)
class RecordingUsed(Entry):
    """Samples and channels of a recording that the answer rests on.

    Attributes
    ----------
    recording, role, source : str
        Its name, ``fit`` or ``held_out``, and the file that it was read from.
    samples : int
        Samples as they were used.
    sample_time : float
        Time between them [s].
    averaged : int
        Recorded samples in each of them; 1 where nothing was averaged.
    used : list of str
        Channels that a judged block is compared with or driven by.
    unused : dict of str to str
        Channels that were recorded and not used, and why.
    masked : dict of str to float
        Share of samples of a channel that could not be used, where there are any.
    parameters : dict of str to float
        Parameters of the rig that had another value in it than in the rig file, SI.
    read : list of str
        What was left out, sorted, spread or taken for missing as its log was read.
    """

    recording: str
    role: str
    source: str
    samples: int
    sample_time: float
    averaged: int
    used: list[str]
    unused: dict[str, str]
    masked: dict[str, float]
    parameters: dict[str, float] = field(default_factory=dict)
    read: list[str] = field(default_factory=list)


@dataclass(frozen=True, eq=False)
class Considered(Entry):
    """A set of names that the caller asked for.

    Attributes
    ----------
    names : list of str
        What of it acts where the mismatch is: effects, and parameters that may be wrong.
    blocks : list of str
        Where; none where no block in which it acts keeps more than noise.
    probability : float
        Probability that this is what is missing there.
    left : float or None
        Share of the mismatch that it leaves; None where nothing is missing, where a parameter of it
        stays inside its tolerances, where it would happen with another event or a wrong value,
        or where the model cannot be run with it.
    """

    names: list[str]
    blocks: list[str]
    probability: float
    left: float | None


@dataclass(frozen=True, eq=False)
class Tested(Entry):
    """A persistent effect that acts where the mismatch is.

    Attributes
    ----------
    id : str
        Its id.
    blocks : list of str
        Where.
    predicted_gain : float
        Share of the mismatch that its signature could take before any fit.
    left : float or None
        Share that it leaves fitted alone; None where the predicted gain is too small.
    """

    id: str
    blocks: list[str]
    predicted_gain: float
    left: float | None
