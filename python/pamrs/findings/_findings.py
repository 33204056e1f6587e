"""All findings of a diagnosis, with its curves and the model that it read."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property
from typing import Protocol

import numpy as np

from pamrs._arrays import Array
from pamrs.findings._answer import REFITTED, SETTLED, Answer, answer_of
from pamrs.findings._details import (
    BlockResidual,
    Considered,
    Limit,
    NextExperiment,
    RecordingUsed,
    Tested,
    Tried,
)
from pamrs.findings._entries import (
    NOT_JUDGED,
    VERDICTS,
    BlockVerdict,
    BudgetTerm,
    ChannelError,
    EffectFound,
    Faulty,
    FitErrors,
    FreeRun,
    Misread,
    OtherLaw,
    ParameterFound,
    Unexplained,
    Where,
    WrongParameter,
)
from pamrs.findings._entry import NOT_WRITTEN
from pamrs.findings._missing import MissingInput


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
    time: Array
    measured: Array
    before: Array
    refit: Array | None = None
    after: Array | None = None
    residual_before: Array | None = None
    residual_after: Array | None = None

    def __post_init__(self) -> None:
        def put(name: str, array: Array) -> None:
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


@dataclass(frozen=True)
class Findings:
    """Findings of a diagnosis, as plain data; `pamrs.Diagnosis` adds what can be done with them.

    Attributes
    ----------
    case : str
        Name of the case.
    verdict : str
        ``none``, ``parameters``, ``effects``, ``unlisted``, or ``units`` (channels are read wrong,
        and nothing else is judged).
    misread : list of Misread
        Channels that are likely in another unit than the log says.
    faulty : list of Faulty
        Channels that a sensor or logger spoiled: masked or left out, and said first.
    laws : list of OtherLaw
        Laws that the recordings follow instead of those of the rig file.
    where : Where
        Block, channel, intervals, conditions, and a sentence.
    effects : list of EffectFound
        What is named (with another verdict what comes closest), most probable first.
    ambiguity : list of list of str
        Sets of names (effects, wrong parameters by dotted name, ``unlisted``, ``parameters``) that
        the data cannot separate; empty when settled.
    probabilities : dict
        Probability of each possible answer for the case: names of all its blocks joined by ``+``,
        ``none``, ``parameters`` (that moved inside their tolerances), or ``unlisted`` (something
        is missing and nothing has a name). Those of each block are in ``blocks``.
    blocks : list of BlockVerdict
        The verdict of each group of blocks, then those that were not judged, each with the reason.
    budget : list of BudgetTerm
        What of the nominal model's excess over the noise each term takes, block by block.
    unexplained : list of Unexplained
        Blocks with a mismatch that stays unexplained, the largest first.
    wrong_parameters : list of WrongParameter
        Values of the rig file that are wrong.
    free_run : list of FreeRun or None
        Errors of the whole rig simulated from its commands alone, for each held-out recording (each
        fitted one where none was held out); None where no recording has the commands.
    free_run_note : str
        Why there is no free run, or of some recordings none; empty where nothing is missing.
    free_traces : list of Trace
        Channels of the recording that the nominal model misses most from its commands alone, as
        measured and as both models give them (``before``, ``after``).
    parameters : dict of str to ParameterFound
        Parameters of the baseline, SI.
    fit : FitErrors
        Error of each channel, and how much of the gap to the noise is closed.
    missing_input : MissingInput or None
        What the model of the block that the answer is about would need to follow the recordings;
        None where nothing is missing, or it could not be followed.
    limits : list of Limit
        Of each effect the sizes from which the recordings show it, and from which they can name it.
    next_experiment : NextExperiment
        What to record next.
    data : list of RecordingUsed
        What of each recording the answer rests on, and which channels were not used, and why.
    inputs : dict of str to str
        SHA-256 of each file that the case was read from, by its name.
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
    measured : list of str
        Channels that every recording has.
    residuals : dict of str to BlockResidual
        Residual of each block's refitted baseline against the noise level.
    timings : dict
        Seconds of each stage, optional.
    tried : list of Tried
        Every set of effects that was fitted.
    considered : list of Considered
        What the caller asked to be judged in addition.
    tested : list of Tested
        Every persistent effect that acts where the mismatch is.

    Raises
    ------
    ValueError
        If `verdict` is none of the allowed ones.
    """

    case: str
    verdict: str
    misread: list[Misread] = field(default_factory=list)
    faulty: list[Faulty] = field(default_factory=list)
    laws: list[OtherLaw] = field(default_factory=list)
    where: Where = field(default_factory=Where)
    effects: list[EffectFound] = field(default_factory=list)
    ambiguity: list[list[str]] = field(default_factory=list)
    probabilities: dict[str, float] = field(default_factory=dict)
    blocks: list[BlockVerdict] = field(default_factory=list)
    budget: list[BudgetTerm] = field(default_factory=list)
    unexplained: list[Unexplained] = field(default_factory=list)
    wrong_parameters: list[WrongParameter] = field(default_factory=list)
    free_run: list[FreeRun] | None = None
    free_run_note: str = ""
    parameters: dict[str, ParameterFound] = field(default_factory=dict)
    fit: FitErrors = field(default_factory=FitErrors)
    missing_input: MissingInput | None = None
    limits: list[Limit] = field(default_factory=list)
    next_experiment: NextExperiment = field(default_factory=NextExperiment)
    data: list[RecordingUsed] = field(default_factory=list)
    considered: list[Considered] = field(default_factory=list)
    inputs: dict[str, str] = field(default_factory=dict)
    warnings: list[str] = field(default_factory=list)
    seconds: float = 0.0
    text: str = ""
    rig: ModelFile | None = field(default=None, metadata=NOT_WRITTEN)
    traces: list[Trace] = field(default_factory=list, metadata=NOT_WRITTEN)
    free_traces: list[Trace] = field(default_factory=list, metadata=NOT_WRITTEN)
    measured: list[str] = field(default_factory=list, metadata=NOT_WRITTEN)
    residuals: dict[str, BlockResidual] = field(default_factory=dict, metadata=NOT_WRITTEN)
    timings: dict[str, float] = field(default_factory=dict, metadata=NOT_WRITTEN)
    tried: list[Tried] = field(default_factory=list, metadata=NOT_WRITTEN)
    tested: list[Tested] = field(default_factory=list, metadata=NOT_WRITTEN)

    def __post_init__(self) -> None:
        if self.verdict not in VERDICTS:
            raise ValueError(f"verdict is {self.verdict!r}; allowed are {', '.join(VERDICTS)}")

    @property
    def settled(self) -> float:
        """Probability from which an answer is settled."""
        return SETTLED

    @cached_property
    def answer(self) -> Answer:
        """Answer to all of this, decided once: texts, tables and pictures take it from here."""
        if self.misread:
            return Answer("units", False, "units", None, [], math.nan, [], REFITTED, [], [])
        block = self.where.block
        whole = BlockVerdict(  # of a result that does not tell its groups apart
            blocks=[block] if block else [],
            verdict=self.verdict,
            probabilities=self.probabilities,
            effects=[e.term for e in self.effects] if self.verdict == "effects" else [],
            wrong_parameters=[w.name for w in self.wrong_parameters],
            ambiguity=self.ambiguity,
        )
        return answer_of(
            self.judged or [whole],
            self.proven,
            self.free_run or [],
            self.probabilities,
            {w.name: w.block for w in self.wrong_parameters},
            enough=self.settled,
            form=any(entry.form for entry in self.unexplained),
            other_law=bool(self.laws),
        )

    @property
    def judged(self) -> list[BlockVerdict]:
        """The groups of blocks that were judged."""
        return [block for block in self.blocks if block.verdict != NOT_JUDGED]

    @property
    def not_judged(self) -> list[BlockVerdict]:
        """The blocks of the rig that these recordings cannot judge."""
        return [block for block in self.blocks if block.verdict == NOT_JUDGED]

    @property
    def model(self) -> str:
        """The model with the effect, as TOML; empty when there is no model."""
        return "" if self.rig is None else self.rig.to_toml_text()

    @property
    def proven(self) -> dict[str, ChannelError]:
        """Errors that the answer is proven by: held-out ones where there are any."""
        return self.fit.held_out or self.fit.channels

    @property
    def proof(self) -> str:
        """The recordings on which the gap was measured, in words."""
        if self.fit.held_out:
            return "held-out recordings"
        return "the fitted recordings (none was held out)"
