"""The muscle of the elbow by (4.4)-(4.7), which chapter 4 prints: one modulus of the bladder, and
factors of 0.3, 0.8 and 0.8 while it lengthens.
"""

from __future__ import annotations

from functools import cache
from typing import Final

from pamrs.rig import Muscle
from pamrs.rigs import named
from reproduction.elbow import PSI

#: Of (4.7): on the wall's pressure, on FL and on FT.
FACTORS: Final = (0.3, 0.8, 0.8)
_FREE: Final = 0.37  # contraction of the unloaded muscle at 150 psi, 3.2.2


@cache
def two_branches() -> Muscle:
    """The elbow's muscle by (4.4)-(4.7), ``E_R`` from the free contraction of 3.2.2, as none is
    printed.

    Returns
    -------
    Muscle
    """
    own = named("elbow").muscle
    assert own is not None
    unit, pressure = 1e6, 150.0 * PSI
    soft = own.replace(model="elbow_linear", bladder_modulus=unit, extension_factors=FACTORS)
    gas = float(soft.replace(modulus_scale=0.0).force(pressure, _FREE))
    # the force is linear in the modulus
    return soft.replace(bladder_modulus=unit * gas / (gas - float(soft.force(pressure, _FREE))))
