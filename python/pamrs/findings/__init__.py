"""What a diagnosis found, as types: what `pamrs.diagnosis` fills, and `pamrs.report` shows.

Entries have attributes and can be read like dictionaries. This package lies below reports and
diagnosis, so that neither has to know the other to name what lies between them. It decides one
thing, once: the answer that all of it comes to (`Answer`).

Public: `Findings` and the entries it is made of (`Where`, `EffectFound`, `BlockVerdict`,
`WrongParameter`, `Unexplained`, ...), `MissingInput` with `MissingRecording`, and the `shown_unit`
of what it has; `Trace`, `Entry`, `VERDICTS`, `HEALTHY`, `NOT_JUDGED`;
`Answer` with its `Part` and `Missed`, and what decides it (`case_verdict`, `beyond`, `left_of`,
`chance_of`, `SETTLED`); `compare_results` of two results, and `Compared`; `to_plain`, by which they
become JSON, and `fields_from`, which reads it.
"""

from pamrs.findings._answer import (
    MENDED,
    MOST_MISSED,
    NOISE_LEVELS,
    REFITTED,
    SETTLED,
    YOURS,
    Answer,
    Missed,
    Part,
    beyond,
    case_verdict,
    chance_of,
    left_of,
)
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
    OtherLaw,
    ParameterFound,
    StageError,
    Unexplained,
    Where,
    WrongParameter,
)
from pamrs.findings._entry import Entry, fields_from, to_plain
from pamrs.findings._findings import Findings
from pamrs.findings._missing import MissingInput, MissingRecording, shown_unit
from pamrs.findings._trace import ModelFile, Trace

__all__ = [
    "HEALTHY",
    "MENDED",
    "MOST_MISSED",
    "NOISE_LEVELS",
    "NOT_JUDGED",
    "REFITTED",
    "SETTLED",
    "VERDICTS",
    "YOURS",
    "Answer",
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
    "Missed",
    "MissingInput",
    "MissingRecording",
    "ModelFile",
    "NextExperiment",
    "OtherLaw",
    "PairExperiment",
    "Part",
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
    "beyond",
    "case_verdict",
    "chance_of",
    "compare_results",
    "fields_from",
    "left_of",
    "shown_unit",
    "to_plain",
]
