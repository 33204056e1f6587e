"""``pamrs compare``: two results side by side."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from pamrs.findings import FreeRun, FreeRunError
from tests.diagnosis import synthetic


def result(path: Path, **changes: Any) -> Path:
    path.parent.mkdir(exist_ok=True)
    error = FreeRunError("Pa", 22800.0, changes.pop("free", 610.0), 900.0, 400.0, 400.0)
    run = FreeRun("random", "held_out", 30.0, {"muscle_pressure": error})
    synthetic.diagnosis(free_run=[run], **changes).to_json(path)
    return path


def test_two_results_are_set_side_by_side(tmp_path: Path, run: Any) -> None:
    first = result(tmp_path / "first" / "result.json")
    parameters = {"conductance": {"value": 3e-10, "std": 1e-11, "unit": "m3/(s Pa)"}}
    volume = {"nominal": 6.4e-05, "value": 7.61e-05, "std": 4e-07, "unit": "m3"}
    volume["moved_sigmas"] = 3.0
    second = result(
        tmp_path / "second" / "result.json",
        effects=[{"id": "leak_muscle", "probability": 0.9, "parameters": parameters}],
        probabilities={"leak_muscle": 0.9, "heat_transfer": 0.06, "unlisted": 0.04},
        parameters={"chamber.dead_volume": volume},
        free=6100.0,
    )
    out, page = tmp_path / "both.json", tmp_path / "both.html"
    code, text, err = run("compare", first.parent, second, "--json", out, "--out", page)
    assert (code, f"written: {page}" in err) == (0, True)
    both = json.loads(out.read_text(encoding="utf-8"))
    assert both["schema"] == "pamrs.comparison/1"
    assert both["names"] == ["first", "second"]
    assert both["candidates"]["leak_muscle"] == [0.021, 0.9]
    assert both["candidates"]["heat_transfer+leak_muscle"] == [0.012, None]
    assert both["parameters"]["leak_muscle.conductance"][0] is None
    assert both["parameters"]["chamber.dead_volume"][1]["value"] == 7.61e-05
    assert both["free_run"] == {"random: muscle_pressure": [610.0, 6100.0]}
    assert both["missed"]["muscle_pressure"] == pytest.approx([1.05, 1.05])
    assert both["changed"] == [
        "leak_muscle is named now",
        "heat_transfer is not named any more",
        "probability of heat_transfer: 0.96 before, now 0.06",
        "probability of leak_muscle: 0.02 before, now 0.90",
        # (7.61 - 6.61) cm3 over the root of two squares of 0.4 mm3 each
        "chamber.dead_volume: 6.61e-05 before, now 7.61e-05 m3 (17.7 standard deviations)",
        "free run of random: muscle_pressure: 10 times what it was",
    ]
    lines = [line.split() for line in text.splitlines()]
    assert ["muscle", "leak", "0.02", "0.90"] in lines
    assert ["random:", "muscle_pressure", "6.1", "mbar", "61", "mbar"] in lines
    html = page.read_text(encoding="utf-8")
    assert all(change in html for change in both["changed"])
    assert "src=" not in html


def test_an_effect_that_the_model_holds_by_then_is_told_so(tmp_path: Path, run: Any) -> None:
    first = result(tmp_path / "first.json")
    held = {"nominal": 0.5, "value": 0.5, "std": 0.1, "unit": "1", "moved_sigmas": 0.0}
    parameters = {"heat_transfer.fill_coefficient": held}
    second = result(tmp_path / "second.json", effects=[], verdict="none", parameters=parameters)
    assert "heat_transfer is held by the model" in run("compare", first, second)[1]


def test_the_same_result_twice_changed_nothing(tmp_path: Path, run: Any) -> None:
    one = result(tmp_path / "a.json")
    other = result(tmp_path / "b.json")
    code, text, _ = run("compare", one, other)
    assert code == 0
    assert text.endswith("changed\n  nothing that counts\n")


@pytest.mark.parametrize(
    ("content", "why"),
    [
        ("{", "is not the JSON of a result"),
        ("[" * 200_000, "is not the JSON of a result"),
        ('{"schema": "pamrs.fit/1"}', "pamrs.diagnosis/1 or pamrs.diagnosis/2 is needed"),
        ('{"schema": "pamrs.diagnosis/2", "verdict": "none"}', "is no complete result"),
    ],
)
def test_what_is_no_result_is_refused(tmp_path: Path, run: Any, content: str, why: str) -> None:
    good, bad = result(tmp_path / "good.json"), tmp_path / "bad.json"
    bad.write_text(content, encoding="utf-8")
    code, out, err = run("compare", good, bad)
    assert (code, out) == (2, "")
    assert str(bad) in err
    assert why in err
    assert run("compare", good, tmp_path / "absent")[0] == 2


def test_an_effect_that_acts_elsewhere_is_another(tmp_path: Path, run: Any) -> None:
    first, second = result(tmp_path / "result.json"), tmp_path / "noise0.5" / "result.json"
    other = json.loads(first.read_text(encoding="utf-8"))
    (effect,) = other["effects"][:1]
    effect["at"] = "extensor"
    second.parent.mkdir()
    second.write_text(json.dumps(other), encoding="utf-8")
    code, text, _ = run("compare", first, second.parent)
    assert code == 0
    assert f"{effect['id']}@extensor is named now" in text
    assert tmp_path.name in text
    assert "noise0.5" in text


def test_standard_output_is_for_json_alone(tmp_path: Path, run: Any) -> None:
    one = result(tmp_path / "a.json")
    code, out, err = run("compare", one, one, "--json", "-", "--out", "-")
    assert (code, out) == (2, "")
    assert "-: standard output is for --json alone; a file is needed" in err


def test_files_that_differ_are_named(tmp_path: Path, run: Any) -> None:
    first, second = result(tmp_path / "a.json"), result(tmp_path / "b.json")
    for file, digest in ((first, "1"), (second, "2")):
        content = json.loads(file.read_text(encoding="utf-8"))
        content["inputs"] = {"rig.toml": digest * 64, "run.csv": "3" * 64}
        file.write_text(json.dumps(content), encoding="utf-8")
    assert "  inputs differ: rig.toml\n" in run("compare", first, second)[1]
