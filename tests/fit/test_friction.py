"""Friction coefficients of a muscle from loops whose coefficients are known."""

import numpy as np
import pytest

import pamrs
from pamrs.errors import ParameterError, RecordingError
from pamrs.fit import fit_friction
from tests.fit.cases import mapped

C0, C1, FLOOR = 0.16, -0.145e-6, 0.01  # (2.36)
REST = 0.276
LEVELS = np.array([1.0, 2.0, 3.0, 4.0, 5.0, 6.0]) * 1e5


def muscle(**friction):
    return pamrs.Muscle(
        rest_length=REST,
        rest_diameter=0.0254,
        braid_angle=np.radians(73.5),
        wall_thickness=0.003175,
        modulus_slope=[3.0, -0.35],
        modulus_offset=[1.15e6, -0.15e6],
        **friction,
    )


RUBBED = {"friction_coefficient": C0, "friction_pressure_slope": C1, "friction_floor": FLOOR}


def loops(
    levels=LEVELS, *, friction=RUBBED, noise=0.0, count=60, cycles=2, presliding=None, seed=0
):
    """Pressure, contraction, force and direction of slow loops; with a presliding distance, of four
    slip elements.
    """
    rng = np.random.default_rng(seed)
    e = np.tile(
        np.concatenate([np.linspace(0.01, 0.30, count), np.linspace(0.30, 0.01, count)]), cycles
    )
    way = np.tile(np.repeat([-1, 1], count), cycles)
    acting = way.astype(float)
    if presliding is not None:
        reach = presliding * np.array([0.125, 0.25, 0.5, 1.0])
        elements, acting, last = np.zeros(4), [], e[0]
        for here in e:
            elements = np.clip(elements - (here - last) * REST / reach, -1.0, 1.0)
            acting.append(elements.mean())
            last = here
    body = muscle(**friction)
    force = [
        body.force(p, e, direction=acting) + noise * rng.standard_normal(len(e)) for p in levels
    ]
    return {
        "pressure": np.repeat(levels, len(e)),
        "contraction": np.tile(e, len(levels)),
        "force": np.concatenate(force),
        "direction": np.tile(way, len(levels)),
    }


def fitted(pressure, contraction, force, direction=None, **options):
    """The friction of a map of loops."""
    options = {"direction": direction, "check_duplicates": False} | options
    return fit_friction(mapped(pressure, contraction, force, REST, **options))


def rows_of(made, rows, names=("pressure", "contraction", "force", "direction")):
    return {name: made[name][rows] for name in names}


def without_direction(made, rows=slice(None)):
    """Rows of loops that nobody gave a direction."""
    return rows_of(made, rows, ("pressure", "contraction", "force"))


def test_exact_loops_give_the_coefficients_back():
    fit = fitted(**loops())
    found = [item.value for item in fit.params.values()]
    assert found == pytest.approx([C0, C1], rel=1e-3)
    assert fit.slope_significant
    assert np.allclose(fit.predict(LEVELS), C0 + C1 * LEVELS, rtol=1e-3)
    assert np.allclose(fit.residual, 0.0, atol=1e-4)


def test_a_pressure_at_which_nothing_pulls_gives_no_coefficient():
    given = loops(levels=np.append(1e3, LEVELS), noise=3.0)
    slack = given["pressure"] < 2e3
    given["force"][slack] = np.random.default_rng(1).normal(size=slack.sum())
    fit = fitted(**given)
    assert len(fit.levels) == 6
    assert "1 kPa: forces below 1 % of the map's largest: no coefficient" in fit.issues
    assert fit.params["friction_coefficient"].value == pytest.approx(C0, rel=0.02)


