"""Force maps checked against a muscle: stray rows are flagged alone, whole columns in another unit
are refused.
"""

import math

import numpy as np
import pytest

from pamrs import Muscle
from pamrs.errors import FitError, RecordingError
from pamrs.fit import ForceMap, compare_models, fit_muscle
from pamrs.fit._compare import effective_size


def test_lengths_at_which_the_geometry_has_no_solution_are_flagged():
    wide = Muscle(
        rest_length=0.12, rest_diameter=0.05, braid_angle=math.radians(75.0), wall_thickness=0.002
    )
    length = np.array([0.119, 0.115, 0.11, 0.08])
    map_ = ForceMap.from_arrays(
        length=length,
        pressure=np.full(4, 3e5),
        force=[900.0, 700.0, 500.0, 100.0],
        rest_length=0.12,
    ).checked_against(wide)
    assert "no solution" in map_.reason
    assert any("no solution" in issue for issue in map_.issues)
    assert map_.used.any()


def test_a_stray_force_is_flagged_alone():
    muscle = Muscle(rest_length=0.3, rest_diameter=0.023, braid_angle=1.117, wall_thickness=0.0015)
    p, e = (grid.ravel() for grid in np.meshgrid([2e5, 4e5, 6e5], np.linspace(0.0, 0.2, 6)))
    force = muscle.force(p, e)
    force[7] = 1e30
    map_ = ForceMap.from_arrays(
        length=0.3 * (1.0 - e), pressure=p, force=force, rest_length=0.3
    ).checked_against(muscle)
    assert [row for row, why in enumerate(map_.reason) if why] == [7]
    assert map_.reason[7] == "force out of range"


def test_psi_read_as_bar_is_refused_though_half_the_rows_are_possible():
    p, e = (
        grid.ravel() for grid in np.meshgrid(np.arange(10.0, 100.0, 10.0), np.linspace(0.0, 0.2, 6))
    )
    with pytest.raises(RecordingError, match=r"pressures .*beyond 5 MPa: wrong unit\?"):
        ForceMap.from_arrays(
            length=0.3 * (1.0 - e), pressure=1e5 * p, force=100.0 - 200.0 * e, rest_length=0.3
        )


def test_a_geometry_without_a_solution_leaves_the_other_models_to_be_compared():
    wide = Muscle(
        rest_length=0.12, rest_diameter=0.05, braid_angle=math.radians(75.0), wall_thickness=0.002
    )
    p, e = (grid.ravel() for grid in np.meshgrid([2e5, 4e5, 6e5], np.linspace(0.0, 0.2, 6)))
    force = wide.replace(model="kothera", modulus_slope=[1.0], modulus_offset=[5e5]).force(p, e)
    data = ForceMap.from_arrays(length=0.12 * (1.0 - e), pressure=p, force=force, rest_length=0.12)
    with pytest.raises(FitError, match="the nominal geometry does not do at every fitted length"):
        fit_muscle(data, wide, order=1, free=["braid_angle"], tolerance={"braid_angle": 0.02})
    rows = compare_models(data, wide, models=["kothera", "robinson"], orders=[1]).rows
    assert [(row["model"], row["rank"]) for row in rows] == [("kothera", 1), ("robinson", None)]


def test_the_branches_of_a_loop_are_not_independent_of_themselves():
    real = Muscle(
        rest_length=0.3,
        rest_diameter=0.023,
        braid_angle=1.117,
        wall_thickness=0.0015,
        friction_coefficient=0.1,
    )
    p, e, d = (
        grid.ravel()
        for grid in np.meshgrid([2e5, 3e5, 4e5, 5e5, 6e5], np.linspace(0.0, 0.2, 30), [-1.0, 1.0])
    )
    data = ForceMap.from_arrays(
        length=0.3 * (1.0 - e),
        pressure=p,
        force=real.force(p, e, direction=d),
        rest_length=0.3,
        direction=d,
    )
    fit = fit_muscle(data, real.replace(friction_coefficient=0.0), order=1, direction=None)
    assert effective_size(fit) < 0.1 * fit.ndata
