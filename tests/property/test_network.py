"""Rigs of several blocks: the core against the independent reference, books included."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, assume, given, settings
from numpy.polynomial.legendre import leggauss

import pamrs
from tests.golden.generate import NETWORKS
from tests.property.networks import GAS, Blocks, networks, rig_of, valve
from tests.reference.network import muscle_of
from tests.runs import RUNS, Run, misses

AMBIENT = 101325.0
RT = 287.05 * 293.15
#: Of a channel's range. The force of a stop jumps inside a step, which a fixed step meets with an
#: error of first order.
SMOOTH, STOPPED = 1e-6, 1e-4
BOOKS = (
    "mass_supplied",
    "mass_vented",
    "energy_supplied",
    "exergy_supplied",
    "muscle_work",
    "joint_work",
)


def beyond(found: dict[str, float], bound: float) -> dict[str, float]:
    """The channels that miss by more than a bound."""
    return {name: miss for name, miss in found.items() if not miss < bound}


def stops(run: pamrs.Simulation) -> list[str]:
    """The joints or loads that touched a stop."""
    return [event.block for event in run.events if "stop" in event.kind]


def test_every_packaged_rig_is_compared() -> None:
    """The bench below, by its own laws: the reference has no load frame."""
    assert {*RUNS, "bench"} == set(pamrs.rigs.names())


#: Rows that are run here: of most the beginning, of those whose golden vectors hold the whole less.
#: The hanging mass moves less than 3 % in its beginning.
ROWS = dict.fromkeys(NETWORKS, 41) | {"hanging_mass": 161}


@pytest.mark.parametrize("name", RUNS)
def test_packaged_rigs(name: str) -> None:
    run = RUNS[name].lasting(ROWS.get(name, 81))
    want, got = run.reference(1e-10), run.core(2e-5)
    assert not stops(got)
    assert set(BOOKS) < set(want)
    moved = [
        channel
        for channel in want
        if channel.partition(".")[0] in ("joint_angle", "length", "muscle_pressure")
    ]
    if name != "sealed_chamber":
        assert all(np.ptp(want[channel]) > 0.03 * np.abs(want[channel]).max() for channel in moved)
    assert not beyond(misses(got, want), SMOOTH)


def falling(
    rig: str,
    rows: int,
    changes: dict[str, float] | None = None,
    **starts: tuple[float | None, float | None],
) -> Run:
    """A run of a packaged rig whose valves hardly vent; `starts` are angle or length and pressure
    of blocks by their names.
    """
    usual = RUNS[rig]
    initial = {}
    for block, (position, pressure) in starts.items():
        if position is not None:
            initial["length" if block == "load" else f"joint_angle.{block}"] = position
        if pressure is not None:
            initial["muscle_pressure" if block == "load" else f"muscle_pressure.{block}"] = pressure
    return Run(
        rig,
        0.005,
        rows,
        initial,
        {name: np.full(rows, 4.9) for name in usual.commands},
        {**usual.changes, **(changes or {})},
    )


#: Slack muscles let the arm hang between its stops.
STRUTS = {f"muscle.{side}.buckling_load": 1e9 for side in ("flexor", "extensor")}


@pytest.mark.parametrize(
    ("run", "block"),
    [
        (falling("two_joint_arm", 41, elbow=(0.2, 5e4), wrist=(0.8, 2e5)), "joint.elbow"),
        pytest.param(
            falling("two_joint_arm", 41, elbow=(0.6, 2e5), wrist=(0.3, 5e4)),
            "joint.wrist",
            marks=pytest.mark.slow,
        ),
        (
            falling("antagonistic_joint", 61, STRUTS, elbow=(0.2, None), flexor=(None, 1e4)),
            "joint.elbow",
        ),
        (falling("hanging_mass", 61, {"load.mass": 120.0}, load=(0.272, None)), "load"),
        (falling("recruitment", 61, shoulder=(0.4, None)), "joint.shoulder"),
    ],
    ids=["elbow", "wrist", "antagonists", "load", "shoulder"],
)
def test_what_falls_on_a_stop(run: Run, block: str) -> None:
    got = run.core(1e-6)
    assert block in stops(got)
    assert not beyond(misses(got, run.reference(1e-10)), STOPPED)


@pytest.mark.parametrize("examples", [6, pytest.param(40, marks=pytest.mark.slow)])
def test_networks(examples: int) -> None:
    # A failing example is not shrunk: the reference is too slow for the hundreds of runs that would
    # take.
    @settings(
        max_examples=examples,
        deadline=None,
        phases=[Phase.explicit, Phase.reuse, Phase.generate],
        suppress_health_check=[
            HealthCheck.too_slow,
            HealthCheck.data_too_large,
            HealthCheck.filter_too_much,
        ],
    )
    @given(networks())
    def agree(drawn: tuple[Blocks, Run]) -> None:
        run = drawn[1]
        got = run.core(1e-5)
        assume(not stops(got))
        # the reference, too, can be off where a flow turns: it is asked again, more exactly
        assert not beyond(misses(got, run.reference(1e-10)), SMOOTH) or not beyond(
            misses(got, run.reference(1e-11)), SMOOTH
        )

    agree()


def bottled(front: dict[str, Any], dead_band: float, *, line: bool) -> pamrs.Rig:
    """A chamber that a regulator behind another supply feeds, by a line or by a valve."""
    blocks: Blocks = {
        "gas": dict(GAS),
        "supply.bottle": front,
        "supply.regulator": {
            "kind": "regulator",
            "inlet": "bottle",
            "initial_pressure": 3e5,
            "time_constant": 0.05,
            "droop": 3e6,
            "dead_time": 0.013,
            "rise_limit": 8e6,
            "fall_limit": 9e6,
            "dead_band": dead_band,
        },
        "chamber": {"dead_volume": 5e-4, "alpha_in": 1.3, "alpha_out": 1.1, "alpha": 1.2},
    }
    if line:
        blocks["line"] = {"kind": "orifice", "discharge_area": 2e-6}
    else:
        blocks["valve"] = valve(3e-6)
    return rig_of(blocks)


@pytest.mark.parametrize(
    ("kind", "dead_band", "line"),
    [
        ("tank", 0.0, True),
        ("tank", 2e4, False),
        ("constant", 0.0, False),
        ("constant", 2e4, True),
    ],
)
def test_a_regulator_behind_another_supply(kind: str, dead_band: float, line: bool) -> None:
    """It is set above and below what its inlet has, is drawn from and takes back."""
    own = {"tank": {"volume": 2e-3}, "constant": {}}[kind]
    rig = bottled({"kind": kind, "initial_pressure": 5e5, **own}, dead_band, line=line)
    rows = 101
    set_to = np.repeat([3e5, 8e5, 2e5, 6e5, 1e5], 21)[:rows]
    commands = {"supply_command.regulator": set_to}
    if not line:
        commands["valve_command"] = 5.0 + 4.0 * np.sin(0.2 + 0.15 * np.arange(rows))
    run = Run(rig, 0.01, rows, {"muscle_pressure": 1e5}, commands)
    got = run.core(2e-5)
    front, outlet = got["supply_pressure.bottle"], got["supply_pressure.regulator"]
    assert (outlet < front + 2e3).all()
    assert (set_to > front + 1e5).any()
    assert np.abs(outlet - front).min() < 2e4
    assert not beyond(misses(got, run.reference(1e-10)), SMOOTH)


@pytest.mark.parametrize("inlet", [0.0, 1e-7, 1e-5])
def test_a_small_volume_before_a_tube(inlet: float) -> None:
    """The shoulder's valve at the end of a tube: stiff, so that the reference is implicit."""
    rig = with_tube(inlet_volume=inlet)
    start = {"joint_angle": 0.7, "muscle_pressure": 2.6e5}
    command = 5.0 + 1.5 * np.sin(0.1 + 0.2 * np.arange(21))
    run = Run(rig, 0.005, 21, start, {"valve_command": command})
    want = run.reference(1e-10, "Radau")
    assert not beyond(misses(run.core(1e-6), want), SMOOTH)
    assert not beyond(misses(run.core(), want), 1e-3)  # 1 ms, which is divided


