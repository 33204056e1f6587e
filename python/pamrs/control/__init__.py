"""Controllers of the joint angle, sampled, for one arm or a batch of them; trajectories, metrics, tuning and stability."""

from pamrs.control.protocol import Controller, Measurement, Reference, Value

__all__ = ["Controller", "Measurement", "Reference", "Value"]
