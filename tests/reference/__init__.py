"""Independent reference model: NumPy and SciPy only, written from the equations, sharing no code
with pamrs.

It is slow and plain on purpose: roots by ``brentq``, integrals by ``quad``, trajectories by an
adaptive eighth-order method. ``geometry`` and ``muscle`` describe one muscle, ``gas`` the orifice
and the valve, ``plant`` what muscles give a one-link arm at rest, ``network`` whole rigs in motion.
"""

from .gas import Valve, orifice_flow
from .geometry import GeometryReference, Shape
from .muscle import MuscleReference
from .plant import Arm, Chamber, Gas, Joint, Plant, shoulder

__all__ = [
    "Arm",
    "Chamber",
    "Gas",
    "GeometryReference",
    "Joint",
    "MuscleReference",
    "Plant",
    "Shape",
    "Valve",
    "orifice_flow",
    "shoulder",
]
