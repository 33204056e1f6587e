"""Muscles that are known by their measured forces alone, and by a force law of the user's."""

from __future__ import annotations

import json
import pickle
from typing import Any

import numpy as np
import pytest
from scipy.interpolate import PchipInterpolator

import pamrs
from pamrs.errors import ParameterError, RecordingError, RigError
from pamrs.fit import ForceMap, fit_map
from pamrs.rig import force_table, load_rig, parse_rig
from tests.fit.cases import mapped, remade
from tests.scripts import command

SIZES: dict[str, Any] = {
    "rest_length": 0.25,
    "rest_diameter": 0.02,
    "braid_angle": 1.2,
    "wall_thickness": 0.0015,
}
LEVELS = np.array([0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0]) * 1e5


def law(pressure: Any, contraction: Any) -> Any:
    """A muscle with a threshold: not linear in pressure, as Festo's at low pressures."""
    p, e = np.asarray(pressure), np.asarray(contraction)
    works = 0.5e5 * np.logaddexp(0.0, (p - 1e5) / 0.5e5)
    return 1.2e-3 * works * (1.0 - 2.8 * e) ** 2 - 150.0 * e


def rows(noise: float = 0.0, half_width: float = 0.0, seed: int = 0) -> ForceMap:
    rng = np.random.default_rng(seed)
    one = np.linspace(0.0, 0.25, 60)
    e = np.tile(np.concatenate([one, one[::-1]]), len(LEVELS))
    way = np.tile(np.repeat([-1.0, 1.0], 60), len(LEVELS))
    p = np.repeat(LEVELS, 120)
    force = law(p, e) + way * half_width + noise * rng.normal(size=len(p))
    return mapped(p, e, force, 0.25, direction=way)


def reference(p_axis: Any, e_axis: Any, force: Any, p: float, e: float) -> float:
    """The same surface from SciPy's PCHIP slopes: bicubic Hermite, the twist the mean slope of the
    slopes.
    """
    by_p = PchipInterpolator(p_axis, force, axis=0).derivative()(p_axis)
    by_e = PchipInterpolator(e_axis, force, axis=1).derivative()(e_axis)
    twist = 0.5 * (
        PchipInterpolator(e_axis, by_p, axis=1).derivative()(e_axis)
        + PchipInterpolator(p_axis, by_e, axis=0).derivative()(p_axis)
    )
    i = int(np.clip(np.searchsorted(p_axis, p, "right") - 1, 0, len(p_axis) - 2))
    j = int(np.clip(np.searchsorted(e_axis, e, "right") - 1, 0, len(e_axis) - 2))

    def weights(x: float, width: float) -> Any:
        value = [(1 + 2 * x) * (1 - x) ** 2, x * x * (3 - 2 * x)]
        return np.array([*value, width * x * (1 - x) ** 2, width * x * x * (x - 1)])

    hp, he = p_axis[i + 1] - p_axis[i], e_axis[j + 1] - e_axis[j]
    u, v = weights((p - p_axis[i]) / hp, hp), weights((e - e_axis[j]) / he, he)
    box = np.ix_([i, i + 1], [j, j + 1])
    block = np.block([[force[box], by_e[box]], [by_p[box], twist[box]]])
    return float(u @ block @ v)


def test_the_surface_is_that_of_scipys_slopes() -> None:
    p_axis = np.array([0.0, 0.4, 1.0, 2.5, 4.0, 6.0]) * 1e5
    e_axis = np.array([-0.03, 0.0, 0.02, 0.07, 0.12, 0.2, 0.25])
    force = law(*np.meshgrid(p_axis, e_axis, indexing="ij"))
    rng = np.random.default_rng(1)
    p, e = rng.uniform(0.0, 6e5, 200), rng.uniform(-0.03, 0.25, 200)
    found = force_table(p_axis, e_axis, force)(p, e)
    wanted = [reference(p_axis, e_axis, force, *at) for at in zip(p, e, strict=True)]
    assert np.allclose(found, wanted, rtol=1e-10, atol=1e-9)


