"""Recruitment in real time against fixed recruitment, and bundles of many small muscles.

``python -m benchmarks.recruitment docs`` runs the lifts, and writes ``recruitment.md`` and
``recruitment.png``. The payloads of a profile change while the arm hangs at its lower stop; the law
of motion knows the payload, the scheduler does not.
"""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import pamrs
from benchmarks.pages import written
from pamrs.control import ClosedLoop, Recruitment, RigController, RigModel, closed_loop
from pamrs.control.trajectories import cosine_cycles, degrees
from pamrs.rig import Rig

Array = NDArray[np.float64]

PERIOD = 0.005
CYCLE = 22.0  # 6 s up, 5 s hold, 6 s down, 5 s hold (6.4.2)
TOP = 90.0  # deg
#: Payloads [kg], one for each cycle.
PROFILES = {
    "light": (0.0, 9.0, 18.0, 9.0, 0.0),
    "approach, lift, return": (0.0, 0.0, 36.0, 0.0, 0.0, 36.0),
    "one heavy piece": (0.0, 9.0, 54.0, 9.0, 0.0, 27.0),
}
SHOWN = "one heavy piece"
#: Of the scheduler: a name, and its arguments.
SCHEDULERS = {
    "in real time, knowing how far it lifts": {"reach": math.radians(TOP)},
    "the same, with little to spare": {
        "reach": math.radians(TOP),
        "add_at": 1.0,
        "drop_at": 0.8,
        "reserve": 5e4,
    },
    "in real time, by rates alone": {},
    "by rates, dropping late": {"drop_at": 0.3},
}
NUMBERS = (6, 12, 24, 48, 96, 192)  # of muscles in a bundle
LEAST = 6  # a bundle keeps a sixth of its muscles
LOST = 5.0  # deg rms over a cycle: the arm does not follow


@dataclass(frozen=True)
class Lift:
    """What came of a profile; arrays over all its samples."""

    time: Array
    wanted: Array
    angle: Array
    torque: Array
    supply: Array
    pressures: dict[str, Array]
    active: Array
    per_cycle: list[float]

    @property
    def work(self) -> float:
        """Torque times angle where the angle rises (6.7) [J]."""
        turned = np.diff(self.angle)
        torque = 0.5 * (self.torque[1:] + self.torque[:-1])
        return float((turned * torque)[turned > 0.0].sum())

    def energy(self, volume: float) -> float:
        """What the tank has lost, ``(Pi - Pf) Vtank`` (6.8) [J]."""
        return float((self.supply[0] - self.supply[-1]) * volume)

    def rms(self) -> float:
        """Root mean square error [deg]."""
        return float(np.sqrt(np.mean(np.degrees(self.wanted - self.angle) ** 2)))

    @property
    def changes(self) -> int:
        """How often the number of active groups changed."""
        return int(np.count_nonzero(np.diff(self.active)))


def follow(
    rig: Rig,
    payloads: Sequence[float],
    *,
    fixed: int | None = None,
    scheduler: dict[str, float] | None = None,
) -> Lift:
    """Run a profile with the first groups alone, or with a scheduler.

    Parameters
    ----------
    rig : Rig
        Groups of muscles on one joint, a valve each.
    payloads : sequence of float
        One for each cycle [kg].
    fixed : int, optional
        How many groups are used.
    scheduler : dict, optional
        Arguments of :class:`pamrs.control.Recruitment`, in the place of ``fixed``.

    Returns
    -------
    Lift
    """
    chambers = list(rig.tables("chamber"))
    used = chambers if fixed is None else chambers[:fixed]
    up = cosine_cycles(*degrees(15.0, TOP), rise=6.0, hold=5.0, cycles=len(payloads))
    state, schedule = None, None
    runs: list[ClosedLoop] = []
    active: list[Array] = []
    for k, payload in enumerate(payloads):
        loaded = rig.with_parameters({"arm.payload": payload})
        model = RigModel(loaded, active=used)
        share = None
        if fixed is None:
            torques = model.torques_of(model.joints[0])
            share = _Watched(torques, model.pressure_limit, period=PERIOD, **(scheduler or {}))
        law = model.law("sliding", period=PERIOD)
        controller = RigController(model, law, shares=share)
        if share is not None and schedule is not None:
            share.restore(schedule)
        plant = pamrs.Simulator(loaded, sample_time=PERIOD)
        if state is not None:
            plant.restore(state)
        runs.append(closed_loop(plant, controller, up, CYCLE, start=k * CYCLE, reset=False))
        state, schedule = plant.state, None if share is None else share.state
        count = runs[-1].time.size - 1
        seen = [float(fixed or 0)] * count if share is None else share.seen
        active.append(np.array(seen[:count]))
    return _joined(runs, active, used)


class _Watched(Recruitment):
    """Keeps how many groups were active."""

    def reset(self) -> None:
        super().reset()
        self.seen: list[float] = []

    def pressures(self, demand):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN201, D102
        answer = super().pressures(demand)
        self.seen.append(float(self.active))
        return answer


