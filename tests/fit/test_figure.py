"""The figure of a muscle fit: every kind of fit is drawn, with what it says in its headline."""

import numpy as np
import pytest
from matplotlib.figure import Figure

from pamrs.fit import fit_muscle
from pamrs.fit._figures import headline
from pamrs.rig import Muscle
from tests.fit.cases import grid, mapped

REST = 0.3
LEVELS = [1e5, 2e5, 3e5, 4e5, 5e5, 6e5]
MUSCLE = Muscle(
    rest_length=REST,
    rest_diameter=0.02,
    braid_angle=np.radians(65.0),
    wall_thickness=0.002,
    model="kothera",
    modulus_slope=[0.6, -1.0],
    modulus_offset=[1.2e6, -1.5e6],
)


@pytest.fixture(scope="module")
def data():
    """Six pressures, seven lengths, noise of 1 N; two rows are no numbers."""
    p, e = grid(LEVELS, np.linspace(0.01, 0.19, 7))
    force = MUSCLE.force(p, e) + np.random.default_rng(5).normal(scale=1.0, size=e.size)
    force[[3, 17]] = np.nan
    return mapped(p, e, force, REST)


@pytest.mark.parametrize(
    "options",
    [
        {"levels": [0, 2, 5]},
        {"model": "gaylord"},
        {"moduli": "per_level"},
        {"free": ["braid_angle"]},
    ],
)
def test_every_kind_of_fit_has_a_picture_of_the_promised_size(data, tmp_path, options):
    fit = fit_muscle(data, MUSCLE, **options)
    head = fit.figure(tmp_path / "fit.png").read_bytes()[:24]
    assert head[:8] == b"\x89PNG\r\n\x1a\n"
    assert (int.from_bytes(head[16:20], "big"), int.from_bytes(head[20:24], "big")) == (1600, 1000)


def test_the_headline_says_how_good_it_is_at_what_it_has_seen_or_not(data):
    every = fit_muscle(data, MUSCLE)
    assert headline(every) == (
        "The kothera model of order 2 meets every point within "
        f"{100 * every.max_error:.2g} % of the largest force, {100 * every.rms_error:.2g} % rms"
    )
    few = fit_muscle(data, MUSCLE, levels=[0, 2, 5])
    rms, worst = few.errors_of("held_out")
    assert headline(few) == (
        "Fitted on 3 pressures, the kothera model of order 2 predicts the other 3 within "
        f"{100 * worst:.2g} % of the largest force, {100 * rms:.2g} % rms"
    )


def test_directions_draw_both_branches_and_unused_rows_are_crosses(data):
    rubbing = MUSCLE.replace(friction_coefficient=0.05)
    p, e, d = grid(LEVELS, np.linspace(0.01, 0.19, 5), [-1.0, 1.0])
    loop = mapped(p, e, rubbing.force(p, e, direction=d), REST, direction=d)
    axes = fit_muscle(loop, rubbing).plot(Figure().subplots())
    told = axes.get_legend_handles_labels()[1]
    assert {"model, contracting", "model, lengthening"} <= set(told)
    few = fit_muscle(data, MUSCLE, levels=[0, 2, 5]).plot(Figure().subplots())
    assert "measured, left out of the fit" in few.get_legend_handles_labels()[1]