def test_standard_errors_tell_the_truth():
    scores = []
    for seed in range(24):
        fit = fitted(**loops(noise=10.0, seed=seed))
        pairs = zip(fit.params.values(), (C0, C1), strict=True)
        scores.append([(item.value - truth) / item.stderr for item, truth in pairs])
    spread = np.std(scores, axis=0)
    assert np.all((spread > 0.5) & (spread < 1.6))
    assert np.all(np.abs(np.mean(scores, axis=0)) < 0.7)


def test_levels_on_the_floor_do_not_bend_the_line():
    fit = fitted(**loops(np.array([2.0, 4.0, 6.0, 8.0, 10.0, 12.0, 14.0]) * 1e5, noise=1.0))
    assert [level.at_floor for level in fit.levels] == [False] * 5 + [True] * 2
    assert fit.ndata == 5
    assert fit.params["friction_pressure_slope"].value == pytest.approx(C1, rel=0.01)
    assert fit.predict(2e6) == FLOOR


def test_friction_that_does_not_depend_on_pressure():
    fit = fitted(**loops(friction={"friction_coefficient": 0.08}, noise=5.0))
    assert not fit.slope_significant
    c0 = fit.params["friction_coefficient"]
    assert c0.value == pytest.approx(0.08, abs=3 * c0.stderr)
    assert "not significant" in fit.fit_report()


def test_a_muscle_without_friction_is_on_the_floor():
    fit = fitted(**loops(friction={}, noise=1.0))
    assert np.all(fit.predict(LEVELS) == FLOOR)
    assert "the law is its floor at every pressure" in " ".join(fit.issues)


def test_presliding_from_dense_reversals():
    made = loops(LEVELS[:3], count=400, presliding=4e-3)
    for given in (made, without_direction(made)):
        assert fitted(**given).presliding == pytest.approx(4e-3, rel=0.05)
    sparse = fitted(**loops(LEVELS[:3], count=20, presliding=4e-3))
    assert sparse.presliding is None
    assert "too sparse after 9 of 9 reversals" in sparse.presliding_reason


def test_to_muscle_carries_the_friction():
    fit = fitted(**loops(LEVELS[:3], count=400, presliding=4e-3))
    rubbed = fit.to_muscle(muscle())
    given = rubbed.parameters
    assert given["friction_coefficient"] == fit.params["friction_coefficient"].value
    assert given["friction_floor"] == FLOOR
    assert given["friction_presliding"] == fit.presliding
    expected = muscle(**RUBBED).force(3e5, 0.1, direction=1.0)
    assert rubbed.force(3e5, 0.1, direction=1.0) == pytest.approx(expected, rel=0.01)
    stays = fitted(**loops()).to_muscle(muscle(friction_presliding=2e-3))
    assert stays.parameters["friction_presliding"] == 2e-3


def test_rows_of_unknown_direction_and_without_a_number_are_left_out():
    made = loops()
    made["direction"][:7] = 0
    made["force"][20] = np.nan
    fit = fitted(**made)
    assert fit.params["friction_coefficient"].value == pytest.approx(C0, rel=2e-3)
    text = " ".join(fit.issues)
    assert "7 rows have no direction of motion" in text
    assert "1 row of 1440 has no number" in text


def test_a_notebook_shows_its_picture_and_numbers():
    fit = fitted(**loops())
    page = fit._repr_html_()
    assert "data:image/png" in page
    assert f"{fit.params['friction_coefficient'].value:.4g}" in page


def test_a_pressure_with_one_branch_is_named_and_the_others_count():
    made = loops()
    keep = ~((made["pressure"] == 3e5) & (made["direction"] > 0))
    fit = fitted(**rows_of(made, keep))
    assert len(fit.levels) == 5
    assert "300 kPa: 0 rows while lengthening, 4 at least are needed: no coefficient" in fit.issues


