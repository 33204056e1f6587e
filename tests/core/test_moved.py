"""Modules that stood directly in pamrs: their names are found there still, with a warning."""

import importlib
import subprocess
import sys

import pytest

import pamrs
from pamrs._moved import PACKAGES

NAMES = {
    "batch": ("Batch", "BatchRun", "Failure"),
    "case": ("Case", "load_case"),
    "effects_table": (
        "CATALOGUE",
        "EFFECTS",
        "EffectInfo",
        "EffectParameter",
        "find_parameter",
    ),
    "joint": ("Joint",),
    "lifting": ("Lift", "lift"),
    "muscle": ("Muscle",),
    "muscle_models": ("GEOMETRIES", "MODELS"),
    "prove": ("Proof", "cases_of", "prove"),
    "recording": ("CHANNELS", "Issue", "Recording", "load_recording"),
    "replay": ("differences", "replay"),
    "simulator": ("Simulator",),
    "sizing": ("Candidate", "Filling", "Requirement", "SizingResult", "packed_diameter", "size"),
}


def test_every_moved_module_is_tested():
    assert set(NAMES) == set(PACKAGES)


@pytest.mark.parametrize(
    ("module", "name"), [(module, name) for module, names in NAMES.items() for name in names]
)
def test_a_name_is_found_by_its_old_path_with_a_warning(module, name):
    old = importlib.import_module(f"pamrs.{module}")
    with pytest.warns(
        DeprecationWarning, match=rf"pamrs\.{module}\.{name} is {PACKAGES[module]}\.{name} now"
    ):
        found = getattr(old, name)
    assert found is getattr(importlib.import_module(PACKAGES[module]), name)


def test_the_warning_is_about_the_line_that_imports():
    code = "import warnings\nwarnings.simplefilter('always')\nfrom pamrs.replay import replay\n"
    done = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    assert (
        "<string>:3: DeprecationWarning: pamrs.replay.replay is pamrs.simulation.replay now"
        in done.stderr
    )


def test_what_was_never_there_is_not_there_now():
    with pytest.raises(AttributeError, match="no_such_name"):
        _ = importlib.import_module("pamrs.recording").no_such_name
    with pytest.raises(AttributeError, match="no_such_module"):
        _ = pamrs.no_such_module
    with pytest.raises(ImportError):
        importlib.import_module("pamrs.no_such_module")


def test_public_modules_need_no_warning():
    assert pamrs.sizing is importlib.import_module("pamrs.design.sizing")
    assert pamrs.case.__name__ == "pamrs.case"
