"""Design: what a requirement asks of a joint, of its muscles, and what an arm then lifts.

A joint (dissertation 3.5): four lengths of a tendon joint that give a wanted torque at the least
pressure. :mod:`pamrs.design.sizing` counts the muscles that a force over a stroke needs;
:func:`lift` says what an arm lifts and holds; :mod:`pamrs.design.figures` draws.

>>> import math, pamrs
>>> from pamrs.design import JointProblem, optimise
>>> muscle = pamrs.library.pam_a_1in()
>>> problem = JointProblem(muscle, 6, torque=400.0, min_angle=math.radians(15),
...     max_angle=math.radians(120), pressure=1.3e6)
>>> optimise(problem, "de", evaluations=200).met()
True

Searches need ``pip install 'pamrs[search]'``, which is imported when it is used.
"""

from __future__ import annotations

from pamrs.design import sizing
from pamrs.design._evaluator import Genetic, History, Search
from pamrs.design._filling import Filling
from pamrs.design._joint_design import (
    AREA_TOLERANCE,
    JointDesign,
    MethodComparison,
    compare_methods,
    optimise,
)
from pamrs.design._lifting import Lift, lift
from pamrs.design._pressure import (
    ParetoFront,
    PressureSearch,
    Trial,
    least_pressure,
    minimum_pressure,
    pareto_front,
)
from pamrs.design._problem import DEFAULT_BOUNDS, LENGTHS, SYMBOLS, JointProblem, Scores
from pamrs.design._search import METHODS, search
from pamrs.errors import MissingPackageError

__all__ = [
    "AREA_TOLERANCE",
    "DEFAULT_BOUNDS",
    "LENGTHS",
    "METHODS",
    "SYMBOLS",
    "Filling",
    "Genetic",
    "History",
    "JointDesign",
    "JointProblem",
    "Lift",
    "MethodComparison",
    "MissingPackageError",
    "ParetoFront",
    "PressureSearch",
    "Scores",
    "Search",
    "Trial",
    "compare_methods",
    "least_pressure",
    "lift",
    "minimum_pressure",
    "optimise",
    "pareto_front",
    "search",
    "sizing",
]