def with_tube(**changes: float) -> pamrs.Rig:
    """The shoulder with 1 m of 4 mm tube between valve and chamber."""
    line = {
        "length": "1.0",
        "diameter": "0.004",
        "inlet_volume": "0.0",
        **{name: repr(value) for name, value in changes.items()},
    }
    units = {"length": "m", "diameter": "m", "inlet_volume": "m3"}
    table = "\n".join(
        f'{name} = {{ value = {value}, unit = "{units[name]}" }}' for name, value in line.items()
    )
    return pamrs.rig.parse_rig(f"{pamrs.rigs.shoulder().to_toml_text()}\n[line]\n{table}\n")


# ------------------------------------------------------------------ against the arrow


def iso_valve(fill: float, vent: float) -> Blocks:
    """A valve by ISO 6358 with another critical ratio on each path."""
    own = {
        "flow": "iso_6358",
        "fill_conductance": fill,
        "fill_critical_ratio": 0.25,
        "vent_conductance": vent,
        "vent_critical_ratio": 0.4,
    }
    return {key: value for key, value in valve(1.0).items() if key != "discharge_area_max"} | own


WAYS: dict[str, Blocks] = {
    "valve": {"valve": valve(1e-6)},
    "iso": {"valve": iso_valve(2e-9, 3e-9)},
    "line": {"line": {"kind": "orifice", "discharge_area": 1e-6}},
}
#: Back into the supply, in from the ambient, filling, venting: volts and gauge pressure.
FLOWS = ((8.0, 6e5), (2.0, -5e4), (8.0, 1e5), (2.0, 6e5))


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize(("command", "pressure"), FLOWS)
def test_air_goes_either_way(way: str, command: float, pressure: float) -> None:
    """P' = R T/V (alpha_in m_in - alpha_out m_out): what goes out of a chamber is its outflow,
    whatever the valve is for.
    """
    commands = {} if way == "line" else {"valve_command": np.full(41, command)}
    run = Run(one_chamber(WAYS[way]), 0.01, 41, {"muscle_pressure": pressure}, commands)
    assert not beyond(misses(run.core(1e-4), run.reference()), SMOOTH)


