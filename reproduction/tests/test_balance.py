"""Chapter 6's efficiencies beside a quasi-static balance that shares no code with the package."""

import math

import pytest

from reproduction.recruiting import PAYLOADS, lifting
from tests.reference.recruitment import cycles, lifting_plant

#: [%] of two muscles up to 50 deg, as an audit with other code of its own had them.
AUDIT = (9.5, 25.6, 32.0, 35.4)


@pytest.fixture(scope="module")
def two():
    return [
        100.0 * cycles(lifting_plant(p, 2), math.radians(50.0), points=200).efficiency
        for p in PAYLOADS
    ]


def test_balance_is_that_of_another_audit(two):
    assert two == pytest.approx(AUDIT, rel=0.02)


def test_balance_does_not_hang_on_its_points(two):
    own = lifting_plant(27.0, 2), math.radians(50.0)
    fine = cycles(*own, points=800)
    assert 100.0 * fine.efficiency == pytest.approx(two[-1], rel=1e-3)
    # each cycle after the first takes the same
    once, twice, thrice = (cycles(*own, n, points=200).energy for n in (1, 2, 3))
    assert twice - once == pytest.approx(thrice - twice, rel=1e-9)


def test_loop_comes_to_the_balance(two):
    found = lifting([(p, 2) for p in PAYLOADS], 50.0, 8)
    assert 100.0 * found.efficiency == pytest.approx(two, rel=0.015)


def test_number_of_muscles_hardly_matters_where_air_is_counted_in_gauge_pressures():
    for payload in (0.0, 27.0):
        plants = (lifting_plant(payload, n, model="gaylord", ambient=1e3) for n in (2, 4, 6))
        found = [cycles(own, math.radians(90.0), 2, points=100).efficiency for own in plants]
        assert max(found) / min(found) < 1.05
