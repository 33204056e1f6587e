"""The command line of friction: ``pamrs fit friction``."""

import json
import re

import numpy as np
import pytest

from pamrs.fit import fit_friction, load_force_map
from pamrs.rig import Muscle
from tests.scripts import command
from tests.tables import rows_of

C0, C1 = 0.16, -0.145e-6  # (2.36)
REST = 0.276
LEVELS = np.array([2.0, 4.0, 6.0, 8.0, 12.0]) * 1e5
OPTIONS = ["--rest-length", "276 mm"]


def cycle(count):
    """Contraction and direction of one slow loop."""
    e = np.linspace(0.01, 0.28, count)
    return np.concatenate([e, e[::-1]]), np.repeat([-1, 1], count)


def frictional():
    """The muscle whose friction is to be found."""
    return Muscle(
        rest_length=REST,
        rest_diameter=0.0254,
        braid_angle=np.radians(73.5),
        wall_thickness=0.003175,
        modulus_slope=[3.0, -0.35],
        modulus_offset=[1.15e6, -0.15e6],
        friction_coefficient=C0,
        friction_pressure_slope=C1,
        friction_floor=0.01,
    )


def rows(count, noise):
    """Length [mm], pressure [kPa], force [N] and direction of one loop at every level."""
    muscle, rng = frictional(), np.random.default_rng(3)
    e, way = cycle(count)
    loops = []
    for p in LEVELS:
        force = muscle.force(p, e, direction=way) + noise * rng.normal(size=e.size)
        loops.append(np.column_stack([REST * (1 - e) * 1e3, 0 * e + p / 1e3, force, way]))
    return np.concatenate(loops)


@pytest.fixture(scope="module")
def table(tmp_path_factory):
    path = tmp_path_factory.mktemp("loops") / "loops.csv"
    header = "length [mm],pressure [kPa],force [N],direction"
    np.savetxt(path, rows(40, 2.0), delimiter=",", header=header, comments="", fmt="%.10g")
    return path


def run(capsys, *words):
    return command(capsys, "fit", "friction", *words)


def printed(out, name):
    """Value and standard error of a coefficient as printed."""
    return [float(text) for text in re.search(rf"{name} = (\S+) \+- (\S+)", out).groups()]


def test_the_coefficients_come_back_with_the_loops(capsys, table):
    code, out, err = run(capsys, table, *OPTIONS)
    assert code == 0
    assert "fitting loops" in err
    assert out.startswith("loops: friction of the muscle")
    for name, truth in (("c0", C0), ("c1", C1 * 1e6)):
        value, stderr = printed(out, name)
        assert value == pytest.approx(truth, abs=3 * stderr)
        assert stderr < 0.02 * abs(truth)
    assert "(significant, p = " in out
    assert "floor = 0.01 (given)" in out
    assert re.search(r"1200\.0 .*on the floor", out)


def test_it_prints_and_writes_what_the_function_gives(capsys, table, tmp_path):
    result = tmp_path / "out.json"
    code, out, err = run(capsys, table, *OPTIONS, "--floor", 0.0, "--json", result)
    assert code == 0
    fit = fit_friction(load_force_map(table, rest_length=REST), floor=0.0)
    assert out == f"loops: {fit.fit_report()}\n"
    document = json.loads(result.read_text(encoding="utf-8"))
    assert document["schema"] == "pamrs.friction_fit/1"
    assert document["rows"] == 400
    assert document["fit"] == fit.to_dict()
    assert [item["value"] for item in document["fit"]["parameters"]] == [
        p.value for p in fit.params.values()
    ]
    assert document["fit"]["levels"][0]["rows"] == 80
    assert f"pamrs fit friction {table} --rest-length '276 mm' --floor 0.0" in document["command"]
    assert err.count("written: ") == 1
    assert list(tmp_path.iterdir()) == [result]


def test_the_muscle_may_be_named_or_given_in_full(capsys, table):
    alone = run(capsys, table, *OPTIONS)[1]
    assert run(capsys, table, "--muscle", "pam_a_1in")[1] == alone
    sizes = ("--rest-diameter", "25.4 mm", "--braid-angle", "73.5 deg", "--wall-thickness")
    assert run(capsys, table, *OPTIONS, *sizes, "3.175 mm")[1] == alone


DESCRIBED = """schema = "pamrs.force_map/1"
name = "loops"
file = "{table}"
[muscle]
rest_length = {{ value = 276, unit = "mm" }}
rest_diameter = {{ value = 25.4, unit = "mm" }}
braid_angle = {{ value = 73.5, unit = "deg" }}
wall_thickness = {{ value = 3.175, unit = "mm" }}
"""


def test_a_description_brings_its_muscle(capsys, table):
    path = table.with_name("loops.toml")
    path.write_text(DESCRIBED.format(table=table.name), encoding="utf-8")
    assert run(capsys, path)[1] == run(capsys, table, *OPTIONS)[1]
    code, _, err = run(capsys, path, *OPTIONS)
    assert code == 2
    assert "--rest-length cannot be given" in err


@pytest.mark.parametrize("fit", ["friction", "muscle", "map"])
def test_a_table_outside_a_description_needs_to_be_allowed(capsys, table, tmp_path, fit):
    described = tmp_path / "map.toml"
    described.write_text(DESCRIBED.format(table=table.as_posix()), encoding="utf-8")
    code, _, err = command(capsys, "fit", fit, described)
    assert code != 0
    assert "lies outside the folder of the description" in err
    code, out, _ = command(capsys, "fit", fit, described, "--allow-outside")
    assert code == 0
    assert out.startswith("loops: ")


@pytest.mark.parametrize(
    ("words", "parts"),
    rows_of(__file__, "wrong_input_is_one_line_and_writes_nothing"),
)
def test_wrong_input_is_one_line_and_writes_nothing(capsys, table, tmp_path, words, parts):
    code, out, err = run(capsys, table, *words, "--json", tmp_path / "x.json")
    line = err.splitlines()[-1]
    assert (code, out) == (2, "")
    assert line.startswith("pamrs: error: ")
    assert "Traceback" not in err
    for part in parts:
        assert part in line
    assert list(tmp_path.iterdir()) == []


def test_missing_files_and_folders_are_named(capsys, table):
    code, _, err = run(capsys, "no_such.csv", *OPTIONS)
    assert code == 2
    assert "no_such.csv: cannot be read" in err
    code, _, err = run(capsys, table, *OPTIONS, "--json", "no_folder/x.json")
    assert code == 2
    assert "folder no_folder does not exist" in err
