"""What a diagnosis found, as types: what `pamrs.diagnosis` fills, and `pamrs.report` shows.

Entries have attributes and can be read like dictionaries. This package computes nothing; it lies
below reports and diagnosis, so that neither has to know the other to name what lies between them.

Public: `Findings` and the entries it is made of (`Where`, `EffectFound`, `BlockVerdict`,
`WrongParameter`, `Unexplained`, ...), `Trace`, `Entry`, `VERDICTS`, `HEALTHY`, `NOT_JUDGED`,
`SETTLED`; `channels_off` (of free runs); `compare_results` of two results, and `Compared`;
`to_plain`, by which they become JSON, and `fields_from`, which reads it.
"""

from __future__ import annotations

from pamrs.findings._compare import Compared, compare_results
from pamrs.findings._details import (
    BlockResidual,
    Considered,
    Curves,
    Form,
    NextExperiment,
    PairExperiment,
    Protocol,
    RankedExperiment,
    RecordingUsed,
    Tested,
    Tried,
)
from pamrs.findings._entries import (
    HEALTHY,
    NOT_JUDGED,
    VERDICTS,
    BlockMismatch,
    BlockVerdict,
    BudgetTerm,
    ChannelError,
    Condition,
    EffectFound,
    EffectParameterFound,
    Faulty,
    FitErrors,
    FreeRun,
    FreeRunError,
    MismatchSize,
    MismatchStages,
    Misread,
    ParameterFound,
    StageError,
    Unexplained,
    Where,
    WrongParameter,
)
from pamrs.findings._entry import Entry, fields_from, to_plain
from pamrs.findings._findings import SETTLED, Findings, channels_off
from pamrs.findings._trace import ModelFile, Trace

__all__ = [
    "HEALTHY",
    "NOT_JUDGED",
    "SETTLED",
    "VERDICTS",
    "BlockMismatch",
    "BlockResidual",
    "BlockVerdict",
    "BudgetTerm",
    "ChannelError",
    "Compared",
    "Condition",
    "Considered",
    "Curves",
    "EffectFound",
    "EffectParameterFound",
    "Faulty",
    "Entry",
    "Findings",
    "Form",
    "FitErrors",
    "FreeRun",
    "FreeRunError",
    "MismatchSize",
    "MismatchStages",
    "Misread",
    "ModelFile",
    "NextExperiment",
    "PairExperiment",
    "Protocol",
    "ParameterFound",
    "RankedExperiment",
    "RecordingUsed",
    "StageError",
    "Tested",
    "Trace",
    "Tried",
    "Unexplained",
    "Where",
    "WrongParameter",
    "channels_off",
    "compare_results",
    "fields_from",
    "to_plain",
]
