"""A campaign: a rig diagnosed by experiments of its own choice, one after the other.

Public: `campaign` and what it takes and gives (`Bench`, `Budget`, `Campaign`, `Cost`, `Step`);
devices: `SerialDevice` (a board at a serial port), `SimulatedBench` (for rehearsals).
"""

from pamrs.campaigns._bench import Bench
from pamrs.campaigns._budget import Budget, Cost
from pamrs.campaigns._folder import Step
from pamrs.campaigns._loop import Campaign, campaign
from pamrs.campaigns.serial import SerialDevice
from pamrs.campaigns.simulated import SimulatedBench

__all__ = [
    "Bench",
    "Budget",
    "Campaign",
    "Cost",
    "SerialDevice",
    "SimulatedBench",
    "Step",
    "campaign",
]
