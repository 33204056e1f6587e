"""Of the two cores of a wheel, the one is loaded that the processor runs."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import pamrs
from pamrs import _core

RUN = """
import sys, pamrs
if {old}:
    import pamrs._core
    del pamrs.__dict__["_core"]
    sys.modules["pamrs._core"].x86_64_v3 = lambda: False
from pamrs import _core
assert sys.modules["pamrs._core"] is _core is pamrs._core
run = pamrs.simulate(pamrs.rigs.shoulder(), 6.0, sample_time=0.01, duration=0.1)
assert run["joint_angle"].size > 5
print(_core.__file__)
"""


@pytest.mark.parametrize("old", [False, True])
def test_the_second_core_is_loaded_where_it_runs(tmp_path, old):
    package = tmp_path / "pamrs"
    skip = shutil.ignore_patterns("_core.*.so", "_core.pyd", "example_files", "__pycache__")
    shutil.copytree(Path(pamrs.__file__).parent, package, ignore=skip)
    built = Path(_core.__file__)
    for name in ("_core", "_core_v3"):
        shutil.copy(built, package / built.name.replace("_core", name, 1))
    done = subprocess.run(
        [sys.executable, "-c", RUN.format(old=old)],
        env={"PYTHONPATH": str(tmp_path)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    second = Path(done.stdout.strip()).name.startswith("_core_v3")
    assert second == (_core.x86_64_v3() and not old)