def _joined(runs: list[ClosedLoop], active: list[Array], chambers: Sequence[str]) -> Lift:
    """The cycles of a profile one after the other; the last row of each is the next one's first."""

    def whole(name: str) -> Array:
        return np.concatenate([run.channels[name][:-1] for run in runs])

    joint = runs[0].joint
    return Lift(
        time=np.concatenate([run.time[:-1] + k * CYCLE for k, run in enumerate(runs)]),
        wanted=np.concatenate([np.asarray(run.reference.angle)[:-1] for run in runs]),
        angle=whole(joint),
        torque=whole(joint.replace("joint_angle", "joint_torque")),
        supply=whole("supply_pressure"),
        pressures={name: whole(f"muscle_pressure.{name}") for name in chambers},
        active=np.concatenate(active),
        per_cycle=[float(np.sqrt(np.mean(np.degrees(run.error) ** 2))) for run in runs],
    )


# ---------------------------------------------------------------- bundles


def bundle(muscles: int) -> Rig:
    """The shoulder with many small muscles in the place of its six, a valve and a chamber each.

    Length and braid stay; diameter and wall are scaled so that the sum of the cross-sections
    stays, and valves and dead volumes are parts of the same sum.

    Parameters
    ----------
    muscles : int

    Returns
    -------
    Rig
    """
    model = pamrs.rigs.named("recruitment").model
    thinner = math.sqrt(6.0 / muscles)
    names = [f"m{k + 1:03d}" for k in range(muscles)]
    one = {block: next(iter(model[block].values())) for block in ("valve", "chamber", "muscle")}
    one["muscle"] |= {
        "count": 1,
        "rest_diameter": one["muscle"]["rest_diameter"] * thinner,
        "wall_thickness": one["muscle"]["wall_thickness"] * thinner,
        "buckling_load": max(0.01, one["muscle"]["buckling_load"] * thinner**4),
    }
    one["valve"]["discharge_area_max"] *= 3.0 / muscles
    one["chamber"]["dead_volume"] *= 3.0 / muscles
    tables = {block: {name: dict(table) for name in names} for block, table in one.items()}
    sensors = {name: {"pressure_zero": 0.0} for name in names} | {"shoulder": {"angle_zero": 0.0}}
    ports = {f"muscle.{name}": {"joint": "joint.shoulder"} for name in names}
    return Rig(f"bundle_{muscles}", {**model, **tables, "sensors": sensors, "ports": ports})


@dataclass(frozen=True)
class Scaled:
    """What a bundle of a number of muscles did."""

    muscles: int
    made: float
    """Processor time of rig and controller [s]."""
    second: float
    """Processor time of a simulated second, the controller included [s]."""
    update: float
    """Of one update of the controller [s]."""
    efficiency: float
    rms: float
    most: int
    """The most muscles that were active."""
    changes: int


