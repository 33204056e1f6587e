"""The command line of muscle fits: ``pamrs fit muscle``."""

import json
import re
import shlex
from pathlib import Path

import numpy as np
import pytest

from pamrs import load_rig, rigs
from pamrs.rig import Muscle
from pamrs.rig.muscle_models import MODELS
from tests.fit.cases import grid, joined, mapped, remade
from tests.scripts import command
from tests.tables import rows_of

REST = 0.3
LEVELS = [1e5, 2e5, 3e5, 4e5, 5e5, 6e5]
SIZES = shlex.split(
    "--rest-length '300 mm' --rest-diameter '20 mm' --braid-angle '65 +- 3 deg' "
    "--wall-thickness '2 mm'"
)
KOTHERA = [*SIZES, "--model", "kothera", "--order", "2"]
THREE = ["--levels", "100kPa,300kPa,600kPa"]


@pytest.fixture(scope="module")
def muscle():
    return Muscle(
        rest_length=REST,
        rest_diameter=0.02,
        braid_angle=np.radians(65.0),
        wall_thickness=0.002,
        model="kothera",
        modulus_slope=[0.6, -1.0],
        modulus_offset=[1.2e6, -1.5e6],
    )


@pytest.fixture(scope="module")
def data(muscle):
    """Six pressures, seven lengths, noise of 1 N; two rows are no numbers."""
    p, e = grid(LEVELS, np.linspace(0.01, 0.19, 7))
    force = muscle.force(p, e) + np.random.default_rng(5).normal(scale=1.0, size=e.size)
    force[[3, 17]] = np.nan
    return mapped(p, e, force, REST, name="bench 7", source="bench.csv")


@pytest.fixture(scope="module")
def table(data, tmp_path_factory):
    path = tmp_path_factory.mktemp("bench") / "bench.csv"
    rows = np.column_stack([1e3 * data.length, data.pressure / 1e5, data.force])
    text = "\n".join(",".join("" if np.isnan(v) else f"{v:.10g}" for v in row) for row in rows)
    path.write_text("length [mm],pressure_bar,force (N)\n" + text + "\n", encoding="utf-8")
    return path


def run(capsys, *words):
    """Standard output and standard error of a command that ends well."""
    code, out, err = command(capsys, "fit", "muscle", *words)
    assert code == 0, err
    return out, err


def refused(capsys, *words):
    """Standard error of one that does not."""
    code, out, err = command(capsys, "fit", "muscle", *words)
    assert (code, out) == (2, "")
    return err


def test_command_writes_everything(capsys, table, tmp_path):
    files = {name: tmp_path / f"out.{name}" for name in ("json", "toml", "png")}
    outputs = zip(("--json", "--rig", "--png"), files.values(), strict=True)
    out, err = run(capsys, table, *KOTHERA, "--free", "braid-angle", *sum(outputs, ()))
    for words in (
        "kothera, order 2",
        "leave one pressure out: rms",
        "2 rows of 42 have no number",
    ):
        assert words in out
    assert err.count("written: ") == 3
    document = json.loads(files["json"].read_text(encoding="utf-8"))
    assert document["schema"] == "pamrs.muscle_fit/1"
    assert document["fit"]["rms_error"] < 0.01
    fitted = {item["name"]: item for item in document["fit"]["parameters"]}
    assert fitted["braid_angle"]["value"] == pytest.approx(np.radians(65.0), abs=0.01)
    assert fitted["braid_angle"]["tolerance"] == pytest.approx(np.radians(3.0))
    rig = load_rig(files["toml"])
    assert rig.muscle.model == "kothera"
    assert rig.muscle.parameters["modulus_slope"] == [fitted["m1"]["value"], fitted["m2"]["value"]]
    assert document["command"].startswith("pamrs fit muscle")
    assert "--free braid-angle" in document["command"]
    assert files["png"].read_bytes().startswith(b"\x89PNG")
    assert sorted(tmp_path.iterdir()) == sorted(files.values())


def test_command_predicts_left_out_pressures_and_compares(capsys, table):
    levels = ["--levels", "100kPa,3 bar,0.6MPa"]
    out, _ = run(capsys, table, *KOTHERA, *levels, "--compare")
    assert "levels not fitted" in out
    assert "subset: fitted to 100, 300, 600 kPa" in out
    assert all(model in out for model in MODELS)


def test_command_per_level(capsys, table):
    assert "free at each level" in run(capsys, table, *KOTHERA, "--per-level")[0]


def write(path, data):
    """A table of a map."""
    columns = [data.length, data.pressure, data.force]
    heading = "length [m],pressure [Pa],force [N]"
    if np.any(data.direction):
        columns, heading = [*columns, data.direction], f"{heading},direction"
    table = np.column_stack(columns)
    np.savetxt(path, table, delimiter=",", header=heading, comments="", fmt="%.10g")
    return path


