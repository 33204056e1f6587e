"""Work of a muscle that is driven as a pump: moduli that rise with pressure give energy away."""

import math

import numpy as np
import pytest

from pamrs.rigs import shoulder
from tests.reference.geometry import GeometryReference
from tests.reference.muscle import MuscleReference

PRESSURE, CONTRACTION = 3e5, 0.265


def works(force, volume, length):
    """What goes in at the rod and what the gas gives back in one cycle [J]: short and full of air,
    drawn out at the pressure, let go, back without it.
    """
    e = np.linspace(0.0, CONTRACTION, 401)
    pulled = [float(force(PRESSURE, x) - force(0.0, x)) for x in e]
    rod = float(np.trapezoid(pulled, e)) * length
    return rod, PRESSURE * float(volume(CONTRACTION) - volume(0.0))


def of_the_package():
    muscle = shoulder().muscle
    rest = muscle.parameters["rest_length"]
    return muscle.force, muscle.air_volume, rest


def of_other_code():
    geometry = GeometryReference(0.276, 0.0254, math.radians(73.5), 0.003175)
    muscle = MuscleReference(geometry, [3.0, -0.35, 0.0, 0.0], [1.15e6, -0.15e6, 0.0, 0.0])
    table = muscle.tabulate(-0.004, CONTRACTION + 0.01)
    return lambda p, e: table(e, p)[0], lambda e: table(e, 0.0)[1], 0.276


@pytest.mark.parametrize("muscle", [of_the_package, of_other_code])
def test_published_moduli_return_more_gas_work_than_goes_in(muscle):
    rod, gas = works(*muscle())
    assert rod == pytest.approx(98.0, abs=0.5)
    assert gas == pytest.approx(126.0, abs=0.5)


def test_cylinder_of_fibres_alone_gives_back_what_goes_in():
    thin = shoulder().muscle.replace(model="gaylord", geometry="cylinder", wall_thickness=1e-6)
    rod, gas = works(thin.force, thin.air_volume, thin.parameters["rest_length"])
    assert gas == pytest.approx(rod, rel=1e-3)
