"""Laws that every rig keeps, on random small ones: mass, energy, power, one result by every way of
running, events.
"""

from __future__ import annotations

import pickle
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

import pamrs
from pamrs.simulation import core_rig
from tests.property.networks import Blocks, networks, rig_of
from tests.reference.planar import Link, PlanarArm
from tests.runs import Run

Array = NDArray[np.float64]

RT = 287.05 * 293.15
GRAVITY = 9.80665
SOME = settings(max_examples=25, deadline=None, suppress_health_check=list(HealthCheck))


def finer(run: Run, parts: int) -> Run:
    """The same commands, held over the same times, with more rows."""
    held = {
        name: np.append(np.repeat(values[:-1], parts), values[-1])
        for name, values in run.commands.items()
    }
    return replace(
        run, sample_time=run.sample_time / parts, rows=parts * (run.rows - 1) + 1, commands=held
    )


def touches(run: pamrs.Simulation) -> bool:
    """Whether anything met a stop."""
    return any("stop" in event.kind for event in run.events)


# ------------------------------------------------------------------ mass


@SOME
@given(networks(rows=41))
def test_mass_in_is_mass_stored_and_vented(drawn: tuple[Blocks, Run]) -> None:
    blocks, run = drawn
    got = run.core()
    books, words = got.balance, ("air_mass", "line_mass")
    held = sum(float(mass[0]) for word in words for mass in got.under(word).values())
    assert abs(books.residual) <= 1e-9 * (abs(books.supplied) + abs(books.vented) + held)
    source = blocks["supply"]
    if source["kind"] == "tank":
        lost = -np.diff(got["supply_pressure"]) * source["volume"] / RT
        rounding = 1e-15 * (source["initial_pressure"] + 101325.0) * source["volume"] / RT
        np.testing.assert_allclose(
            np.diff(got["mass_supplied"]), lost, rtol=1e-9, atol=100.0 * rounding
        )
        assert books.energy == pytest.approx(RT * books.supplied, rel=1e-12, abs=1e-15)


# ------------------------------------------------------------------ power


@SOME
@given(networks(rows=11))
def test_muscles_and_joints_have_the_same_power(drawn: tuple[Blocks, Run]) -> None:
    """At every row tau = sum of F dd/dtheta; and the book of the muscles' work is the integral of
    all tau dtheta/dt.
    """
    blocks, run = drawn
    run = finer(run, 50)
    got = run.core()
    power = np.zeros(run.rows)
    if "load" in blocks:
        power -= got["muscle_force.lift"] * got["length_rate"]
    for label in blocks:
        kind, _, name = label.partition(".")
        if kind != "joint":
            continue
        angle, torque = got[f"joint_angle.{name}"], np.zeros(run.rows)
        for muscle, table in run.plant.ports("muscle").items():
            if table["joint"] == label:
                joint = pamrs.Joint.from_model(run.plant.tables("transmission")[muscle])
                torque += got[f"muscle_force.{muscle}"] * joint.moment_arm(angle)
        np.testing.assert_allclose(
            got[f"joint_torque.{name}"],
            torque,
            rtol=1e-12,
            atol=1e-12 * float(np.abs(torque).max()),
        )
        power += torque * got[f"joint_rate.{name}"]
    each = [
        CubicSpline(run.time[k : k + 51], power[k : k + 51]).integrate(
            run.time[k], run.time[k + 50]
        )
        for k in range(0, 500, 50)
    ]
    assume(not touches(got))  # the force of a stop makes kinks between the rows
    whole = float(np.abs(each).sum())
    # the spline's own error is near 1e-7 where a command jumps
    np.testing.assert_allclose(
        got["muscle_work"][50::50], np.cumsum(each), rtol=0.0, atol=1e-6 * whole
    )


# ------------------------------------------------------------------ energy


def spring_energy(blocks: Blocks, got: pamrs.Simulation) -> Array:
    """Energy in the springs across the joints, J."""
    total = np.zeros(got["time"].size)
    for label, table in blocks.items():
        if label.startswith("joint.") and "stiffness" in table:
            turned = got[f"joint_angle.{label.partition('.')[2]}"] - table["spring_angle"]
            total += 0.5 * table["stiffness"] * turned**2
    return total


