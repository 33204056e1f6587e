"""The command line of sizing."""

import json
from pathlib import Path

import pytest

from pamrs import library, rigs
from pamrs.design.sizing import Filling, Requirement, size
from tests.scripts import command as run
from tests.tables import rows_of

POINTS = ["--point", "0 mm:18 kN", "--point", "30 mm:7 kN"]
PAIR = ["elbow_0625in", "large_2in_effective"]


def assert_refused(capsys, words, parts):
    """Exit code 2, nothing on standard output, one line that names what is wrong."""
    code, out, err = run(capsys, *words)
    assert (code, out) == (2, "")
    assert err.count("\n") == 1
    assert err.startswith("pamrs: error: ")
    for part in parts:
        assert part in err


def line_of(text, start):
    """The words of the line that starts with ``start``."""
    return next(line for line in text.splitlines() if line.strip().startswith(start)).split()


def test_size_prints_and_writes_what_the_function_gives(capsys, tmp_path):
    path = tmp_path / "size.json"
    code, out, err = run(
        capsys, "size", *POINTS, *PAIR, "--core", "40 mm", "--dead-volume", "20 ml", "--json", path
    )
    assert code == 0
    assert err == f"written: {path}\n"
    expected = size(
        PAIR, Requirement([(0.0, 18e3), (0.03, 7e3)]), filling=Filling(dead_volume=20e-6), core=0.04
    )
    assert expected.table() in out
    assert line_of(out, "count")[1:] == ["6", "1", "*"]
    assert "required: 0 mm:18 kN, 30 mm:7 kN" in out
    document = json.loads(path.read_text(encoding="utf-8"))
    assert document["schema"] == "pamrs.sizing/1"
    assert document["requirement"] == {"position": "stroke", "points": [[0.0, 18e3], [0.03, 7e3]]}
    assert document["filling"]["dead_volume"] == pytest.approx(20e-6)
    assert document["rows"][0] == pytest.approx(expected.rows[0])
    assert document["best"] == expected.best


def test_the_valve_is_an_area_or_a_conductance(capsys):
    def fill_time(*options):
        code, out, _ = run(capsys, "size", *POINTS, "elbow_0625in", *options)
        assert code == 0
        return float(line_of(out, "fill time, inflated")[4])

    usual = fill_time()
    assert fill_time("--valve", "8.4 mm2", "--supply", "13.8 bar") == usual
    assert fill_time("--valve", "16.8 mm2") == pytest.approx(0.5 * usual, rel=1e-3)
    area = Filling.from_sonic_conductance(2e-8).area
    assert fill_time("--valve", "2 l/(s bar)") == pytest.approx(usual * 8.4e-6 / area, rel=1e-3)
    assert fill_time("--supply", "20 bar") < usual


def test_a_rig_file_is_a_candidate_at_a_pressure(capsys, tmp_path):
    path = tmp_path / "a.toml"
    rigs.bench(library.pam_a_1in(), "pam_a_1in").to_toml(path)
    code, out, _ = run(capsys, "size", *POINTS, path, "pam_a_1in", "--pressure", "11 bar")
    assert code == 0
    assert line_of(out, "blocked force")[3] == line_of(out, "blocked force")[4]
    parts = [f"MUSCLE = '{path}' is a rig file", "give --pressure"]
    assert_refused(capsys, ["size", *POINTS, path], parts)


def test_a_pressure_beyond_the_tests_is_said(capsys):
    out = run(capsys, "size", *POINTS, "elbow_0625in", "--pressure", "12 bar")[1]
    assert "elbow_0625in: 12 bar is above the highest pressure of its tests, 10.34 bar" in out
    assert "above the highest" not in run(capsys, "size", *POINTS, "elbow_0625in")[1]


def test_what_is_not_feasible_is_printed_with_its_reason(capsys, tmp_path):
    path = tmp_path / "size.json"
    code, out, _ = run(capsys, "size", "--point", "30 cm:9 N", "elbow_0625in", "--json", path)
    assert code == 0
    told = "not feasible: it would contract by 1.517, beyond the braid's limit 0.392"
    assert f"elbow_0625in: {told}" in out
    assert "count" not in out
    assert json.loads(path.read_text(encoding="utf-8"))["rows"] == []
    code, out, _ = run(capsys, "size", *POINTS, *PAIR, "--max-count", 3)
    assert code == 0
    assert "elbow_0625in: not feasible: 6 are needed, at most 3 are considered" in out
    assert line_of(out, "count")[1] == "1"


@pytest.mark.parametrize(
    ("words", "parts"),
    rows_of(__file__, "wrong_words_to_size_write_nothing"),
)
def test_wrong_words_to_size_write_nothing(capsys, tmp_path, monkeypatch, words, parts):
    monkeypatch.chdir(tmp_path)
    assert_refused(capsys, ["size", *words, "--json", "size.json"], parts)
    assert list(Path().iterdir()) == []
