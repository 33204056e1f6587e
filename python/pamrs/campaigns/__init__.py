"""A campaign: a rig diagnosed by experiments of its own choice, one after the other.

Public: `campaign` and what it takes and gives (`Bench`, `Budget`, `Campaign`, `Step`);
`pamrs.campaigns.simulated` (a bench for rehearsals) and `pamrs.campaigns.serial` (a board at a
serial port).
"""

from pamrs.campaigns._bench import Bench
from pamrs.campaigns._budget import Budget, Cost
from pamrs.campaigns._folder import Step
from pamrs.campaigns._loop import Campaign, campaign

__all__ = ["Bench", "Budget", "Campaign", "Cost", "Step", "campaign"]