def test_a_law_becomes_a_muscle_as_near_as_asked_for() -> None:
    rng = np.random.default_rng(2)
    p, e = rng.uniform(0.0, 6e5, 3000), rng.uniform(-0.02, 0.25, 3000)
    largest = float(law(6e5, -0.02))
    sizes = []
    for tolerance in (1e-2, 1e-3, 1e-4):
        muscle = pamrs.Muscle.from_law(
            law, max_pressure=6e5, contraction=(-0.02, 0.25), tolerance=tolerance, **SIZES
        )
        error = np.max(np.abs(muscle.force(p, e) - law(p, e))) / largest
        assert error < 1.5 * tolerance
        assert np.allclose(muscle.force(p, e), muscle.force_table(p, e), rtol=1e-13, atol=1e-10)
        sizes.append(len(muscle.parameters["map_force"]))
    assert sizes[0] <= sizes[1] < sizes[2]
    again = pickle.loads(pickle.dumps(muscle))
    assert np.array_equal(again.force(p, e), muscle.force(p, e))
    assert np.allclose(muscle.replace(modulus_scale=1.1).force(p, e), 1.1 * muscle.force(p, e))
    assert muscle.replace(model="gaylord").parameters["map_force"] == []


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"law": lambda p, e: 1.0}, "an array of shape"),
        ({"law": lambda p, e: np.where(p > 3e5, np.nan, p)}, "is not finite"),
        ({"law": lambda p, e: np.where(p > 3.1e5, 500.0, 0.0) - e}, "a jump of the law"),
        ({"contraction": (0.2, 0.1)}, "contraction = "),
        ({"max_pressure": -1.0}, "pressure = "),
        ({"tolerance": 0.0}, "tolerance = 0.0"),
    ],
)
def test_laws_that_are_none_are_named(change: Any, words: str) -> None:
    given = {"law": law, "max_pressure": 6e5, "contraction": (0.0, 0.2), **SIZES, **change}
    with pytest.raises(ParameterError, match=words):
        pamrs.Muscle.from_law(given.pop("law"), **given)


def test_a_table_of_the_shoulders_own_muscle_moves_it_alike() -> None:
    """Published moduli are linear in pressure: as a map, the same arm does the same."""
    rig = pamrs.rigs.shoulder()
    muscle = rig.muscle
    assert muscle is not None
    high = muscle.contraction_range[1]
    names = ("rest_length", "rest_diameter", "braid_angle", "wall_thickness")
    own = pamrs.Muscle.from_law(
        lambda p, e: muscle.force_table(p, e),
        max_pressure=14e5,
        contraction=(0.0, min(high, 0.34)),  # the model has a kink at rest
        tolerance=1e-5,
        **{name: muscle.parameters[name] for name in names},
        geometry=muscle.geometry,
    )
    other = with_muscle(rig, own)
    u = 5.0 + np.where(np.arange(400) % 200 < 60, 1.5, -0.4)
    runs = [pamrs.simulate(r, valve_command=u, sample_time=0.005) for r in (rig, other)]
    angle = [run["joint_angle"] for run in runs]
    assert np.ptp(angle[0]) > 0.3
    assert np.max(np.abs(angle[0] - angle[1])) < 2e-4 * np.ptp(angle[0])
    batch = pamrs.simulate_batch(
        other, sample_time=0.005, valve_command=np.stack([u, u]), record=["joint_angle"]
    )
    assert np.allclose(batch["joint_angle"][0], angle[1], rtol=0.0, atol=1e-9)


def with_muscle(rig: pamrs.Rig, muscle: pamrs.Muscle) -> pamrs.Rig:
    from pamrs.rig.schema import keys_of

    given = {**muscle.parameters, "count": rig.model["muscle"]["count"]}
    own = {key.name: given[key.name] for key in keys_of("muscle", given)}
    return pamrs.Rig(rig.name, {**rig.model, "muscle": own})


def test_a_map_is_written_and_read_and_what_is_none_is_named() -> None:
    muscle = pamrs.Muscle.from_law(law, max_pressure=6e5, contraction=(0.0, 0.25), **SIZES)
    rig = with_muscle(pamrs.rigs.named("bench"), muscle)
    text = rig.to_toml_text()
    assert parse_rig(text).model == rig.model
    again = parse_rig(text).muscle
    assert again is not None
    assert again.force(3.3e5, 0.11) == muscle.force(3.3e5, 0.11)
    small = (
        "map = { pressure = { value = [0, 6], unit = 'bar' }, contraction = [0.0, 0.1, 0.25], "
        "force = [0, -1, -2, 500, 300, 50] }"
    )
    line = next(line for line in text.splitlines() if line.startswith("map = "))
    read = parse_rig(text.replace(line, small)).muscle
    assert read is not None
    assert read.force(6e5, 0.1) == pytest.approx(300.0)
    for old, new, words in (
        ("[0, 6]", "[6, 0]", "muscle.map.pressure is not allowed: its values must rise"),
        ("50]", "50, 1]", "muscle.map.force has 7 values; 2 x 3 are needed"),
        ("[0, 6]", "[0]", "muscle.map.pressure has 1 values"),
        (", force = [0, -1, -2, 500, 300, 50]", "", "muscle.map.force is missing"),
    ):
        with pytest.raises(RigError, match=words):
            parse_rig(text.replace(line, small.replace(old, new)))
    with pytest.raises(RigError, match="only with map"):
        parse_rig(pamrs.rigs.shoulder().to_toml_text(comments=False).replace(
            "end_ratio = ", f"{small}\nend_ratio = "))  # fmt: skip
    with pytest.raises(RigError, match="not linear in pressure"):
        muscle.gas_area(0.1)


