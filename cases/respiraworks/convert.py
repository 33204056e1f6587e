"""Recordings of a ventilator and its test lung as cases; see the README beside.

    python cases/respiraworks/convert.py Ventilator out/respiraworks
    pamrs diagnose out/respiraworks/wrong_resistor

`Ventilator` is the git directory of the authors' repository or a checkout of it. The data stay
there; each case gets a table, the rig file and a ``case.toml``.
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

HERE = Path(__file__).parent
COMMIT = "30546e42272639a5c6d21c0ee7015ddb1e0c5f3a"
"""A state with all of the recordings; later ones have them no more."""
DATA = "software/sample-data"
RECORD = "2020-06-21-RunForRecord1-AIR-and-OXY/20200621-RunForRecord1-OXY"
NEW = "2020-07-03-NewPinchValveBaseline-AIR/covent_pc_4.dat"
OLD = "2020-07-03-LifeLeader-594hrs-Performance-AIR/covent_pc_4.dat"
PORT, CHOKE, CORRECTION, DENSITY = 15.05e-3, 5.5e-3, 0.97, 1.225
"""The venturis of the flow meters by the authors' ``sensors.cpp``: [m], [m], factor, [kg/m3]."""
CMH2O = 98.0665
Array = NDArray[np.float64]


@dataclass(frozen=True)
class Source:
    """One recording and how it is told: file, rig, compliance [ml/cmH2O], unit of its pressure,
    volume ("volume", a column with a flow, "meters" for both venturis, "level" for these with the
    volume of each breath beginning at nothing), and whether a half is held out.
    """

    file: str
    rig: str = "c20_r20"
    compliance: float = 20.0
    unit: str = "cmH2O"
    volume: str = "volume"
    halves: bool = True


CASES = {
    "wrong_resistor": Source(
        f"{RECORD}-Wrong-Lung-Setting-Test4/z_covent_pc_4 (first run wrong lung setting).dat"
    ),
    "missing_setting": Source(f"{RECORD}-RedoComplete/covent_pc_8.dat", "c10_r10", 10.0),
    "unit_new": Source(NEW, volume="level"),
    "unit_old": Source(OLD, volume="level"),
    "hose_off": Source(
        "2020-06-18-disconnected.dat", "c10_r20", 10.0, volume="flow_uncorrected", halves=False
    ),
    "obstruction": Source(
        "2020-06-18-obstruction.dat", "c10_r20", 10.0, volume="net_flow", halves=False
    ),
    "flow_drift": Source(NEW, unit="kPa", volume="meters"),
    "control_redo": Source(
        f"{RECORD}-Wrong-Lung-Setting-Test4/covent_pc_4 (redo with correct lung settings).dat"
    ),
    "control_record_1": Source(f"{RECORD}-RedoComplete/covent_pc_4.dat"),
    "control_record_2": Source(
        "2020-06-21-RunForRecord2-AIR-and-OXY/20200621-RunForRecord2-OXY/covent_pc_4.dat"
    ),
    "control_other_valve": Source("2020-07-31-UFlow-Performance/covent_pc_4.dat"),
}
"""The cases by name; what is known of each is in the README."""


def committed(repository: Path, file: str) -> str:
    """The text of a file of the authors' repository; ValueError where git does not have it."""
    words = ["git", "-C", str(repository), "show", f"{COMMIT}:{DATA}/{file}"]
    told = subprocess.run(words, capture_output=True, text=True, encoding="utf-8", check=False)
    if told.returncode:
        raise ValueError(f"{repository}: {told.stderr.strip()}; the README says how to bring it")
    return told.stdout


def columns(text: str) -> dict[str, Array]:
    """Each column of a recording of the authors by its name; the time is called ``time(sec)``."""
    rows = [line.split() for line in text.splitlines() if line and not line.startswith("#")]
    return dict(zip(rows[0], np.array(rows[1:], dtype=np.float64).T, strict=True))