@pytest.fixture(scope="module")
def loops(muscle, tmp_path_factory):
    """A table of loops with c_F = 0.06 - 0.04/MPa P and noise of 1 N."""
    rubbing = muscle.replace(friction_coefficient=0.06, friction_pressure_slope=-4e-8)
    p, e, d = grid(LEVELS, np.linspace(0.01, 0.19, 8), [-1.0, 1.0])
    force = rubbing.force(p, e, direction=d) + np.random.default_rng(2).normal(size=e.size)
    path = tmp_path_factory.mktemp("loops") / "loops.csv"
    return write(path, mapped(p, e, force, REST, direction=d))


def test_friction_is_fitted_before_the_moduli_and_goes_into_the_rig(
    capsys, loops, muscle, tmp_path
):
    rig, result = tmp_path / "rig.toml", tmp_path / "fit.json"
    out, err = run(capsys, loops, *KOTHERA, "--rig", rig, "--json", result, "--compare")
    told = r"friction, fitted to the loops before .* c0 = (\S+) \+- .* c1 = (\S+) \+-"
    c0, c1 = map(float, re.search(told, out).groups())
    assert (c0, c1) == (pytest.approx(0.06, abs=0.005), pytest.approx(-0.04, abs=0.01))
    fitted = load_rig(rig).muscle
    given, at = fitted.parameters, (4e5, [0.05, 0.15])
    assert given["friction_coefficient"] == pytest.approx(c0, rel=1e-3)
    assert given["friction_pressure_slope"] == pytest.approx(1e-6 * c1, rel=1e-3)
    np.testing.assert_allclose(fitted.force(*at), muscle.force(*at), rtol=0.01)
    document = json.loads(result.read_text(encoding="utf-8"))
    assert document["friction"]["parameters"][0]["value"] == given["friction_coefficient"]
    assert document["fit"]["rms_error"] < 0.01
    assert document["comparison"][0]["rms"] < 0.01  # every model has it
    assert f"{rig} is the muscle on a load frame: simulate it with a length" in err
    again = [*KOTHERA, "--muscle", rig]  # that muscle has friction
    has = "friction as the muscle has it: c_F = max(c0 + c1 P, 0.01), c0 = 0.0"
    assert has in run(capsys, loops, *again)[0]
    fitted_again, _ = run(capsys, loops, *again, "--friction", "fit", *THREE)
    assert "friction, fitted to the loops" in fitted_again


@pytest.mark.parametrize(
    "options", ["--model kothera --friction none", "--friction muscle", "--model elbow_linear"]
)
def test_friction_may_stay_out(capsys, loops, tmp_path, options):
    result = tmp_path / "fit.json"
    out, _ = run(capsys, loops, *SIZES, *options.split(), "--json", result)
    assert "fitted to the loops" not in out
    assert json.loads(result.read_text(encoding="utf-8"))["friction"] is None
    assert ("the muscle has no friction" in out) == ("elbow_linear" not in options)


def test_friction_that_cannot_be_fitted_is_said_or_refused(capsys, loops, tmp_path):
    lines = loops.read_text(encoding="utf-8").splitlines()
    few = tmp_path / "few.csv"  # one pressure has a loop, the others one branch
    kept = [line for line in lines[1:] if line.endswith(",-1") or ",100000," in line]
    few.write_text("\n".join([lines[0], *kept]) + "\n", encoding="utf-8")
    options = [few, *SIZES, "--order", 2]
    told = "friction: not fitted, few: one pressure only (100 kPa)"
    assert told in run(capsys, *options)[0]
    assert "one pressure only (100 kPa)" in refused(capsys, *options, "--friction", "fit")
    assert "--friction" in refused(capsys, *options, "--friction", "some")


def test_the_fitted_muscle_goes_into_the_rig_that_it_is_of(capsys, tmp_path):
    shoulder = rigs.shoulder()
    source = shoulder.to_toml(tmp_path / "shoulder.toml")
    real = shoulder.muscle
    p, e = grid(LEVELS, np.linspace(0.0, 0.25, 9))
    offset = [1.1 * value for value in real.parameters["modulus_offset"]]
    force = real.replace(modulus_offset=offset).force(p, e)
    path = write(tmp_path / "map.csv", mapped(p, e, force, 0.276))
    _, err = run(capsys, path, "--muscle", source, "--rig", tmp_path / "fitted.toml")
    assert "cannot be simulated" not in err
    fitted = load_rig(tmp_path / "fitted.toml")
    assert fitted.blocks == shoulder.blocks
    for block in ("joint", "arm"):
        assert fitted.model[block] == pytest.approx(shoulder.model[block])
    assert fitted.model["muscle"]["count"] == 6
    np.testing.assert_allclose(fitted.muscle.force(p, e), force, rtol=1e-6, atol=1e-3)