def test_measured_rows_become_a_monotone_table_with_their_scatter() -> None:
    fit = fit_map(rows(noise=4.0, half_width=6.0))
    assert fit.scatter == pytest.approx(4.0, rel=0.1)
    assert fit.half_width == pytest.approx(6.0, rel=0.15)
    assert "N rms: hysteresis" in fit.fit_report()
    whole = rows(noise=4.0, half_width=6.0)
    order = np.random.default_rng(9).permutation(len(whole.force))
    alike = fit_map(remade(whole, order))  # nobody knows which branch a row is of
    assert alike.scatter == pytest.approx(np.hypot(4.0, 6.0), rel=0.12)
    assert np.isnan(alike.half_width)
    assert np.all(np.diff(fit.force, axis=0) >= 0.0)
    assert np.all(np.diff(fit.force, axis=1) <= 0.0)
    p, e = np.meshgrid(np.linspace(0.0, 6e5, 25), np.linspace(0.0, 0.25, 25), indexing="ij")
    error = np.abs(fit.predict(p, e) - law(p, e))
    assert np.allclose(fit.predict(4e5, length=0.25 * (1.0 - e)), fit.predict(4e5, e))
    assert error.max() < 16.0  # between levels a parabola is not known better
    at = np.abs(fit.predict(LEVELS[:, None], e[0]) - law(LEVELS[:, None], e[0]))
    assert np.sqrt(np.mean(at**2)) < 3.0
    exact = fit_map(rows())
    assert exact.scatter < 1.0
    assert exact.between > 2.0 * exact.scatter  # the level at the threshold is told by no other
    assert exact.share == pytest.approx(exact.between / np.sqrt(np.mean(rows().force ** 2)))


def test_corners_that_nobody_measured_are_said_and_go_on() -> None:
    data = rows(noise=1.0)
    keep = ~((data.pressure < 1.5e5) & (data.contraction > 0.12)) & (data.pressure > 0.0)
    fit = fit_map(remade(data, keep))
    text = fit.fit_report()
    assert "100 kPa: rows from 0 to 11.9 % contraction; beyond, the table goes on" in text
    assert "no row below 100 kPa: there the force goes on along a straight line" in text
    assert np.all(np.diff(fit.force, axis=0) >= 0.0)
    with pytest.raises(RecordingError, match="two pressures at least"):
        fit_map(data.select(levels=[3]))
    with pytest.raises(ParameterError, match="nodes = 2"):
        fit_map(data, nodes=2)


def test_the_command_writes_a_rig_that_runs(capsys: Any, tmp_path: Any) -> None:
    data = rows(noise=4.0)
    table, rig, result = (tmp_path / name for name in ("map.csv", "rig.toml", "map.json"))
    columns = np.column_stack([data.length * 1e3, data.pressure / 1e5, data.force])
    head = "length [mm],pressure [bar],force [N]"
    np.savetxt(table, columns, delimiter=",", header=head, comments="")
    words = ["fit", "map", table, "--rest-length", "250 mm", "--rest-diameter", "20 mm"]
    words += ["--braid-angle", "1.2 rad", "--wall-thickness", "1.5 mm"]
    code, out, _ = command(capsys, *words, "--rig", rig, "--json", result)
    assert code == 0
    assert "7 pressures from 0 to 600 kPa, 20 contractions" in out
    written = load_rig(rig)
    share = json.loads(result.read_text(encoding="utf-8"))["fit"]["share"]
    assert written.model_error == {"muscle": {"share": pytest.approx(share)}}
    assert written.muscle is not None
    assert written.muscle.force(4e5, 0.1) == pytest.approx(law(4e5, 0.1), abs=3.0)
    length = 0.25 * (1.0 - 0.1 - 0.05 * np.sin(np.arange(500) * 0.01))
    run = pamrs.simulate(written, length=length, pressure=np.full(500, 4e5), sample_time=0.01)
    assert np.allclose(run["muscle_force"], law(4e5, 1.0 - length / 0.25), atol=6.0)
