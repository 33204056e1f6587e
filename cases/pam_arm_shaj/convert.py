"""Recordings of a real four-joint arm as a case of one antagonistic joint; see the README beside.

    python cases/pam_arm_shaj/convert.py out/pam_arm_shaj [--unit-bar 3] [--rate 100]
    pamrs diagnose out/pam_arm_shaj

The data stay where they are; the folder gets a table for each episode, the rig file and a
``case.toml``. The unit of the pressures and the sample rate are not documented: both are arguments,
and what the diagnosis says under others is part of the answer.
"""

from __future__ import annotations

import argparse
import json
import shutil
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

HERE = Path(__file__).parent
DATA = HERE.parents[1] / "../shared/recordings/pam_arm_shaj/data/PAMData/Data2"
JOINT, PLUS, MINUS = 0, 0, 1
"""Joint and the muscles that turn it up and down (by regression, SOURCE.md): columns of ``ob`` from
0 and from 8."""
RESET = 5
"""Rows left out at both ends of an episode: artefacts of the reset."""
EPISODES, HELD_OUT = 12, 4
HEADING = "time [s],muscle_pressure.plus [bar],muscle_pressure.minus [bar],joint_angle.base [rad]"


def episode(path: Path) -> NDArray[np.float64]:
    """Angle [rad] and the two scaled pressures of one episode, (n, 3)."""
    rows = np.asarray(json.loads(path.read_text(encoding="utf-8"))["ob"], dtype=np.float64)
    return rows[RESET:-RESET, [JOINT, 8 + PLUS, 8 + MINUS]]


def convert(folder: Path, *, unit_bar: float, rate: float, data: Path = DATA) -> list[str]:
    """Write the episodes in which the joint moves most as a case.

    Parameters
    ----------
    folder : Path
        Where to.
    unit_bar : float
        Gauge pressure of the scaled value 1 [bar].
    rate : float
        Samples per second.
    data : Path
        Where from.

    Returns
    -------
    list of str
        Names of the episodes, the held-out ones last.
    """
    found = {path.name: episode(path) for path in sorted(data.iterdir()) if path.is_file()}
    most = {name: np.std(rows[:, 0]) * len(rows) for name, rows in found.items()}
    chosen = sorted(found, key=lambda name: -float(most[name]))[:EPISODES]
    folder.mkdir(parents=True, exist_ok=True)
    held = set(chosen[2 :: EPISODES // HELD_OUT])
    entries = []
    for name in sorted(chosen, key=lambda name: (name in held, name)):
        angle, plus, minus = found[name].T
        time = np.arange(len(angle)) / rate
        table = np.column_stack([time, unit_bar * plus, unit_bar * minus, angle])
        file = folder / f"{name}.csv"
        np.savetxt(file, table, delimiter=",", header=HEADING, comments="", fmt="%.9g")
        entries.append(
            f'[[recording]]\nfile = "{name}.csv"\n'
            f'role = "{"held_out" if name in held else "fit"}"\n'
        )
    shutil.copy(HERE / "rig.toml", folder / "rig.toml")
    head = (
        'schema = "pamrs.case/1"\nname = "pam_arm_joint_0"\n'
        f'description = "assumed: 1 = {unit_bar:g} bar, {rate:g} Hz"\n\n'
    )
    (folder / "case.toml").write_text(head + "\n".join(entries), encoding="utf-8")
    return [path.stem for path in sorted(folder.glob("*.csv"))]


def main() -> None:
    """Read the arguments and write the case."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0] if __doc__ else None)
    parser.add_argument("folder", type=Path)
    parser.add_argument(
        "--unit-bar", type=float, default=3.0, help="gauge pressure of the scaled value 1 [bar]"
    )
    parser.add_argument("--rate", type=float, default=100.0, help="samples per second")
    parser.add_argument("--data", type=Path, default=DATA)
    args = parser.parse_args()
    if not args.data.is_dir():
        where = args.data.resolve()
        print(f"the recordings are not there: {where}; the README says where they come from")
        return
    names = convert(args.folder, unit_bar=args.unit_bar, rate=args.rate, data=args.data)
    print(f"{len(names)} episodes written to {args.folder}; next: pamrs diagnose {args.folder}")


if __name__ == "__main__":
    main()
