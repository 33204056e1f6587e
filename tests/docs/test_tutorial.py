"""The tutorial "from your log to a diagnosis in ten minutes" runs as it is written."""

from __future__ import annotations

import json
import re
import shlex
import shutil
from pathlib import Path

import pytest

from demo.example import FRICTION, NOISE
from pamrs import cli
from tests.docs.test_site import cells

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs/tutorials/log_to_diagnosis.md"
BENCH = ROOT / "python" / "pamrs" / "cli" / "example_files" / "bench"


def run_shell(text: str) -> None:
    """The lines of a cell below ``%%sh``; the example is there already."""
    for line in text.splitlines():
        words = shlex.split(line)
        assert words[0] == "pamrs"
        if words[1] != "example":
            assert cli.main(words[1:]) == 0, line


def test_every_cell_runs_in_its_order(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for name in ("map.csv", "bench.csv"):
        shutil.copy(BENCH / name, tmp_path)
    monkeypatch.chdir(tmp_path)
    ran: list[str] = []
    names: dict[str, object] = {}
    for text in cells(PAGE):
        first, _, rest = text.partition("\n")
        ran.append(first.split()[0] if first.startswith("%") else "python")
        if first == "%%sh":
            run_shell(rest)
        elif first.startswith("%%writefile "):
            Path(first.split()[1]).write_text(rest, encoding="utf-8")
        elif first.startswith("%cd "):
            assert first.split()[1] == "pamrs-example/bench"
        elif "IPython" not in text:
            exec(compile(text, PAGE.name, "exec"), names)
    assert set(ran) == {"%%sh", "%%writefile", "%cd", "python"}
    said = capsys.readouterr().out
    assert "each branch differs from it by 10.9 N rms: hysteresis" in said
    words = " ".join(said.split())
    assert "leaves out" in words
    assert "muscle hysteresis (0." in words
    assert "muscle_hysteresis 0." in said
    assert "by tape measure" in Path("model.toml").read_text(encoding="utf-8")
    result = json.loads(Path("result.json").read_text(encoding="utf-8"))
    (effect,) = result["effects"]
    assert effect["id"] == "muscle_hysteresis"
    for name, true in FRICTION.items():
        entry = effect["parameters"][name]
        assert abs(entry["value"] - true) < 4.0 * entry["std"] + 0.03 * true
    error = result["fit"]["held_out"]["force"]
    assert error["before"] > 10.0 * NOISE
    assert error["after"] < 2.0 * NOISE
    assert {"report.html", "replay.png", "model.toml", "case.toml"} <= {
        path.name for path in tmp_path.iterdir()
    }


def test_the_rig_file_of_the_page_is_that_of_the_example() -> None:
    (written,) = re.findall(
        r"^%%writefile rig\.toml\n(.*?)^```$", PAGE.read_text(encoding="utf-8"), re.M | re.S
    )
    assert written == (BENCH / "rig.toml").read_text(encoding="utf-8")
