"""Design: what a requirement asks of a joint and of its muscles.

A joint (dissertation 3.5): four lengths of a tendon joint that give a wanted torque, at one
pressure or at the least. :mod:`pamrs.design.sizing` counts the muscles that a force over a stroke
needs.

>>> import math, pamrs
>>> from pamrs.design import JointProblem, optimise
>>> muscle = pamrs.library.pam_a_1in()
>>> problem = JointProblem(muscle, 6, torque=400.0, min_angle=math.radians(15),
...     max_angle=math.radians(120), pressure=1.3e6)
>>> optimise(problem, evaluations=200).met()
True
"""

from pamrs.design import sizing
from pamrs.design._joint_design import AREA_TOLERANCE, JointDesign, least_pressure, optimise
from pamrs.design._problem import DEFAULT_BOUNDS, LENGTHS, SYMBOLS, JointProblem, Scores
from pamrs.design.sizing import Filling

__all__ = [
    "AREA_TOLERANCE",
    "DEFAULT_BOUNDS",
    "LENGTHS",
    "SYMBOLS",
    "Filling",
    "JointDesign",
    "JointProblem",
    "Scores",
    "least_pressure",
    "optimise",
    "sizing",
]
