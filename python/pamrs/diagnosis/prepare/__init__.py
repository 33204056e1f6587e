"""Recordings made ready for the cut chain: checked, smoothed, cut into blocks that are predicted
from their measured neighbours.

Public: `at_ambient`, `AMBIENT` (a measured ambient temperature), `averaged`, `averaged_to_need`
(long recordings), `overlap`, `without_copies`, `Overlap`
(recordings that hold the same samples),
`check_plausible`, `check_sense`, `turned_about`, `implausible`, `without_dead_commands`,
`without_impossible`,
`without_rails`,
`suspected_units` (what recordings cannot be), `uncommanded`, `unusable` (which cannot be used),
`prepare`, `Prepared`, `binned`, `noise_level`,
`smoothed`, `thermometers_of`, `warm_chambers` (signals), `Block`, `Input`, `Residual`,
`available_blocks`, `Unjudged`, `unjudged_blocks` (blocks that the channels do not tell), `begun`,
`change`, `predicted`, `residual` (blocks and their residuals), `begun_alike`, `said_of_beginnings`,
`said_of_warm_starts` (beginnings that nobody measured), `blocks_beside_tanks`, `unread_tanks`,
`with_tanks`, `said_of_tanks` (tanks without a gauge, which are simulated), `own_of_rig`, `varying`,
`with_own_values`, `said_of_own` (values that are free in each recording), `said_of_slack` (muscles
that do not push back).
"""

from pamrs.diagnosis.prepare._ambient import AMBIENT, AMBIENT_PRESSURE, at_ambient
from pamrs.diagnosis.prepare._averaging import averaged, averaged_to_need
from pamrs.diagnosis.prepare._beginning import begun_alike, said_of_beginnings, said_of_warm_starts
from pamrs.diagnosis.prepare._blocks import (
    Block,
    Input,
    Residual,
    Unjudged,
    available_blocks,
    begun,
    change,
    predicted,
    residual,
    unjudged_blocks,
)
from pamrs.diagnosis.prepare._overlap import Overlap, overlap, without_copies
from pamrs.diagnosis.prepare._own import own_of_rig, said_of_own, varying, with_own_values
from pamrs.diagnosis.prepare._plausible import (
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
from pamrs.diagnosis.prepare._slack import said_of_slack
from pamrs.diagnosis.prepare._units import noted_units, suspected_units
from pamrs.diagnosis.prepare._unread import (
    blocks_beside_tanks,
    said_of_tanks,
    unread_tanks,
    with_tanks,
)

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
    "begun",
    "begun_alike",
    "binned",
    "blocks_beside_tanks",
    "change",
    "check_plausible",
    "check_sense",
    "implausible",
    "noise_level",
    "noted_units",
    "overlap",
    "own_of_rig",
    "predicted",
    "prepare",
    "residual",
    "said_of_beginnings",
    "said_of_warm_starts",
    "said_of_own",
    "said_of_slack",
    "said_of_tanks",
    "smoothed",
    "suspected_units",
    "thermometers_of",
    "turned_about",
    "unjudged_blocks",
    "uncommanded",
    "unread_tanks",
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
