"""``pamrs example``: what it copies, and how those files were made."""

import ast
import json
import re
import shutil
import subprocess
import sys
from dataclasses import replace
from html import unescape
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pytest

import pamrs
from pamrs.recordings import load_case
from tests.scripts import command

ROOT = Path(__file__).parents[2]
FILES = ROOT / "python" / "pamrs" / "cli" / "example_files"
MOST_BYTES = 600_000


def files_of(folder):
    return {p.relative_to(folder).as_posix(): p for p in folder.rglob("*") if p.is_file()}


@pytest.mark.parametrize("made_before", [False, True])
def test_every_file_is_copied_and_the_next_words_name_them(tmp_path, capsys, made_before):
    folder = tmp_path / "my example"
    if made_before:
        folder.mkdir()
    code, out, _ = command(capsys, "example", folder)
    assert code == 0
    copied = {name: path.read_bytes() for name, path in files_of(folder).items()}
    assert copied == {name: path.read_bytes() for name, path in files_of(FILES).items()}
    assert sum(map(len, copied.values())) < MOST_BYTES
    assert f"cd '{folder}'" in out
    for word in re.findall(r"[\w/]*(?:shoulder|bench)[\w/.]*", out):
        assert (folder / word).exists() or word == "bench.html", word
    assert len(load_case(folder / "shoulder").recordings) == 3


def test_without_a_name_the_folder_is_pamrs_example(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert "cd pamrs-example" in command(capsys, "example")[1]
    assert (tmp_path / "pamrs-example" / "example.ipynb").exists()


def test_what_is_there_is_left_alone(tmp_path, capsys):
    file = tmp_path / "mine.txt"
    file.write_text("mine", encoding="utf-8")
    said = f"{tmp_path}: the folder is not empty; give another one (pamrs example FOLDER)\n"
    assert command(capsys, "example", tmp_path) == (2, "", f"pamrs: error: {said}")
    code, _, err = command(capsys, "example", file)
    assert code == 2
    assert "mine.txt" in err
    assert list(files_of(tmp_path)) == ["mine.txt"]
    assert file.read_text(encoding="utf-8") == "mine"


def numbers(path):
    return np.array(re.findall(r"-?\d+(?:\.\d+)?", path.read_text("latin-1").replace(",", ".")))


def run_cell(source, names):
    """Run a cell; what its last line is worth, as a notebook shows it."""
    *before, last = ast.parse(source).body
    if not isinstance(last, ast.Expr):
        before, last = [*before, last], None
    exec(compile(ast.Module(before, []), "example.ipynb", "exec"), names)
    return last and eval(compile(ast.Expression(last.value), "example.ipynb", "eval"), names)


def test_the_notebook_runs_and_shows_what_it_says(tmp_path, monkeypatch, capsys):
    pytest.importorskip("matplotlib").use("Agg")
    shutil.copytree(FILES, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)

    def shorter(folder):  # a diagnosis of all of it is what the wheel's test does
        case = load_case(folder)
        return replace(case, recordings=[r.between(0.0, 5.0) for r in case.recordings])

    monkeypatch.setattr(pamrs, "load_case", shorter)
    names, shown = {}, []
    for cell in json.loads(Path("example.ipynb").read_text(encoding="utf-8"))["cells"]:
        if cell["cell_type"] == "code":
            worth = run_cell("".join(cell["source"]), names)
            shown.append(worth._repr_html_() if hasattr(worth, "_repr_html_") else "")
    case, rig, recording, diagnosis, *_ = shown
    assert all("data:image/png" in html for html in (case, rig, recording, diagnosis))
    assert "recording angle_steps" in case
    assert names["diagnosis"].headline in unescape(diagnosis)
    assert "<!doctype html>" in Path("report.html").read_text(encoding="utf-8").lower()
    measured, nominal, mended = names["ax"].lines
    assert len({line.get_color() for line in (measured, nominal, mended)}) == 3
    found = [np.interp(measured.get_xdata(), *line.get_data()) for line in (nominal, mended)]
    missed = [np.abs(one - measured.get_ydata()).mean() for one in found]
    assert missed[1] < 0.5 * missed[0]
    plt.close("all")
    out = capsys.readouterr().out
    assert "concealed: ['leak_muscle']" in out
    assert "named:     ['leak_muscle']" in out


def test_the_files_are_those_that_the_script_makes(tmp_path):
    subprocess.run([sys.executable, "-m", "demo.example", tmp_path], cwd=ROOT, check=True)
    kept = files_of(FILES)
    notebook = json.loads(kept.pop("example.ipynb").read_text(encoding="utf-8"))
    assert not any(cell.get("outputs") for cell in notebook["cells"])
    made = files_of(tmp_path)
    assert set(made) == set(kept)
    for name, path in kept.items():
        if path.suffix == ".csv":
            got, want = numbers(made[name]).astype(float), numbers(path).astype(float)
            assert len(got) == len(want)
            assert np.mean(np.abs(got - want) > 2e-3 * np.maximum(1.0, np.abs(want))) < 0.01
        elif path.suffix == ".toml":
            assert made[name].read_text(encoding="utf-8") == path.read_text(encoding="utf-8")
