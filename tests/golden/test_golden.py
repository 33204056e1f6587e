"""pamrs against golden vectors: the project's own and, when present, the shared set beside the
project.
"""

from __future__ import annotations

import csv
import math
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import pamrs
from tests.golden.generate import (
    AMBIENT,
    INCH,
    MODULUS_OFFSET,
    MODULUS_SLOPE,
    MUSCLES,
    NETWORKS,
    SAMPLE_TIME,
)
from tests.runs import RUNS, Run, misses

HERE = Path(__file__).resolve().parent
OWN = HERE / "data"
SHARED = HERE.parents[1] / ".." / "shared" / "golden"
#: Those of the project's vectors, and two that only the shared set has.
SIZES = MUSCLES | {
    "elbow_0625in": (7.785 * INCH, 0.625 * INCH, 72.5, INCH / 16.0, "elliptic"),
    "ch2_075in": (7.3 * INCH, 0.75 * INCH, 76.5, 0.125 * INCH, "elliptic"),
}


def make_muscle(name: str) -> pamrs.Muscle:
    """Muscle of one golden set."""
    length, diameter, angle, wall, kind = SIZES[name]
    return pamrs.Muscle(
        rest_length=length,
        rest_diameter=diameter,
        braid_angle=math.radians(angle),
        wall_thickness=wall,
        geometry=kind,
        modulus_slope=MODULUS_SLOPE,
        modulus_offset=MODULUS_OFFSET,
    )


def golden_path(folder: Path, name: str) -> Path:
    """Path of one golden file; skips the test when the shared set is not beside the project."""
    path = folder / name
    if folder == SHARED and not path.is_file():
        pytest.skip("the shared golden set (../shared/golden) is not beside this project")
    return path


def read_muscles(path: Path) -> dict[str, dict[str, NDArray[np.float64]]]:
    """Columns of a ``muscle_static.csv`` by muscle."""
    with path.open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    names = list(dict.fromkeys(row["muscle"] for row in rows))
    columns = [key for key in rows[0] if key != "muscle"]
    return {
        name: {
            c: np.array([float(row[c]) for row in rows if row["muscle"] == name]) for c in columns
        }
        for name in names
    }


@pytest.mark.parametrize("folder", [OWN, SHARED], ids=["own", "shared"])
def test_muscle_static(folder: Path) -> None:
    sets = read_muscles(golden_path(folder, "muscle_static.csv"))
    assert len(sets) == 3
    for name, want in sets.items():
        muscle, e = make_muscle(name), want["contraction_ratio"]
        got = {
            "radius_m": muscle.radius(e),
            "thickness_m": muscle.thickness(e),
            "air_volume_m3": muscle.air_volume(e),
            "force_1bar_N": muscle.force(1e5, e),
            "force_4bar_N": muscle.force(4e5, e),
            "force_8bar_N": muscle.force(8e5, e),
        }
        for column, values in got.items():
            # A force is a difference of larger terms: near zero it is held to the blocked force.
            floor = 1e-9 * np.abs(want[column][e == 0.0][0]) if column.startswith("force") else 0.0
            np.testing.assert_allclose(
                values, want[column], rtol=1e-9, atol=floor, err_msg=f"{name} {column}"
            )


def trajectory_misses(path: Path) -> dict[str, float]:
    """Largest error of every channel as a fraction of its range, simulated at a step of 0.1 ms."""
    time, command, *columns = np.genfromtxt(path, delimiter=",", skip_header=1).T
    offsets = {"muscle_pressure": AMBIENT, "supply_pressure": AMBIENT}
    names = ("muscle_pressure", "supply_pressure", "joint_angle", "joint_rate")
    assert len(columns) >= len(names)
    want = {n: own - offsets.get(n, 0.0) for n, own in zip(names, columns, strict=False)}
    initial = {name: values[0] for name, values in want.items()}
    run = Run("shoulder", SAMPLE_TIME, time.size, initial, {"valve_command": command})
    got = run.with_struts.core(1e-4)  # the vectors are of muscles that push as their model says
    np.testing.assert_allclose(got.time, time, rtol=0.0, atol=1e-12)
    return misses(got, want)


@pytest.mark.parametrize(
    ("folder", "name", "tolerance"),
    [
        (OWN, "shoulder_smooth.csv", 1e-6),
        (SHARED, "shoulder_lift.csv", 1e-6),
        (SHARED, "shoulder_multisine.csv", 1e-6),
        (SHARED, "shoulder_choked_steps.csv", 1e-3),
    ],
    ids=["own-smooth", "shared-lift", "shared-multisine", "shared-choked_steps"],
)
def test_shoulder_trajectory(folder: Path, name: str, tolerance: float) -> None:
    found = trajectory_misses(golden_path(folder, name))
    assert max(found.values()) <= tolerance, found


@pytest.mark.parametrize("name", NETWORKS)
def test_networks(name: str) -> None:
    """Rigs of several blocks at a step of 0.1 ms: every channel of the reference, sums of mass and
    energy included.
    """
    path = OWN / f"network_{name}.csv"
    header = path.read_text(encoding="utf-8").partition("\n")[0].split(",")
    data = dict(zip(header, np.genfromtxt(path, delimiter=",", skip_header=1).T, strict=True))
    run = RUNS[name].with_struts
    for command, values in run.commands.items():
        np.testing.assert_allclose(values, data.pop(command), rtol=1e-11, atol=1e-12)
    np.testing.assert_allclose(run.time, data.pop("time"), atol=1e-12)
    found = misses(run.core(1e-4), data)
    assert max(found.values()) <= 1e-6, found
