"""Install the wheel of a folder where nothing can be compiled, and follow what it says to type.

``python tests/wheel.py dist``, or ``make wheel-test``. The environment is new, and its PATH has
neither cargo nor a C compiler. Every command that ``pamrs example`` prints is run, then the cells
of the notebook and what the README types.
"""

import json
import os
import shlex
import shutil
import subprocess
import sys
import tempfile
import time
import venv
from collections.abc import Callable
from pathlib import Path
from typing import Any

README = Path(__file__).parents[1] / "README.md"
TOOLS = ("cargo", "rustc", "cc", "gcc", "clang", "cl", "zig")
NOTEBOOK = """
import json
cells = json.load(open("example.ipynb", encoding="utf-8"))["cells"]
names = {}
for cell in cells:
    if cell["cell_type"] == "code":
        exec("".join(cell["source"]), names)
assert [effect.id for effect in names["diagnosis"].effects] == names["key"]["effects"]
"""


def bare(programs: Path) -> dict[str, str]:
    """This process's environment with the programs of one folder alone."""
    away = ("CARGO", "RUST", "PYTHON", "MATURIN", "VIRTUAL_ENV", "CC")
    kept = {name: text for name, text in os.environ.items() if not name.startswith(away)}
    found = [tool for tool in TOOLS if shutil.which(tool, path=str(programs))]
    assert not found, f"{programs} has {found}"
    return kept | {"PATH": str(programs), "MPLBACKEND": "Agg"}


def main(dist: Path) -> None:
    (wheel,) = dist.glob("*.whl")
    with tempfile.TemporaryDirectory() as place:
        home = Path(place)
        venv.create(home / "venv", with_pip=True)
        programs = home / "venv" / ("Scripts" if os.name == "nt" else "bin")
        python = shutil.which("python", path=str(programs))
        assert python is not None
        environment = bare(programs)

        def run(*words: str, folder: Path = home) -> str:
            started = time.perf_counter()
            program = shutil.which(words[0], path=str(programs))
            assert program is not None, words[0]
            done = subprocess.run(
                [program, *words[1:]], cwd=folder, env=environment, text=True, capture_output=True
            )
            assert done.returncode == 0, f"{shlex.join(words)}\n{done.stdout}{done.stderr}"
            print(f"{time.perf_counter() - started:6.1f} s  {shlex.join(words)[:90]}", flush=True)
            return done.stdout

        run(
            "python",
            "-m",
            "pip",
            "install",
            "--quiet",
            "--only-binary",
            ":all:",
            str(wheel.resolve()),
        )
        run("python", "-m", "pip", "check")
        version = run("pamrs", "--version").split()[1]
        assert wheel.name.startswith(f"pamrs-{version}-cp311-abi3-")
        said = run("pamrs", "example").partition("Type next:\n")[2].splitlines()
        words = [shlex.split(line) for line in said]
        assert words.pop(0) == ["cd", "pamrs-example"]
        folder = home / "pamrs-example"
        for command in words:
            run(*command, folder=folder)
        run("pamrs", "diagnose", "shoulder", "--json", "result.json", folder=folder)
        key = json.loads((folder / "shoulder_key.json").read_text(encoding="utf-8"))
        result = json.loads((folder / "result.json").read_text(encoding="utf-8"))
        assert [effect["id"] for effect in result["effects"]] == key["effects"]
        for name in ("report.html", "bench.html"):
            page = (folder / name).read_text(encoding="utf-8")
            assert page.startswith("<!DOCTYPE html>"), name
            assert page.count("<svg") > 3, name
        run("python", "-c", NOTEBOOK, folder=folder)
        follow_readme(run, folder)
        check_cores(run, folder, result)


def follow_readme(run: Callable[..., str], folder: Path) -> None:
    """What the README types behind ``pamrs example``, and its Python, on the example's bench."""
    shutil.copy(folder / "bench" / "bench.csv", folder / "my_log.csv")
    text = README.read_text(encoding="utf-8")
    lines = [line.split("#")[0].strip() for line in text.splitlines()]
    shown = [shlex.split(line) for line in lines if line.startswith("pamrs ") and "&&" not in line]
    assert [words[1] for words in shown] == ["diagnose", "rig", "import", "diagnose"]
    for words in shown:
        run(*words, folder=folder)
        if words[1] == "rig":  # the values of the bench
            shutil.copy(folder / "bench" / "rig.toml", folder / "my_rig.toml")
    run("python", "-c", text.partition("```python\n")[2].partition("```")[0], folder=folder)
    assert (folder / "report.html").is_file()
    assert (folder / "model.toml").is_file()


def check_cores(run: Callable[..., str], folder: Path, result: dict[str, Any]) -> None:
    """The second core is loaded where the processor runs it; the first says the same."""
    where = "from pamrs import _core; print(_core.__file__, _core.x86_64_v3())"
    used, can = run("python", "-c", where).split()
    file = Path(used)
    assert file.name.startswith("_core_v3.") == (can == "True"), used
    if can == "True":
        file.rename(file.with_name("aside"))
        assert Path(run("python", "-c", where).split()[0]).name.startswith("_core.")
        run("pamrs", "diagnose", "shoulder", "--json", "first.json", folder=folder)
        first = json.loads((folder / "first.json").read_text(encoding="utf-8"))
        for one, other in zip(first["effects"], result["effects"], strict=True):
            assert one["id"] == other["id"]
            assert abs(one["probability"] - other["probability"]) < 1e-6


if __name__ == "__main__":
    main(Path(sys.argv[1]))
