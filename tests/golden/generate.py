"""Write the project's golden vectors from the independent reference model.

Run ``python tests/golden/generate.py``; the files in ``tests/golden/data`` are replaced.
"""

from __future__ import annotations

import csv
import math
import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from tests.reference import GeometryReference, MuscleReference  # noqa: E402

DATA = Path(__file__).resolve().parent / "data"
INCH = 0.0254
AMBIENT = 101325.0
MODULUS_SLOPE = [3.0, -0.35, 0.0, 0.0]
MODULUS_OFFSET = [1.15e6, -0.15e6, 0.0, 0.0]
PRESSURES = {"force_1bar_N": 1e5, "force_4bar_N": 4e5, "force_8bar_N": 8e5}
CONTRACTIONS = [-0.02, -0.01, -0.005, 0.0, 0.001, 0.01, 0.03, 0.07, 0.12, 0.18, 0.24, 0.3, 0.36]
SAMPLE_TIME = 0.005
INITIAL = {
    "muscle_pressure": 2.6e5,
    "supply_pressure": 13.8e5,
    "joint_angle": math.radians(40.0),
    "joint_rate": 0.0,
}

#: name -> rest length, rest diameter, braid angle (deg), wall thickness, geometry
MUSCLES: dict[str, tuple[float, float, float, float, str]] = {
    "shoulder_1in": (0.276, 0.0254, 73.5, 0.003175, "elliptic"),
    "large_2in": (13.0 * INCH, 2.0 * INCH, 78.0, 0.125 * INCH, "elliptic"),
    "cylinder_1in": (0.276, 0.0254, 73.5, 0.003175, "cylinder"),
}


def smooth_command(seconds: float = 3.0) -> NDArray[np.float64]:
    """Multisine about 5 V, held for 10 ms, one value per 5 ms row."""
    rows = round(seconds / SAMPLE_TIME) + 1
    held = SAMPLE_TIME * 2.0 * (np.arange(rows) // 2)
    lines = ((0.42, 0.4, 0.3), (0.35, 0.9, 1.7), (0.28, 1.7, 4.1), (0.15, 3.1, 2.2))
    command = np.full(rows, 5.0)
    for a, f, p in lines:
        command += a * np.sin(2.0 * np.pi * f * held + p)
    return command


def muscle_rows() -> list[list[str]]:
    """Rows of ``muscle_static.csv`` without the header."""
    rows = []
    for name, (length, diameter, angle, wall, kind) in MUSCLES.items():
        geometry = GeometryReference(length, diameter, math.radians(angle), wall, kind)
        muscle = MuscleReference(geometry, MODULUS_SLOPE, MODULUS_OFFSET)
        for e in CONTRACTIONS:
            if e <= geometry.min_contraction or (kind == "cylinder" and e < -0.006):
                continue
            shape = geometry.solve(e)
            values = [shape.radius, shape.thickness, shape.air_volume, muscle.strains(shape)[1]]
            values += [float(muscle.force(p, e)) for p in PRESSURES.values()]
            rows.append([name, repr(e), *(f"{v:.12e}" for v in values)])
    return rows


def write(name: str, columns: dict[str, NDArray[np.float64]]) -> None:
    """Write one trajectory."""
    np.savetxt(
        DATA / name,
        np.column_stack(list(columns.values())),
        fmt="%.12e",
        delimiter=",",
        header=",".join(columns),
        comments="",
    )


def muscles() -> None:
    """Write ``muscle_static.csv``."""
    DATA.mkdir(exist_ok=True)
    with (DATA / "muscle_static.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        names = [
            "muscle",
            "contraction_ratio",
            "radius_m",
            "thickness_m",
            "air_volume_m3",
            "eps_c",
            *PRESSURES,
        ]
        writer.writerow(names)
        writer.writerows(muscle_rows())


def smooth_shoulder() -> None:
    """Write ``shoulder_smooth.csv``: the shoulder under the smooth command."""
    from tests.runs import Run

    command = smooth_command()
    commands = {"valve_command": command}
    run = Run("shoulder", SAMPLE_TIME, command.size, INITIAL, commands).with_struts
    found = run.reference()
    columns = {
        "time_s": run.time,
        "valve_command_V": command,
        "muscle_pressure_abs_Pa": found["muscle_pressure"] + AMBIENT,
        "supply_pressure_abs_Pa": found["supply_pressure"] + AMBIENT,
        "joint_angle_rad": found["joint_angle"],
        "joint_rate_rad_s": found["joint_rate"],
    }
    write("shoulder_smooth.csv", columns)


#: Rigs of several blocks that have golden trajectories.
NETWORKS = ("antagonistic_joint", "two_joint_arm", "tube", "hanging_mass")


def networks() -> None:
    """Write ``network_NAME.csv`` of each rig: the smooth run of ``tests/runs.py`` by the
    reference, whose muscles push as their force model says.
    """
    from tests.runs import RUNS

    for name in NETWORKS:
        run = RUNS[name].with_struts
        write(f"network_{name}.csv", {"time": run.time, **run.commands, **run.reference()})


if __name__ == "__main__":
    muscles()
    smooth_shoulder()
    networks()
