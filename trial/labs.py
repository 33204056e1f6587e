"""Recordings as labs make them: rates, converters, dropouts and channels that nobody logged."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from .pair.places import SIDES
from .recording import Noise, Record
from .rig_kinds import PAIR, RigKind

RATES = (50, 100, 200, 500, 1000)
BITS = (10, 12, 14, 16)
MISSING = ("supply_pressure", "command")


@dataclass(frozen=True)
class Lab:
    """How a lab records: samples per second, bits of its converters, whether it drops samples,
    which channel it does not log ("" for none), and whether there is one free log only.
    """

    rate: int
    bits: int
    dropouts: bool = False
    missing: str = ""
    one: bool = False

    @property
    def sample_time(self) -> float:
        """Sample time [s]."""
        return 1.0 / self.rate

    @property
    def held(self) -> int:
        """Samples for which a command is held: no controller is quicker than 200 Hz."""
        return max(1, round(0.005 * self.rate))

    def duration(self, rng: np.random.Generator) -> float:
        """Length of a recording [s]; quick labs keep their files small."""
        if self.one:
            return 60.0
        return (
            float(rng.integers(24, 37)) if self.rate <= 200 else 12.0 if self.rate == 500 else 8.0
        )


def noise_of(lab: Lab, rig: RigKind, rng: np.random.Generator) -> Noise:
    """Noise and steps of the transducers: a potentiometer up to 12 bits, an encoder above."""
    step = rig.scale / 2.0**lab.bits
    turn = math.radians(120.0 if lab.bits <= 12 else 360.0) / 2.0**lab.bits
    base = math.radians(float(rng.uniform(0.008, 0.02)))
    if rig.name == "hanging_mass":
        turn, base = 0.1 / 2.0**lab.bits, float(rng.uniform(1.5e-5, 4.0e-5))
    loud = float(rng.uniform(0.3, 0.6))
    return Noise(
        pressure=max(float(rng.uniform(250.0, 600.0)), loud * step),
        pressure_step=step,
        angle=max(base, loud * turn),
        angle_step=turn,
    )


@dataclass(frozen=True)
class Hole:
    """Samples that a lab lost: first and one past the last, and the channel, "" for whole rows."""

    first: int
    stop: int
    channel: str


def holes(lab: Lab, count: int, channels: list[str], rng: np.random.Generator) -> list[Hole]:
    """Stretches that get lost: two to five, of 5 ms to half a second, in a channel or in all."""
    found: list[Hole] = []
    if not lab.dropouts:
        return found
    for _ in range(int(rng.integers(2, 6))):
        long = max(
            1, round(math.exp(float(rng.uniform(math.log(0.005), math.log(0.5)))) * lab.rate)
        )
        first = int(rng.integers(count // 20, 9 * count // 10))
        found.append(Hole(first, first + long, str(rng.choice(["", *channels]))))
    return found


Columns = dict[str, tuple[str, Any]]


def table(
    record: Record, rig: RigKind, lab: Lab, lost: list[Hole], rest_length: float
) -> tuple[str, list[str]]:
    """A recording as CSV, and its channels."""
    if rig.name == PAIR:
        return _csv(_pair_columns(record), record, lab, lost)
    p, ps, angle = (record.logged[:, i] for i in range(3))
    columns: Columns = {}
    if rig.name == "regulated_joint":
        columns["supply_command"] = ("supply_command [bar]", record.command)
    elif rig.name != "blow_down":
        columns["valve_command"] = ("valve_command [V]", record.command)
    if rig.name != "blow_down":
        columns["supply_pressure"] = ("supply_pressure [bar]", ps / 1e5)
    columns["muscle_pressure"] = ("muscle_pressure [bar]", p / 1e5)
    if rig.name == "hanging_mass":
        columns["length"] = ("length [mm]", 1e3 * (rest_length - angle))
    elif "muscle" in rig.blocks:
        columns["joint_angle"] = ("joint_angle [deg]", np.degrees(angle))
    return _csv(columns, record, lab, lost)


def _pair_columns(record: Record) -> Columns:
    """Columns of a pair: what a side has carries its name."""
    found: Columns = {}
    for j, side in enumerate(SIDES):
        name = f"valve_command.{side}"
        found[name] = (f"{name} [V]", record.command[:, j])
    found["supply_pressure"] = ("supply_pressure [bar]", record.logged[:, 2] / 1e5)
    for j, side in enumerate(SIDES):
        name = f"muscle_pressure.{side}"
        found[name] = (f"{name} [bar]", record.logged[:, j] / 1e5)
    found["joint_angle.elbow"] = ("joint_angle.elbow [deg]", np.degrees(record.logged[:, 3]))
    return found


def _csv(columns: Columns, record: Record, lab: Lab, lost: list[Hole]) -> tuple[str, list[str]]:
    """Columns as CSV without the channel that nobody logged and what was lost, and their names."""
    for name in [n for n in columns if n.split(".")[0].endswith(lab.missing or "-")]:
        del columns[name]
    cells = [[f"{v:.5f}" for v in values.tolist()] for _, values in columns.values()]
    names, rows = list(columns), set(range(len(record.time)))
    for hole in lost:
        if not hole.channel:
            rows -= set(range(hole.first, hole.stop))
        elif hole.channel in names:
            for i in range(hole.first, min(hole.stop, len(record.time))):
                cells[names.index(hole.channel)][i] = "nan"
    lines = [",".join(["time [s]", *(head for head, _ in columns.values())])]
    times = record.time.tolist()
    lines += [",".join([f"{times[i]:.4f}", *(c[i] for c in cells)]) for i in sorted(rows)]
    return "\n".join(lines) + "\n", names