def mechanical_energy(blocks: Blocks, run: Run, got: pamrs.Simulation) -> Array:
    """Kinetic and potential energy of what is moved, J, without that of springs."""
    if "load" in blocks:
        mass = blocks["load"]["mass"]
        return np.asarray(mass * (0.5 * got["length_rate"] ** 2 - GRAVITY * got["length"]))
    if "link.elbow" in blocks:
        links = [Link.from_model(link) for link in run.model["arm"]["links"]]
        arm = PlanarArm(links, base_angle=blocks["arm"].get("base_angle", 0.0))
        angles, rates = (
            np.column_stack([got[f"{word}.{name}"] for name in ("elbow", "wrist")])
            for word in ("joint_angle", "joint_rate")
        )
        return np.array(
            [
                arm.kinetic_energy(q, v) + arm.potential_energy(q)
                for q, v in zip(angles, rates, strict=True)
            ]
        )
    arm_of = blocks["arm"]
    inertia = arm_of["inertia"] + arm_of["payload"] * arm_of["length"] ** 2
    direction = got["joint_angle.elbow"] + arm_of.get("base_angle", 0.0)
    height = -arm_of["first_moment"] * np.cos(direction + arm_of.get("centre_angle", 0.0))
    height -= arm_of["payload"] * arm_of["length"] * np.cos(direction)
    return np.asarray(0.5 * inertia * got["joint_rate.elbow"] ** 2 + GRAVITY * height)


@SOME
@given(networks(rubbing=0.0))
def test_without_friction_the_arm_keeps_what_the_muscles_give(drawn: tuple[Blocks, Run]) -> None:
    blocks, run = drawn
    got = run.core(1e-4)
    assume(not touches(got))
    energy = mechanical_energy(blocks, run, got) + spring_energy(blocks, got)
    scale = float(np.ptp(energy)) + float(np.abs(energy).max()) * 1e-6
    assume(scale > 1e-6)
    np.testing.assert_allclose(energy - energy[0], got["muscle_work"], rtol=0.0, atol=1e-8 * scale)


# ------------------------------------------------------------------ one result by every way


def same(one: Any, other: Any, names: Any) -> None:
    """Every channel bit for bit."""
    for name in names:
        np.testing.assert_array_equal(one[name], other[name], err_msg=name)


def answers(run: Run, k: int) -> dict[str, Any]:
    """The commands of one sample as keywords of `Simulator.step`."""
    return {
        word: {name: float(values[k]) for name, values in signals.items()}
        for word, signals in run.keywords.items()
    }


@SOME
@given(networks(rows=31, friction=True), st.integers(1, 29))
def test_a_run_is_the_same_in_one_go_sample_by_sample_and_from_the_middle(
    drawn: tuple[Blocks, Run], cut: int
) -> None:
    run = drawn[1]
    whole = run.core()
    simulated = [name for name in whole if name != "time" and name not in run.commands]
    fresh = pamrs.Simulator(run.plant, sample_time=run.sample_time, initial=run.initial)
    rows = [fresh.observe(), *(fresh.step(**answers(run, k)) for k in range(run.rows - 1))]
    same({name: [row[name] for row in rows] for name in simulated}, whole, simulated)
    assert fresh.events == whole.events

    half = pamrs.Simulator(run.plant, sample_time=run.sample_time, initial=run.initial)
    before = half.run(
        **{word: {n: v[:cut] for n, v in signals.items()} for word, signals in run.keywords.items()}
    )
    rest = {
        word: {n: v[cut:-1] for n, v in signals.items()} for word, signals in run.keywords.items()
    }
    again = pamrs.Simulator(run.plant, sample_time=run.sample_time)
    again.restore(half.state)
    for other in (pickle.loads(pickle.dumps(half)), again):
        happened = len(other.events)
        after = other.run(**rest)
        same(
            {
                name: np.concatenate([whole[name][:1], before[name], after[name]])
                for name in simulated
            },
            whole,
            simulated,
        )
        assert half.events + other.events[happened:] == whole.events


