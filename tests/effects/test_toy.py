"""A new effect through the whole package: a Rust file, a file of words and a class of the trial.

The core's tests use the Rust file as it stands (crates/pam-core/tests/laws/toy_effect.rs). Here the
extension is built with it in the catalogue (feature `toy`), beside a copy of the package that has
its words; `toy_case.py` then runs with that copy.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from pamrs.effects import EFFECTS

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
WORDS = HERE / "toy_joint_spring.toml"
#: Not target/release: another feature is another core, and neither build shall undo the other.
TARGET = ROOT / "target" / "toy"
#: Minutes of link-time optimisation buy nothing here.
PROFILE = {"CARGO_PROFILE_RELEASE_LTO": "off", "CARGO_PROFILE_RELEASE_CODEGEN_UNITS": "16"}
BUILD = (
    "build",
    "--release",
    "--locked",
    "--package",
    "pam-py",
    "--features",
    "pyo3/extension-module,toy",
)

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(
        shutil.which("cargo") is None, reason="no cargo: the extension cannot be built"
    ),
    pytest.mark.skipif(
        sys.platform != "linux", reason="elsewhere an extension needs the linker flags of maturin"
    ),
]


def run(*command: str, cwd: Path, env: dict[str, str]) -> str:
    """What a command prints; it goes behind whatever else the machine does."""
    kind = ("nice", "-n", "10") if shutil.which("nice") else ()
    done = subprocess.run(
        [*kind, *command], cwd=cwd, env=os.environ | env, capture_output=True, text=True
    )
    assert done.returncode == 0, f"{' '.join(command)}:\n{done.stdout}\n{done.stderr}"
    return done.stdout


@pytest.fixture(scope="module")
def package(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a copy of the package that has one effect more."""
    env = PROFILE | {"CARGO_TARGET_DIR": str(TARGET), "PYO3_PYTHON": sys.executable}
    run("cargo", *BUILD, cwd=ROOT, env=env)
    folder = tmp_path_factory.mktemp("package")
    skipped = shutil.ignore_patterns("__pycache__", "_core*.so")
    shutil.copytree(ROOT / "python" / "pamrs", folder / "pamrs", ignore=skipped)
    shutil.copy(TARGET / "release" / "lib_core.so", folder / "pamrs" / "_core.abi3.so")
    shutil.copy(WORDS, folder / "pamrs" / "effects" / "words")
    return folder


@pytest.fixture(scope="module")
def path(package: Path) -> dict[str, str]:
    """That package, and the trial of this checkout."""
    return {"PYTHONPATH": os.pathsep.join((str(package), str(ROOT)))}


@pytest.fixture(scope="module")
def told(
    package: Path, path: dict[str, str], tmp_path_factory: pytest.TempPathFactory
) -> dict[str, Any]:
    """What `toy_case.py` found."""
    folder = tmp_path_factory.mktemp("case")
    printed = run(sys.executable, str(HERE / "toy_case.py"), str(folder), cwd=folder, env=path)
    found: dict[str, Any] = json.loads(printed.splitlines()[-1])
    assert Path(found["package"]).is_relative_to(package)
    return found


def test_the_package_as_it_is_does_not_know_it() -> None:
    assert WORDS.stem not in EFFECTS


def test_it_is_in_the_catalogue_with_its_words(package: Path, path: dict[str, str]) -> None:
    page = run(sys.executable, "-m", "pamrs", "effects", WORDS.stem, cwd=package, env=path)
    assert "spring at the joint that begins at an angle and relaxes" in " ".join(page.split())
    listed = run(sys.executable, "-m", "pamrs", "effects", cwd=package, env=path)
    assert all(effect in listed for effect in (WORDS.stem, "leak_muscle", "joint_end_stop"))


def test_both_forms_move_a_joint(told: dict[str, Any]) -> None:
    assert min(told["moved"].values()) > 0.01
    assert told["moved"]["linear"] != told["moved"]["cubic"]


def test_a_diagnosis_names_it_with_its_size(told: dict[str, Any]) -> None:
    assert told["verdict"] == "effects"
    assert told["effects"] == [WORDS.stem]
    assert told["where"] == "arm"
    # whatever else: the trial's own form of it moves parameters to the end of their tolerances
    assert told["probability"] > 0.9
    assert told["gap_closed"] > 0.8
    truth, values = told["truth"][WORDS.stem], told["parameters"]
    for name, own in (("stiffness", "stiffness"), ("angle", "angle"), ("time_constant", "time")):
        assert values[name]["value"] == pytest.approx(truth[own], rel=0.15), name
    assert f'id = "{WORDS.stem}"' in told["model"]


def test_the_report_names_it(told: dict[str, Any]) -> None:
    assert told["named_by_page"]