def test_what_the_loops_do_not_determine_is_named():
    made = loops()
    with pytest.raises(
        RecordingError, match=r"one pressure only \(100 kPa\): the slope c1 is not determinable"
    ):
        fitted(**loops(LEVELS[:1]))
    order = np.random.default_rng(2).permutation(len(made["force"]))
    for rows in (np.lexsort((made["contraction"], made["pressure"])), order, order[:6]):
        with pytest.raises(RecordingError, match="no row has a direction of motion: give a column"):
            fitted(**without_direction(made, rows))
    with pytest.raises(RecordingError, match="no pressure gives a coefficient"):
        fitted(**rows_of(made, made["direction"] < 0))
    two = fitted(**loops(LEVELS[:2], noise=2.0))
    assert np.isnan(two.slope_pvalue)
    assert not two.slope_significant
    assert "cannot be tested" in two.fit_report()


def test_impossible_arguments_are_named():
    made = loops()
    data = mapped(made["pressure"], made["contraction"], made["force"], REST)
    with pytest.raises(ParameterError, match="floor = 1.5 is not allowed"):
        fit_friction(data, floor=1.5)
    with pytest.raises(ParameterError, match="pressure: a value is not finite"):
        fitted(**made).predict(np.nan)


def pressure_loops(contractions, *, count=120, noise=0.0, cycles=2, seed=0):
    """Pressure cycles at held lengths."""
    rng = np.random.default_rng(seed)
    one = np.concatenate([np.linspace(0.5e5, 6e5, count), np.linspace(6e5, 0.5e5, count)])
    p = np.tile(one, cycles)
    way = np.tile(np.repeat([-1, 1], count), cycles)
    body = muscle(**RUBBED)
    force = [
        body.force(p, np.full(len(p), e), direction=way) + noise * rng.normal(size=len(p))
        for e in contractions
    ]
    return {
        "pressure": np.tile(p, len(contractions)),
        "contraction": np.repeat(contractions, len(p)),
        "force": np.concatenate(force),
    }


def shaken(made, by):
    """The same with contractions that scatter."""
    off = by * np.random.default_rng(5).normal(size=len(made["force"]))
    return made | {"contraction": made["contraction"] + off}


@pytest.mark.parametrize(("noise", "bound"), [(0.0, 2e-3), (5.0, 0.03)])
def test_the_order_of_the_rows_tells_the_directions(noise, bound):
    made = shaken(loops(noise=noise), 2e-4 * noise)
    given, found = fitted(**made), fitted(**without_direction(made))
    assert "directions of motion are those of the rows' order" in " ".join(found.issues)
    values = [item.value for item in found.params.values()]
    assert values == pytest.approx([C0, C1], rel=2 * bound)
    assert values == pytest.approx([item.value for item in given.params.values()], rel=0.01)


@pytest.mark.parametrize("contractions", [[0.1], [0.02, 0.08, 0.14, 0.2]])
def test_pressure_cycles_at_held_lengths_are_loops(contractions):
    fit = fitted(**shaken(pressure_loops(contractions, noise=2.0), 3e-4))
    assert fit.isometric
    assert fit.params["friction_coefficient"].value == pytest.approx(C0, rel=0.02)
    assert fit.params["friction_pressure_slope"].value == pytest.approx(C1, rel=0.04)
    assert fit.presliding is None
    assert fit.presliding_reason == "not determinable: the length is held"
    assert fit.to_dict()["isometric"] is True


def test_pressure_steps_at_a_held_length_are_enough():
    """Sixteen steps up and down, one reading each."""
    fit = fitted(**pressure_loops([0.1], count=16, cycles=1))
    assert fit.params["friction_coefficient"].value == pytest.approx(C0, rel=0.01)
    both = pressure_loops([0.05, 0.1], count=16, cycles=1)
    rising = np.tile(np.arange(32) < 16, 2)
    with pytest.raises(RecordingError, match="over pressure and back at each length"):
        fitted(**without_direction(both, rising))
    with pytest.raises(RecordingError, match="have both branches at a held length, 8 at least"):
        fitted(**pressure_loops([0.1], count=7, cycles=1))
