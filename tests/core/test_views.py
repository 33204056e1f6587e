"""What draws itself: axes in, axes out; in a notebook a picture and the main numbers."""

from __future__ import annotations

import base64
import re
from functools import cache
from typing import Any

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib import pyplot
from matplotlib.figure import Figure

import pamrs
from pamrs.control import PID, closed_loop, trajectories
from pamrs.control.tuning import gain_map
from pamrs.errors import DiagnosisError, ParameterError
from tests.diagnosis import synthetic

mpl.use("Agg")
RIG = pamrs.rigs.shoulder()
STEP = trajectories.step(*trajectories.degrees(15, 30), duration=0.5)


def _simulation() -> Any:
    return pamrs.simulate(RIG, 5.6, sample_time=5e-3, duration=0.5)


def _batch(**wanted: Any) -> Any:
    plants = {"arm.payload": [0.5, 1.0]}
    return pamrs.simulate_batch(
        RIG, 5.6, sample_time=5e-3, duration=0.2, parameters=plants, **wanted
    )


def _case() -> Any:
    run = _simulation()
    arrays = {name: run[name] for name in ("valve_command", "muscle_pressure", "joint_angle")}
    tables = {"first": arrays, "second": arrays}
    return pamrs.Case.from_arrays(RIG, tables, sample_time=5e-3, held_out=["second"])


def _map() -> Any:
    muscle = RIG.muscle
    assert muscle is not None
    contraction = np.linspace(0.0, 0.2, 12)
    pressure, shortened = np.meshgrid([2e5, 4e5, 6e5], contraction, indexing="ij")
    rest = muscle.parameters["rest_length"]
    force = muscle.force(pressure, shortened)
    given = {"length": (1.0 - shortened) * rest, "pressure": pressure, "force": force}
    columns = {name: one.ravel() for name, one in given.items()}
    return pamrs.fit.ForceMap.from_arrays(**columns, rest_length=rest)


def _gains() -> Any:
    def made(**gains: Any) -> PID:
        return PID(ki=0.5, period=5e-3, **gains)

    return gain_map(RIG, made, {"kp": [0.5, 1.5, 3.0]}, STEP, payloads=[0.5, 1.0])


MAKERS = {
    "rig": lambda: RIG,
    "two joints": lambda: pamrs.rigs.named("two_joint_arm"),
    "no muscle": lambda: pamrs.rigs.named("tube"),
    "case": _case,
    "recording": lambda: _case().recordings[0],
    "simulation": _simulation,
    "batch": lambda: _batch(record=["joint_angle"]),
    "reduced": lambda: _batch(reduce={"highest": ("max", "joint_angle")}),
    "loop": lambda: closed_loop(RIG, PID(1.4, 0.5, period=5e-3), STEP),
    "gain map": _gains,
    "muscle fit": lambda: pamrs.fit.fit_muscle(_map(), RIG.muscle),
    "map fit": lambda: pamrs.fit.fit_map(_map()),
    "diagnosis": synthetic.diagnosis,
}
SAID = {
    "rig": "supply",
    "two joints": "muscle.elbow",
    "no muscle": "chamber",
    "case": "recording second",
    "recording": " deg",
    "simulation": "at the end",
    "reduced": "highest",
    "batch": "2, 0 of them ended",
    "loop": "rms error of joint_angle",
    "gain map": "best with 0.5 kg",
    "muscle fit": "of the largest force",
    "map fit": "3 pressures",
    "diagnosis": "heat transfer",
}


@cache
def made(name: str) -> Any:
    return MAKERS[name]()


@pytest.mark.parametrize("name", MAKERS)
def test_it_draws_on_the_axes_that_it_is_given(name: str) -> None:
    axes = Figure().subplots()
    assert made(name).plot(ax=axes) is axes
    assert axes.has_data() or axes.texts


@pytest.mark.parametrize("name", MAKERS)
def test_a_notebook_gets_a_picture_and_numbers(name: str) -> None:
    before = pyplot.get_fignums()  # other tests may have left some
    html = made(name)._repr_html_()
    (image,) = re.findall(r'src="data:image/png;base64,([^"]+)"', html)
    assert base64.b64decode(image).startswith(b"\x89PNG")
    assert SAID[name] in html
    assert pyplot.get_fignums() == before  # no figure is left open


def test_panels_by_name_and_on_axes_of_ones_own() -> None:
    run = made("simulation")
    drawn = run.plot(what=["muscle_pressure", "joint_angle"])
    assert [one.get_ylabel() for one in drawn] == ["muscle pressure [bar]", "joint angle [deg]"]
    (line,) = drawn[0].lines
    assert np.allclose(line.get_ydata(), 1e-5 * run["muscle_pressure"])
    assert np.allclose(drawn[1].lines[0].get_ydata(), np.degrees(run["joint_angle"]))
    pyplot.close("all")
    assert run.plot(what="joint_angle").get_xlabel() == "time [s]"
    pyplot.close("all")
    with pytest.raises(ParameterError, match="did you mean 'joint_angle'"):
        run.plot(what="jont_angle")
    empty = pamrs.simulate_batch(RIG, 5.6, sample_time=5e-3, duration=0.1, n=2)
    with pytest.raises(ParameterError, match="there is nothing to draw in BatchRun"):
        empty.plot()
    with pytest.raises(ParameterError, match=r"ax = 'run\.png' is not allowed"):
        run.plot("run.png")
    with pytest.raises(ParameterError, match="ax has 3 Axes"):
        run.plot(Figure().subplots(3), what=["joint_angle"])


def test_the_numbers_are_those_of_what_is_shown() -> None:
    loop = made("loop")
    rms = np.degrees(np.sqrt(np.mean(loop.error**2)))
    assert loop._numbers()["rms error of joint_angle"] == f"{rms:.4g} deg"
    row = made("gain map").best()[0]
    assert f"kp = {row['kp']:.4g}" in made("gain map")._numbers()["best with 0.5 kg"]
    numbers = made("gain map")._numbers()
    on_border = any(row["kp"] in (0.5, 3.0) for row in made("gain map").best())
    assert ("on the border of the map" in numbers) == on_border


def test_a_result_of_a_file_has_its_table_and_no_picture(tmp_path: Any) -> None:
    synthetic.diagnosis().to_json(tmp_path / "result.json")
    read = pamrs.load_result(tmp_path)
    assert "heat transfer" in read._repr_html_()
    assert "data:image" not in read._repr_html_()
    with pytest.raises(DiagnosisError, match="traces is not kept"):
        read.plot()


def test_names_are_escaped() -> None:
    rig = pamrs.rigs.shoulder()
    object.__setattr__(rig, "name", "<b>bold</b>")
    assert "<b>bold" not in rig._repr_html_()


def test_names_are_no_formulas_and_extremes_are_drawn() -> None:
    angle = np.zeros(20_000)
    angle[7_777] = 1.0
    tables = {name: {"joint_angle": angle} for name in ("a$x$_{", "_b$\\frac$")}
    case = pamrs.Case.from_arrays(pamrs.rigs.shoulder(), tables, sample_time=0.005)
    assert "data:image/png" in case._repr_html_()
    axes = case.plot(Figure().subplots())
    assert len(axes.get_legend_handles_labels()[1]) == 2
    assert max(axes.lines[0].get_ydata()) == pytest.approx(np.degrees(1.0))