def test_a_choked_iso_valve_fills_by_its_conductance() -> None:
    """P' = alpha R T C rho0 p_up / V where the ratio is below b, at 293.15 K."""
    rig = rig_of(
        {
            "gas": GAS,
            "supply": {"kind": "constant", "initial_pressure": 9e5},
            "valve": iso_valve(2e-9, 0.0),
            "chamber": {"dead_volume": 1e-3, "alpha_in": 1.0, "alpha_out": 1.0, "alpha": 1.0},
        }
    )
    run = pamrs.simulate(rig, np.full(21, 10.0), sample_time=0.01)
    flow = 2e-9 * 1.185 * (9e5 + AMBIENT)
    wanted = RT * flow / 1e-3 * run.time
    np.testing.assert_allclose(run["muscle_pressure"], wanted, rtol=1e-9, atol=1e-6)
    shut = pamrs.simulate(rig, np.zeros(21), sample_time=0.01, initial={"muscle_pressure": 3e5})
    np.testing.assert_allclose(shut["muscle_pressure"], 3e5, rtol=1e-12)


def test_two_switching_valves_fill_and_vent_one_chamber() -> None:
    """2/2 valves: one only fills, one only vents, each wide open above its switching voltage."""
    switch = {"null_voltage": 12.0, "half_range": 12.0, "opening": [0.0, 1.0]}
    switch["fraction"] = [1.0, 1.0]
    rig = rig_of(
        {
            "gas": GAS,
            "supply": {"kind": "constant", "initial_pressure": 6e5},
            "valve.into": iso_valve(2e-9, 0.0) | switch,
            "valve.out": iso_valve(0.0, 2e-9) | switch,
            "chamber": {"dead_volume": 1e-4, "alpha_in": 1.4, "alpha_out": 1.0, "alpha": 1.2},
        }
    )
    into = np.where(np.arange(61) < 20, 24.0, 0.0)
    out = np.where(np.arange(61) < 40, 24.0, 0.0)  # without current it vents
    run = pamrs.simulate(rig, {"into": into, "out": out}, sample_time=0.005)
    pressure = run["muscle_pressure"]
    assert pressure[20] > 1.5e5
    np.testing.assert_allclose(pressure[20:41], pressure[20], rtol=1e-12)
    absolute = pressure[40:51] + AMBIENT  # choked: an exponential
    fall = RT * 2e-9 * 1.185 / 1e-4 * 0.005 * np.arange(11)
    np.testing.assert_allclose(absolute, absolute[0] * np.exp(-fall), rtol=1e-9)


def one_chamber(way: Blocks) -> pamrs.Rig:
    """A rigid chamber with different exponents for each direction, on a tank of 2 bar by a valve or
    a line.
    """
    chamber = {"dead_volume": 1e-4, "alpha_in": 1.4, "alpha_out": 1.0, "alpha": 1.2}
    return rig_of(
        {
            "gas": GAS,
            "supply": {"kind": "tank", "volume": 2e-3, "initial_pressure": 2e5},
            **way,
            "chamber": chamber,
        }
    )


# ------------------------------------------------------------------ the bench, by its own laws

BENCH = pamrs.rigs.named("bench")
DEAD, EXPONENT = 8e-6, 1.2
TIME = 0.02 * np.arange(26)
LENGTH = 0.24 + 0.025 * np.sin(4.0 * TIME)