def metered(drop: Array) -> Array:
    """Flow [ml/s] of a venturi by its pressure drop [cmH2O], as in the authors' firmware."""
    port, choke = (0.25 * np.pi * d**2 for d in (PORT, CHOKE))
    area = CORRECTION * port * choke / np.sqrt(port**2 - choke**2)
    flow: Array = 1e6 * area * np.sign(drop) * np.sqrt(2.0 * CMH2O * np.abs(drop) / DENSITY)
    return flow


def lung_pressure(found: dict[str, Array], source: Source) -> Array:
    """Pressure of the lung [cmH2O]: the set one where the first breath begins, and the volume since
    then over the compliance that the lung is set to.
    """
    time, wanted = found["time(sec)"], found["pc_setpoint"]
    begins = np.flatnonzero((np.diff(wanted) > 0.0) & (wanted[:-1] == wanted.min()))
    if source.volume == "volume":
        volume = found["volume"]
    else:
        if source.volume in found:
            flow = found[source.volume]
        else:
            flow = metered(found["dp_inhale"]) - metered(found["dp_exhale"])
        if source.volume == "flow_uncorrected":  # by what the firmware corrected before anything
            flow = flow - (flow - found["net_flow"])[0]
        volume = np.concatenate([[0.0], np.cumsum(flow[:-1] * np.diff(time))])
    if source.volume == "level":
        volume = volume - np.interp(time, time[begins], volume[begins])
    first = begins[0]
    pressure: Array = wanted[first] + (volume - volume[first]) / source.compliance
    return pressure


def write(folder: Path, name: str, text: str) -> None:
    """Write the case of a name from the text of its recording.

    Parameters
    ----------
    folder : Path
        Gets the table, the rig file and ``case.toml``.
    name : str
        A key of `CASES`.
    text : str
        The recording as its authors wrote it.
    """
    source, found = CASES[name], columns(text)
    time = found["time(sec)"]
    airway, unit = found["pressure"], source.unit
    table = {  # the supply is no question: its command is what it reads one sample later
        "time [s]": time,
        f"supply_command [{unit}]": np.append(airway[1:], airway[-1]),
        f"supply_pressure [{unit}]": airway,
        "muscle_pressure [cmH2O]": lung_pressure(found, source),
    }
    folder.mkdir(parents=True, exist_ok=True)
    np.savetxt(
        folder / "log.csv", np.column_stack(list(table.values())), fmt="%.6g", delimiter=",",
        header=",".join(table), comments="",
    )  # fmt: skip
    shutil.copy(HERE / f"{source.rig}.toml", folder / "rig.toml")
    middle = 0.5 * (time[0] + time[-1])
    parts = ['name = "whole"\nrole = "fit"']
    if source.halves:
        parts = [
            f'name = "first half"\nrole = "fit"\nstop = {middle:.2f}',
            f'name = "second half"\nrole = "held_out"\nstart = {middle:.2f}',
        ]
    entries = [f'[[recording]]\nfile = "log.csv"\n{part}\n' for part in parts]
    head = f'schema = "pamrs.case/1"\nname = "{name}"\ndescription = "{source.file}"\n\n'
    (folder / "case.toml").write_text(head + "\n".join(entries), encoding="utf-8")


def convert(repository: Path, folder: Path) -> list[str]:
    """Write all cases into folders of their names; ValueError where git lacks a recording."""
    for name, source in CASES.items():
        write(folder / name, name, committed(repository, source.file))
    return list(CASES)


def main() -> None:
    """Read the arguments and write the cases."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0] if __doc__ else None)
    parser.add_argument("repository", type=Path, help="git directory or checkout")
    parser.add_argument("folder", type=Path, help="gets a folder for each case")
    args = parser.parse_args()
    try:
        names = convert(args.repository, args.folder)
    except ValueError as error:
        parser.exit(2, f"error: {error}\n")
    print(f"{len(names)} cases in {args.folder}; next: pamrs diagnose {args.folder}/{names[0]}")


if __name__ == "__main__":
    main()
