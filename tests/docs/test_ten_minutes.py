"""The page "from your log to a diagnosis in ten minutes" runs as it stands."""

from __future__ import annotations

import json
import re
import shlex
import shutil
from pathlib import Path

import pytest

from demo.example import FRICTION, NOISE
from pamrs import cli

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "ten_minutes.md"
BENCH = ROOT / "python" / "pamrs" / "cli" / "example_files" / "bench"


def blocks() -> list[tuple[str, str]]:
    """Language and text of every block of the page, in its order."""
    return re.findall(r"^```(\w+)\n(.*?)^```$", PAGE.read_text(encoding="utf-8"), re.M | re.S)


def test_every_block_runs_in_its_order(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for name in ("map.csv", "bench.csv"):
        shutil.copy(BENCH / name, tmp_path)
    monkeypatch.chdir(tmp_path)
    ran: list[str] = []
    for language, text in blocks():
        ran.append(language)
        if language == "toml":
            name = re.match(r"# (\S+)\n", text)
            assert name is not None
            Path(name[1]).write_text(text, encoding="utf-8")
        elif language == "sh":
            for line in text.strip().splitlines():
                words = shlex.split(line)
                assert words[0] == "pamrs"
                assert cli.main(words[1:]) == 0, capsys.readouterr().err
        else:
            assert language == "python"
            exec(compile(text, "ten_minutes.md", "exec"), {})
    assert set(ran) == {"toml", "sh", "python"}
    said = capsys.readouterr().out
    for line in re.findall(r"^    (\S.*)$", PAGE.read_text(encoding="utf-8"), re.M):
        if "[N]" not in line and "held-out" not in line:  # numbers, below
            assert re.sub(r"[\d.]+", "#", line) in re.sub(r"[\d.]+", "#", said), line
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