def bench_muscle(length: np.ndarray, pressure: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Force (N) and volume (m^3) of the bench's muscle by the reference's exact solve."""
    muscle = muscle_of(BENCH.model["muscle"])
    ratio = 1.0 - length / muscle.geometry.rest_length
    force = [float(muscle.force(p, e)) for p, e in zip(pressure, ratio, strict=True)]
    return np.array(force), DEAD + np.array(
        [muscle.geometry.solve(float(e)).air_volume for e in ratio]
    )


def over_samples(power: Callable[[int, float], float]) -> np.ndarray:
    """Integral of `power(sample, share of it)` from the start to each row."""
    nodes, weights = leggauss(6)
    each = [
        0.5
        * float(
            np.diff(TIME)[k]
            * sum(w * power(k, 0.5 * (x + 1.0)) for x, w in zip(nodes, weights, strict=True))
        )
        for k in range(TIME.size - 1)
    ]
    return np.concatenate([[0.0], np.cumsum(each)])


def bench_work(pressure: Callable[[int, float], float]) -> dict[str, np.ndarray]:
    """Work of the bench's muscle and the positive part of it, while straight lines lead from length
    to length.
    """
    rate = np.diff(LENGTH) / np.diff(TIME)

    def power(k: int, share: float) -> float:
        length = LENGTH[k] + share * (LENGTH[k + 1] - LENGTH[k])
        force, _ = bench_muscle(np.array([length]), np.array([pressure(k, share)]))
        return float(-force[0] * rate[k])

    return {
        "muscle_work": over_samples(power),
        "joint_work": over_samples(lambda k, share: max(power(k, share), 0.0)),
    }


def test_a_shut_muscle_on_the_bench_is_a_gas_spring() -> None:
    """P V^alpha stays, with the force and the work that go with it."""
    got = pamrs.simulate(
        BENCH, length=LENGTH, sample_time=0.02, step=1e-4, initial={"muscle_pressure": 2e5}
    )
    muscle = muscle_of(BENCH.model["muscle"])

    def volume(length: float) -> float:
        return DEAD + muscle.geometry.solve(1.0 - length / muscle.geometry.rest_length).air_volume

    def pressure(length: float) -> float:
        return (2e5 + AMBIENT) * (volume(LENGTH[0]) / volume(length)) ** EXPONENT - AMBIENT

    gauge = np.array([pressure(length) for length in LENGTH])
    force, volumes = bench_muscle(LENGTH, gauge)
    work = bench_work(lambda k, share: pressure(LENGTH[k] + share * (LENGTH[k + 1] - LENGTH[k])))
    mass = np.full(TIME.size, (2e5 + AMBIENT) * volumes[0] / RT)
    want = {
        "muscle_pressure": gauge,
        "muscle_force": force,
        "air_volume": volumes,
        "air_mass": mass,
        "length": LENGTH,
        **work,
    }
    still = dict.fromkeys(
        ("mass_supplied", "mass_vented", "energy_supplied", "exergy_supplied"), np.zeros(TIME.size)
    )
    assert float(np.ptp(gauge)) > 2e4
    assert not beyond(misses(got, want | still), SMOOTH)


def test_a_held_pressure_on_the_bench_takes_and_gives_air() -> None:
    """Gas at the room's temperature: m = P V/(R T), and what it lacks is supplied, what is too much
    is vented.
    """
    gauge = 2e5 + 5e4 * np.sin(7.0 * TIME)
    got = pamrs.simulate(BENCH, length=LENGTH, pressure=gauge, sample_time=0.02, step=1e-4)
    force, volumes = bench_muscle(LENGTH, gauge)
    mass = (gauge + AMBIENT) * volumes / RT
    more = np.diff(mass)
    assert more.min() < 0.0 < more.max()
    ratio = np.log((gauge[1:] + AMBIENT) / AMBIENT)
    sums: dict[str, Any] = {
        "mass_supplied": np.maximum(more, 0.0),
        "mass_vented": np.maximum(-more, 0.0),
        "energy_supplied": RT * np.maximum(more, 0.0),
        "exergy_supplied": RT * ratio * np.maximum(more, 0.0),
    }
    want = {name: np.concatenate([[0.0], np.cumsum(values)]) for name, values in sums.items()}
    want |= {
        "muscle_pressure": gauge,
        "muscle_force": force,
        "air_volume": volumes,
        "air_mass": mass,
    }
    want |= bench_work(lambda k, share: float(gauge[k] + share * (gauge[k + 1] - gauge[k])))
    assert not beyond(misses(got, want), SMOOTH)
    assert math.isclose(got.balance.residual, 0.0, abs_tol=1e-12 * mass[0])
