"""``pamrs example``: a small case, a force map and a log to begin with."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Final

import typer

from pamrs.errors import ParameterError

_FILES: Final = Path(__file__).parent / "example_files"
_DEFAULT: Final = Path("pamrs-example")
_NEXT: Final = """\
shoulder           recordings of a simulated arm; its rig.toml leaves something out
shoulder_key.json  what it leaves out: open it last
bench              a rig, a force map and a log, as a laboratory wrote them
example.ipynb      the same in Python, for Jupyter

Type next:
    cd {folder}
    pamrs diagnose shoulder --report report.html
    pamrs fit map bench/map.csv --muscle bench/rig.toml --rig bench/rig.toml
    pamrs import bench/bench.csv --rig bench/rig.toml --out bench
    pamrs diagnose bench --report bench.html"""


def example_command(
    folder: Annotated[Path, typer.Argument(help="Folder to make, or an empty one.")] = _DEFAULT,
) -> None:
    """Copy a small case, a force map, a log and a notebook into a folder, and say what to type
    next.
    """
    import shlex
    import shutil

    if folder.is_dir() and any(folder.iterdir()):
        raise ParameterError(
            f"{folder}: the folder is not empty; give another one (pamrs example FOLDER)"
        )
    for file in sorted(_FILES.rglob("*")):
        if file.is_file():
            copy = folder / file.relative_to(_FILES)
            copy.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(file, copy)
    typer.echo(f"written: {folder}\n")
    typer.echo(_NEXT.format(folder=shlex.quote(str(folder))))