@SOME
@given(networks(rows=31), st.randoms(use_true_random=False))
def test_the_order_of_the_blocks_in_the_file_is_of_no_account(
    drawn: tuple[Blocks, Run], random: Any
) -> None:
    """Up to rounding: flows out of one supply are added in another order."""
    blocks, run = drawn
    labels = list(blocks)
    random.shuffle(labels)
    other = replace(run, rig=rig_of({label: blocks[label] for label in labels})).core()
    one = run.core()
    assume(not touches(one))
    assert set(one) == set(other)
    for name in one:
        scale = max(float(np.ptp(one[name])), 1e-6 * float(np.abs(one[name]).max()), 1e-12)
        assert float(np.abs(one[name] - other[name]).max()) <= 1e-8 * scale, name


@SOME
@given(networks(rows=31), st.integers(1, 7))
def test_a_controller_is_held_for_its_period(drawn: tuple[Blocks, Run], every: int) -> None:
    """Feedback of the first pressure; what was answered, held, and run again without a controller
    is the same bit for bit.
    """
    run = drawn[1]
    simulator = pamrs.Simulator(run.plant, sample_time=run.sample_time, initial=run.initial)
    pressure = next(name for name in simulator.observe() if name.startswith("muscle_pressure"))
    asked: list[float] = []

    def update(sample: dict[str, float]) -> dict[str, Any]:
        asked.append(sample["time"])
        shift = 1e-5 * (sample[pressure] - 2.5e5)
        usual = answers(run, round(sample["time"] / run.sample_time))
        return usual | {
            "valve_command": {name: volts - shift for name, volts in usual["valve_command"].items()}
        }

    closed = simulator.control(
        update, (run.rows - 1) * run.sample_time, period=every * run.sample_time
    )
    np.testing.assert_allclose(
        asked, run.sample_time * np.arange(0, run.rows - 1, every), rtol=0.0, atol=1e-12
    )
    held = {name: closed[name] for name in run.commands}
    for name, values in held.items():
        for k in range(0, run.rows - 1, every):
            assert np.unique(values[k : min(k + every, run.rows - 1)]).size == 1, name
    opened = replace(run, commands=held).core()
    same(opened, closed, [name for name in opened if name != "time"])
    assert opened.events == closed.events


# ------------------------------------------------------------------ events


@SOME
@given(networks(rows=61))
def test_events_rise_in_time_and_stops_agree_with_the_angles(drawn: tuple[Blocks, Run]) -> None:
    blocks, run = drawn
    run = finer(run, 5)
    got = run.core()
    step = run.sample_time / np.ceil(
        run.sample_time / min(1e-3, core_rig(run.plant).stable_step) - 1e-9
    )
    times = np.array([event.time for event in got.events])
    assert bool(np.all(np.diff(times) >= -step * (1.0 + 1e-9)))
    assert bool(np.all((times >= 0.0) & (times <= run.time[-1] + 1e-12)))
    for block, (values, low, high) in stopped(blocks, got).items():
        for side, beyond in (("min", values < low), ("max", values > high)):
            events = [
                event
                for event in got.events
                if event.block == block and event.kind.startswith(f"{side}_stop")
            ]
            words = [event.kind.rsplit("_", 1)[1] for event in events]
            assert words == (["reached", "left"] * len(words))[: len(words)]
            now = np.zeros(run.rows, dtype=bool)
            for event, word in zip(events, words, strict=True):
                now[run.time >= event.time] = word == "reached"
            near = np.array(
                [any(abs(t - event.time) <= step for event in events) for t in run.time]
            )
            np.testing.assert_array_equal(now[~near], beyond[~near], err_msg=f"{block} {side}")


def stopped(blocks: Blocks, got: pamrs.Simulation) -> dict[str, tuple[Array, float, float]]:
    """What can meet a stop, with its limits in the sense in which the core counts: shortening for a
    load.
    """
    found = {
        label: (
            got[f"joint_angle.{label.partition('.')[2]}"],
            table["min_angle"],
            table["max_angle"],
        )
        for label, table in blocks.items()
        if label.startswith("joint.")
    }
    if "load" in blocks:
        load = blocks["load"]
        found["load"] = (-got["length"], -load["max_length"], -load["min_length"])
    return found