def scaled(muscles: int, payload: float = 27.0, cycles: int = 1) -> Scaled:
    """Lift a payload with a bundle, recruited in real time.

    Parameters
    ----------
    muscles : int
    payload : float
        [kg]
    cycles : int

    Returns
    -------
    Scaled
    """
    began = time.process_time()
    rig = bundle(muscles).with_parameters({"arm.payload": payload})
    model = RigModel(rig)
    torques = model.torques_of("shoulder")
    scheduler: dict[str, float] = {"reach": math.radians(TOP), "least": muscles // LEAST}
    share = Recruitment(torques, model.pressure_limit, period=PERIOD, **scheduler)
    controller = RigController(model, model.law("sliding", period=PERIOD), shares=share)
    sample = pamrs.Simulator(rig, sample_time=PERIOD).observe()
    made = time.process_time() - began
    up = cosine_cycles(*degrees(15.0, TOP), rise=6.0, hold=5.0, cycles=cycles)
    began = time.process_time()
    for k in range(200):
        controller.update(k * PERIOD, sample, up(k * PERIOD))
    update = (time.process_time() - began) / 200
    began = time.process_time()
    lift = follow(rig, [payload] * cycles, scheduler=scheduler)
    second = (time.process_time() - began - cycles * made) / (cycles * CYCLE)
    volume = rig.tables("supply")[""]["volume"]
    efficiency = lift.work / lift.energy(volume)
    most = int(lift.active.max())
    return Scaled(muscles, made, second, update, efficiency, lift.rms(), most, lift.changes)


# ---------------------------------------------------------------- page


def _rows(rig: Rig) -> tuple[dict[str, dict[str, Lift]], float]:
    """Every profile with every way of recruiting."""
    groups = len(rig.tables("chamber"))
    volume = rig.tables("supply")[""]["volume"]
    found: dict[str, dict[str, Lift]] = {}
    for name, payloads in PROFILES.items():
        here = {}
        for k in range(1, groups + 1):
            here[f"{k} pair{'s' if k > 1 else ''}, fixed"] = follow(rig, payloads, fixed=k)
        for label, arguments in SCHEDULERS.items():
            here[label] = follow(rig, payloads, scheduler=arguments)
        found[name] = here
    return found, float(volume)


def _table(lifts: dict[str, Lift], volume: float) -> list[str]:
    lines = [
        "| recruitment | work [J] | energy [J] | efficiency | rms [deg] | worst cycle [deg] | "
        "changes |",
        "|---|---|---|---|---|---|---|",
    ]
    for label, lift in lifts.items():
        worst = max(lift.per_cycle)
        lost = " (does not follow)" if worst > LOST else ""
        energy = lift.energy(volume)
        share = 100 * lift.work / energy
        lines.append(
            f"| {label} | {lift.work:.0f} | {energy:.0f} | {share:.1f} %{lost} | "
            f"{lift.rms():.2f} | {worst:.2f} | {lift.changes} |"
        )
    return lines


def page(found: dict[str, dict[str, Lift]], volume: float, sizes: Sequence[Scaled]) -> str:
    """The page, Markdown."""
    profiles: list[str] = []
    for name, lifts in found.items():
        payloads = ", ".join(f"{mass:g}" for mass in PROFILES[name])
        profiles += [f"## {name}: {payloads} kg", "", *_table(lifts, volume), ""]
    bundles = [
        "| muscles, a valve each | made [s] | a simulated second [s] | one update [ms] | "
        "efficiency | rms [deg] | most active | changes |",
        "|---|---|---|---|---|---|---|---|",
    ]
    bundles += [
        f"| {one.muscles} | {one.made:.2f} | {one.second:.3f} | {1e3 * one.update:.2f} | "
        f"{100 * one.efficiency:.1f} % | {one.rms:.2f} | {one.most} | {one.changes} |"
        for one in sizes
    ]
    return written(
        "recruitment", top=TOP, profiles="\n".join(profiles).rstrip(), bundles="\n".join(bundles)
    )


def draw(lifts: dict[str, Lift], sizes: Sequence[Scaled], path: Path) -> None:
    """The picture of one profile, and of the bundles.

    Parameters
    ----------
    lifts : dict of str to Lift
    sizes : sequence of Scaled
    path : Path
    """
    from matplotlib.figure import Figure

    lift = lifts[next(iter(SCHEDULERS))]
    figure = Figure(figsize=(10.0, 8.5), layout="constrained")
    grid = figure.add_gridspec(4, 2)
    angle, torque, air = (figure.add_subplot(grid[k, :]) for k in range(3))
    angle.plot(lift.time, np.degrees(lift.wanted), "k--", lw=1, label="wanted")
    for label, color in (("1 pair, fixed", "tab:gray"), (next(iter(SCHEDULERS)), "tab:blue")):
        angle.plot(lift.time, np.degrees(lifts[label].angle), color=color, label=label)
    angle.set_ylabel("angle [deg]")
    for k, mass in enumerate(PROFILES[SHOWN]):
        angle.annotate(f"{mass:g} kg", (k * CYCLE + 0.5 * CYCLE, 17.0), ha="center", fontsize=8)
    torque.plot(lift.time, lift.torque, color="tab:red")
    torque.set_ylabel("torque [N m]")
    count = torque.twinx()
    count.step(lift.time, lift.active, where="post", color="k", lw=1)
    count.set_ylabel("active pairs")
    count.set_yticks([1, 2, 3])
    for name, pressure in lift.pressures.items():
        air.plot(lift.time, pressure / 1e5, label=name.replace("_", " "))
    air.plot(lift.time, lift.supply / 1e5, "k:", label="tank")
    air.set(ylabel="pressure [bar]", xlabel="time [s]")
    for axes in (angle, air):
        axes.legend(fontsize=8, ncols=4, loc="upper right")
    angle.set_ylim(10.0, 115.0)
    air.set_ylim(-0.5, 18.0)
    left, right = figure.add_subplot(grid[3, 0]), figure.add_subplot(grid[3, 1])
    numbers = [one.muscles for one in sizes]
    left.semilogx(numbers, [100 * one.efficiency for one in sizes], "o-")
    left.set(xlabel="muscles in the bundle", ylabel="efficiency [%]")
    right.loglog(numbers, [one.second for one in sizes], "o-", label="a simulated second")
    right.loglog(numbers, [one.update for one in sizes], "s-", label="one update")
    right.set(xlabel="muscles in the bundle", ylabel="processor time [s]")
    right.legend(fontsize=8)
    figure.savefig(path, dpi=110)


def main(arguments: Sequence[str] | None = None) -> None:
    """Write page and picture.

    Parameters
    ----------
    arguments : sequence of str, optional
        Of the command line.
    """
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, help="where recruitment.md and .png are written")
    folder = parser.parse_args(arguments).folder
    found, volume = _rows(pamrs.rigs.named("recruitment"))
    sizes = [scaled(number) for number in NUMBERS]
    (folder / "recruitment.md").write_text(page(found, volume, sizes), encoding="utf-8")
    draw(found[SHOWN], sizes, folder / "recruitment.png")


if __name__ == "__main__":
    main()