def test_a_tolerance_of_what_is_not_free_is_named(capsys, table, tmp_path):
    note = "tolerance of braid_angle is not used: not free (--free braid_angle)"
    assert note in run(capsys, table, *KOTHERA)[0]
    rig = tmp_path / "bench.toml"
    out, _ = run(capsys, table, *KOTHERA, "--free", "braid_angle", "--rig", rig)
    assert "is not used" not in out
    assert load_rig(rig).parameter("muscle.braid_angle").tol > 0.0
    assert note in run(capsys, table, "--muscle", rig)[0]


@pytest.mark.parametrize("levels", [[], THREE])
def test_a_level_at_rest_is_told_and_drawn(capsys, data, tmp_path, levels):
    e = np.linspace(0.01, 0.19, 7)
    rest = mapped(0 * e, e, -0.5 * np.cos(9 * e), REST)
    path = write(tmp_path / "rest.csv", joined(data, rest))
    result = tmp_path / "x.json"
    outputs = ["--png", tmp_path / "x.png", "--json", result]
    out, err = run(capsys, path, *KOTHERA, "--compare", *outputs, *levels)
    assert "0 kPa: not in this table, the largest force there is below 1 % of the map" in out
    assert not {"nan", "inf"} & set(re.findall(r"[a-z]+", out.lower()))
    assert ("levels not fitted" in out) == bool(levels)
    assert err.count("written: ") == 2
    json.loads(result.read_text(encoding="utf-8"))


@pytest.mark.parametrize(
    ("words", "parts"),
    rows_of(__file__, "wrong_input_is_one_line"),
)
def test_wrong_input_is_one_line_and_nothing_is_written(capsys, table, tmp_path, words, parts):
    err = refused(capsys, table, "--png", tmp_path / "x.png", *words)
    line = err.splitlines()[-1]
    assert line.startswith("pamrs: error: ")
    assert "Traceback" not in err
    assert all(part in line for part in parts)
    assert list(tmp_path.iterdir()) == []


def test_a_description_needs_no_geometry(capsys, table):
    path = table.with_name("bench.toml")
    path.write_text(
        """schema = "pamrs.force_map/1"
file = "bench.csv"
[muscle]
model = "kothera"
rest_length = { value = 300, unit = "mm" }
rest_diameter = { value = 20, unit = "mm" }
braid_angle = { value = 65, unit = "deg" }
wall_thickness = { value = 2, unit = "mm" }
""",
        encoding="utf-8",
    )
    assert path.stem in run(capsys, path, "--order", 2)[0]
    err = refused(capsys, path, "--rest-length", "300 mm", "--where", "a=b")
    assert "--rest-length, --where cannot be given" in err


def test_zeros_that_nobody_explains_are_named(capsys, data, tmp_path):
    force = np.where(data.level == 0, 0.0, data.force)
    path = write(tmp_path / "zeros.csv", remade(data, data.used, force=force[data.used]))
    options = [path, *SIZES, "--order", 2]
    assert "--clipped '0 N'" in refused(capsys, *options, "--levels", "100kPa")
    out, _ = run(capsys, *options)
    assert "--clipped '0 N'" in out
    assert "100 kPa: not in this table" in out
    assert "are clipped" in run(capsys, *options, "--clipped", "0 N")[0]


# ------------------------------------------------------------------ real muscles

CASE = Path(__file__).parents[2] / "cases" / "festo_dmsp"


@pytest.mark.skipif(
    not (CASE.parents[2] / "shared/recordings/festo_dmsp_martens_boblan").is_dir(),
    reason="the Festo maps are not beside the project",
)
@pytest.mark.parametrize(
    ("name", "levels", "published"),
    [
        ("DMSP-20-300", "110kPa,343.75kPa,675kPa", 0.044),
        ("DMSP-10-250", "132.5kPa,335kPa,650kPa", 0.0235),
    ],
)
def test_festo_maps_are_met_better_than_published(capsys, tmp_path, name, levels, published):
    options = ["--model", "robinson", "--order", 4, "--free", "braid_angle,rest_length"]

    def fitted(*more):
        result = tmp_path / "fit.json"
        run(capsys, CASE / f"{name}.toml", "--allow-outside", *options, "--json", result, *more)
        return json.loads(result.read_text(encoding="utf-8"))

    document = fitted()
    assert document["fit"]["max_error"] < published / 2
    assert document["leave_one_pressure_out"]["max"] < published / 2
    # A sixth, half and all of the highest pressure, as the dissertation chose its three.
    assert fitted("--levels", levels)["fit"]["held_out_max_error"] < published
