"""Recordings made ready for the cut chain: checked, smoothed, cut into blocks that are predicted
from their measured neighbours.

Public: `at_ambient`, `AMBIENT` (a measured ambient temperature), `averaged`, `averaged_to_need`
(long recordings), `overlap`, `without_copies`, `Overlap` (recordings that hold the same samples),
`check_plausible`, `check_sense`, `turned_about`, `implausible`, `without_dead_commands`,
`without_impossible`, `without_rails`, `suspected_units` (what recordings cannot be),
`uncommanded`, `unusable` (which cannot be used), `prepare`, `Prepared`, `binned`,
`noise_level`, `smoothed`, `thermometers_of`,
`warm_chambers` (signals), `Block`, `Input`, `Residual`, `available_blocks`, `Unjudged`,
`unjudged_blocks` (blocks that the channels do not tell), `signals_at_starts`, `change`,
`predicted`, `residual` (blocks and their residuals), `with_unjudged_starts`, `notes_on_beginnings`,
`notes_on_warm_starts` (beginnings that nobody measured), `blocks_with_tanks`,
`tanks_without_gauge`, `with_tanks`, `notes_on_tanks` (tanks without a gauge, which are simulated),
`with_declared_values`, `varying`, `with_own_values`, `notes_on_own_values` (values that are free in
each recording), `notes_on_slack` (muscles that do not push back).
"""

from pamrs.diagnosis.prepare._ambient import AMBIENT, AMBIENT_PRESSURE, at_ambient
from pamrs.diagnosis.prepare._averaging import averaged, averaged_to_need
from pamrs.diagnosis.prepare._beginning import (
    notes_on_beginnings,
    notes_on_warm_starts,
    with_unjudged_starts,
)
from pamrs.diagnosis.prepare._blocks import (
    Block,
    Input,
    Residual,
    Unjudged,
    available_blocks,
    change,
    predicted,
    residual,
    signals_at_starts,
    unjudged_blocks,
)
from pamrs.diagnosis.prepare._overlap import Overlap, overlap, without_copies
from pamrs.diagnosis.prepare._own_values import (
    notes_on_own_values,
    varying,
    with_declared_values,
    with_own_values,
)
from pamrs.diagnosis.prepare._plausibility import (
    check_plausible,
    check_sense,
    implausible,
    turned_about,
    without_dead_commands,
    without_impossible,
)
from pamrs.diagnosis.prepare._rails import without_poor_thermometers, without_rails
from pamrs.diagnosis.prepare._signals import (
    Prepared,
    binned,
    noise_level,
    prepare,
    smoothed,
    thermometers_of,
    uncommanded,
    unusable,
    warm_chambers,
)
from pamrs.diagnosis.prepare._slack_muscles import notes_on_slack
from pamrs.diagnosis.prepare._tanks import (
    blocks_with_tanks,
    notes_on_tanks,
    tanks_without_gauge,
    with_tanks,
)
from pamrs.diagnosis.prepare._units import noted_units, suspected_units

__all__ = [
    "AMBIENT",
    "AMBIENT_PRESSURE",
    "Block",
    "Input",
    "Overlap",
    "Prepared",
    "Residual",
    "Unjudged",
    "at_ambient",
    "available_blocks",
    "averaged",
    "averaged_to_need",
    "signals_at_starts",
    "with_unjudged_starts",
    "binned",
    "blocks_with_tanks",
    "change",
    "check_plausible",
    "check_sense",
    "implausible",
    "noise_level",
    "noted_units",
    "overlap",
    "with_declared_values",
    "predicted",
    "prepare",
    "residual",
    "notes_on_beginnings",
    "notes_on_warm_starts",
    "notes_on_own_values",
    "notes_on_slack",
    "notes_on_tanks",
    "smoothed",
    "suspected_units",
    "thermometers_of",
    "turned_about",
    "unjudged_blocks",
    "uncommanded",
    "tanks_without_gauge",
    "unusable",
    "varying",
    "warm_chambers",
    "without_copies",
    "without_dead_commands",
    "without_impossible",
    "without_poor_thermometers",
    "without_rails",
    "with_own_values",
    "with_tanks",
]
