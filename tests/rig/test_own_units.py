"""What is said of a rig is said in the units of its file."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from pamrs import cli, rigs
from pamrs.diagnosis import DiagnosisSettings
from pamrs.diagnosis.next_experiment._plan import Plan
from pamrs.errors import ParameterError
from pamrs.experiments import library
from pamrs.findings import Limit
from pamrs.rig import Units, parse_rig
from pamrs.simulation import core_rig
from tests.rig.cases import refused

#: A bench of somebody who writes pounds and inches.
POUNDS = """schema = "pamrs.rig/1"
name = "pounds"
[gas]
temperature = { value = 70, unit = "degF" }
[supply]
volume = { value = 4, unit = "gal", tol = 0.1 }
initial_pressure = { value = 120, unit = "psi", tol = 1 }
[valve]
discharge_area_max = { value = 0.013, unit = "in2" }
null_voltage = { value = 5, unit = "V" }
half_range = { value = 5, unit = "V" }
area_fraction = { opening = [0, 1], fraction = [0, 1] }
[chamber]
dead_volume = { value = 9, unit = "in3", tol = 1 }
[muscle]
model = "chou_hannaford"
rest_length = { value = 10.875, unit = "in" }
rest_diameter = { value = 1, unit = "in" }
braid_angle = { value = 73.5, unit = "deg" }
wall_thickness = { value = 0.125, unit = "in" }
[load]
kind = "mass"
mass = { value = 44, unit = "lb" }
min_length = { value = 7, unit = "in" }
max_length = { value = 11, unit = "in" }
"""
BLOCK = {"name": "chamber", "drives": [], "channel": "", "covers": "chamber", "why": ""}
METRIC = re.compile(r"\d (?:bar|mbar|kPa|Pa|m|mm|cm|kg|K)\b(?!/)")


def checked(text: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> list[str]:
    """Lines of ``pamrs rig check``."""
    file = tmp_path / "rig.toml"
    file.write_text(text, encoding="utf-8")
    assert cli.main(["rig", "check", str(file)]) == 0
    return capsys.readouterr().out.splitlines()


def written(table: dict[str, Any], path: str = "") -> Iterator[tuple[str, dict[str, Any]]]:
    """Values with a unit in a file, by their dotted names."""
    for name, inner in table.items():
        if isinstance(inner, dict) and {"value", "unit"} <= {*inner}:
            yield f"{path}{name}", inner
        elif isinstance(inner, dict) and name != "limits":
            yield from written(inner, f"{path}{name}.")


@pytest.mark.parametrize("name", rigs.names())
def test_a_check_tells_each_value_as_the_file_has_it(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = rigs.template(name)
    shown = dict(line.split(maxsplit=1) for line in checked(text, tmp_path, capsys)[:-1])
    found = 0
    for key, own in written(tomllib.loads(text)):
        if isinstance(own["value"], list):
            continue
        key = key.replace("friction.", "friction_")
        tol = f" ± {own['tol']:.3g}" if own.get("tol") else ""
        unit = "" if own["unit"] == "1" else f" {own['unit']}"
        assert shown[key] == f"{own['value']:.6g}{tol}{unit}"
        found += 1
    assert found > 3


def test_warnings_refusals_and_plans_are_in_pounds_and_inches(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    lines = checked(POUNDS, tmp_path, capsys)
    own = [line for line in lines if line.partition(" ")[0].partition(".")[0] in POUNDS]
    assert "muscle.friction_presliding" in "".join(own)  # left out of the file
    warnings = [line for line in lines if line.startswith("warning: ")]
    assert any("the 120 psi of the supply" in line for line in warnings)
    assert any("valve.discharge_area_max (tol = 0.00065 in2)" in line for line in warnings)
    assert any("load.mass (tol = 0.44 lb)" in line for line in warnings)
    left_out = ("gas.ambient_pressure", "arm.", "gas.gas_constant")
    told = [line for line in lines if not line.startswith(left_out)]
    assert not [line for line in told if METRIC.search(line)]
    for wrong, said in (
        (("value = 120", "value = 120000"), r"= 120000 psi is not .* to 14503\.8 psi$"),
        (("value = 0.125", "value = 0.6"), r"thickness = 0\.6 in is .*diameter = 1 in is needed$"),
        (("value = 7", "value = 12"), r"length = 11 in is .*length = 12 in is needed$"),
    ):
        assert re.search(said, refused(POUNDS.replace(*wrong)))
    rig = parse_rig(POUNDS)
    texts = [one.text for one in library(rig, DiagnosisSettings())]
    assert len(texts) > 5
    assert all(" psi" in text for text in texts)
    assert not [text for text in texts if METRIC.search(text)]


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("value = 0.276, ", "value = 0.05, ", "max_angle = 120 deg is not allowed: an angle that"),
        (
            '{ value = 0.003175, unit = "m" }',
            '{ value = 12.5, unit = "mm" }',
            r"thickness = 12\.5 mm is .* to 11\.43 mm \(0\.45 rest diam",
        ),
    ],
)
def test_a_refusal_of_the_core_is_in_the_unit_of_the_file(old: str, new: str, said: str) -> None:
    text = rigs.template()
    assert old in text
    with pytest.raises(ParameterError, match=said):
        core_rig(parse_rig(text.replace(old, new)))


def test_a_plan_gives_sizes_in_the_units_of_the_file() -> None:
    limits = [
        Limit(name, block="chamber", size=f"{name}.{size}", typical=typical, seen_from=typical)
        for name, size, typical in (
            ("activation_pressure", "threshold", 1e4),
            ("payload_change", "mass_change", 2.0),
            ("leak_muscle", "conductance", 1e-11),
        )
    ]
    units = Units({"a": "psi", "b": "lb", "c": "l/(s bar)"})
    plan = Plan("rig", (), {}, [BLOCK], [], [], limits, [], [], units=units)
    table = plan.text()
    for size in (r"1\.5 psi +1\.5 psi", r"4\.4 lb +4\.4 lb", r"0\.001 l/\(s bar\) +0\.001"):
        assert re.search(size, table)


def test_the_usual_unit_is_the_one_most_often_written() -> None:
    units = Units({"a": "psi", "b": "kPa", "c": "psi", "d": "Pa", "e": "%", "f": "ms"})
    assert [units.usual(si) for si in ("Pa", "m", "1", "s", "N m/rad")] == [
        *("psi", "mm", "1", "ms", "N m/rad"),
    ]
    assert units.said("b", "Pa", 2e5, 1e3) == "200 ± 1 kPa"
    assert units.said("x", "Pa", 0.0) == "0 psi"
