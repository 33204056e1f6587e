"""Sensitivities of a block's residual beside differences."""

from __future__ import annotations

import numpy as np

from pamrs.diagnosis.prepare import Block, Prepared, residual
from pamrs.rig import Rig
from pamrs.simulation import core_rig


def are_those_of_differences(block: Block, rig: Rig, prepared: Prepared, *names: str) -> None:
    """That a residual's sensitivities to some parameters are those of central differences."""
    for name in names:
        value = rig.parameter(name).value
        slope = residual(block, core_rig(rig), prepared, [name]).jacobian
        assert slope is not None
        low, high = (
            residual(
                block, core_rig(rig.with_parameters({name: value * f})), prepared, [name]
            ).value
            for f in (1.0 - 1e-4, 1.0 + 1e-4)
        )
        wanted = -(high - low) / (2e-4 * value)
        size = float(np.abs(wanted).max())
        np.testing.assert_allclose(slope[:, 0], wanted, atol=2e-2 * size)
