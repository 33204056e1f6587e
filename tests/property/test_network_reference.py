"""The reference of rigs with several blocks against closed forms and conservation laws (pamrs plays
no part here).
"""

from __future__ import annotations

import copy
import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.reference import shoulder
from tests.reference.gas import critical_ratio, flow_function
from tests.reference.network import Network, Tube, simulate, transmission
from tests.reference.planar import Link, PlanarArm
from tests.reference.plant import Gas
from tests.tables import rows_of

AMBIENT, TEMPERATURE, GAS_CONSTANT, GRAVITY = 101325.0, 293.15, 287.05, 9.80665
RT = GAS_CONSTANT * TEMPERATURE
ISOTHERMAL = {"alpha_in": 1.0, "alpha_out": 1.0, "alpha": 1.0}
GAS = Gas()
BAR = 1e5


def made(kind: str, **changes: Any) -> dict[str, Any]:
    """A block, or a rig, with what it has where nothing else is said."""
    return {**rows_of(__file__, kind), **changes}


def chamber(name: str = "", **changes: Any) -> dict[str, Any]:
    return made("chamber", name=name, **changes)


def tank(name: str = "", **changes: Any) -> dict[str, Any]:
    return made("tank", name=name, **changes)


def regulator(name: str = "", **changes: Any) -> dict[str, Any]:
    return made("regulator", name=name, **changes)


def valve(name: str, source: str, target: str, **changes: Any) -> dict[str, Any]:
    return made("valve", **{"name": name, "from": source, "to": target, **changes})


def orifice(name: str, source: str, target: str, area: float, **changes: Any) -> dict[str, Any]:
    ends = {"name": name, "from": source, "to": target, "discharge_area": area}
    return made("orifice", **{**ends, **changes})


def tube(
    name: str, source: str, target: str, length: float = 1.0, diameter: float = 4e-3, **changes: Any
) -> dict[str, Any]:
    ends = {"name": name, "from": source, "to": target, "length": length, "diameter": diameter}
    return made("tube", **{**ends, **changes})


def muscle(
    name: str, joint: str, pulls: dict[str, Any] | None, into: str | None = None, **changes: Any
) -> dict[str, Any]:
    """A cylinder of (2.16): its table is made at once."""
    into = into or (f"chamber.{name}" if name else "chamber")
    body = made("muscle", **changes)
    return {"name": name, "chamber": into, "joint": joint, "transmission": pulls, "muscle": body}


def pulley(radius: float, rest_angle: float) -> dict[str, Any]:
    return {"kind": "pulley", "radius": radius, "rest_angle": rest_angle}


def joint(
    name: str = "",
    pulls: dict[str, Any] | None = None,
    low: float = -1.0,
    high: float = 1.0,
    **changes: Any,
) -> dict[str, Any]:
    own = {"name": name, "transmission": pulls, "min_angle": low, "max_angle": high}
    return made("joint", **{**own, **changes})


def link(
    name: str,
    length: float,
    mass: float,
    centre: float,
    inertia: float,
    payload: float = 0.0,
    **changes: Any,
) -> dict[str, Any]:
    own = {"name": name, "joint": f"joint.{name}", "length": length, "mass": mass}
    own |= {"centre": centre, "inertia": inertia, "payload": payload}
    return made("link", **{**own, **changes})


def rig(**blocks: Any) -> dict[str, Any]:
    return copy.deepcopy(made("rig", **{"arm": None, "load": None, **blocks}))


def one_link(**changes: Any) -> dict[str, Any]:
    return made("one_link", **changes)


def antagonists(**changes: Any) -> dict[str, Any]:
    """Two muscles on the two sides of one pulley, each with a valve of its own, on one tank."""
    sides = ("flexor", "extensor")
    base = {
        "supplies": [tank()],
        "valves": [valve(side, "supply", f"chamber.{side}") for side in sides],
        "chambers": [chamber(side) for side in sides],
        "muscles": [
            muscle("flexor", "joint.elbow", pulley(0.02, -1.0)),
            muscle("extensor", "joint.elbow", pulley(-0.02, 1.0)),
        ],
        "joints": [joint("elbow")],
        "arm": one_link(),
    }
    return rig(**{**base, **changes})


def balance(run: Mapping[str, np.ndarray]) -> np.ndarray:
    """Air in the chambers and inlets less what came in and plus what went out, less its start."""
    held: np.ndarray = sum(
        values
        for name, values in run.items()
        if name.partition(".")[0] in ("air_mass", "line_air_mass")
    )
    return held - held[0] - run["mass_supplied"] + run["mass_vented"]


def energy(arm: PlanarArm, run: Mapping[str, np.ndarray], names: Sequence[str]) -> np.ndarray:
    """Mechanical energy of a planar arm over a run."""
    angles, rates = (
        np.column_stack([run[f"{word}.{name}"] for name in names])
        for word in ("joint_angle", "joint_rate")
    )
    return np.array(
        [
            arm.kinetic_energy(q, v) + arm.potential_energy(q)
            for q, v in zip(angles, rates, strict=True)
        ]
    )


# ------------------------------------------------------------------ gas


@pytest.mark.parametrize("alpha_out", [1.0, 1.4])
@pytest.mark.parametrize("way", ["valve", "orifice", "tube"])
def test_choked_blow_down_is_an_exponential(way: str, alpha_out: float) -> None:
    """P(t) = P0 exp(-alpha_out k t): every way out is choked as long as r is below its critical
    ratio.
    """
    start, area, volume = 9e5, 8e-7, 1e-4
    vented = chamber(initial_pressure=start - AMBIENT, **{**ISOTHERMAL, "alpha_out": alpha_out})
    choked = area * math.sqrt(2.0 / RT) * flow_function(0.1)
    commands = {}
    if way == "valve":
        model = rig(supplies=[tank()], valves=[valve("", "supply", "chamber")], chambers=[vented])
        commands = {
            "valve_command": np.full(21, 2.5)
        }  # half of the stroke is half of the area here
        choked *= 0.5 * 1e-6 / area
    elif way == "orifice":
        model = rig(lines=[orifice("", "chamber", "ambient", area)], chambers=[vented])
    else:
        model = rig(lines=[tube("", "chamber", "ambient", 2.0, 3e-3)], chambers=[vented])
        conductance = 0.029 * 0.003**2 / math.sqrt(2.0 / 0.003**1.25 + 510.0)
        choked = conductance * 1.185
        volume += 0.5 * math.pi / 4.0 * 0.003**2 * 2.0
    run = simulate(model, commands, 0.005, rows=21)
    absolute = run["muscle_pressure"] + AMBIENT
    limit = Tube(2.0, 3e-3, GAS).critical_ratio if way == "tube" else critical_ratio()
    want = start * np.exp(-alpha_out * RT / volume * choked * run["time"])
    while_choked = AMBIENT / want < limit
    assert while_choked.sum() > 8
    np.testing.assert_allclose(absolute[while_choked], want[while_choked], rtol=1e-9)
    np.testing.assert_allclose(
        run["mass_vented"][while_choked],
        (start - want[while_choked]) * volume / RT / alpha_out,
        rtol=2e-8,
    )


def test_tube_is_that_of_the_standard() -> None:
    """C of 1 m of 4 mm tube, and a flow function that has no steps."""
    pipe = Tube(1.0, 4e-3, GAS)
    assert pipe.conductance == pytest.approx(
        0.029 * 1.6e-5 / math.sqrt(1.0 / 0.004**1.25 + 510.0), rel=1e-14
    )
    assert pipe.critical_ratio == pytest.approx(
        474.0 * 0.029 / math.sqrt(1.0 / 0.004**1.25 + 510.0), rel=1e-14
    )
    for ratio in (pipe.critical_ratio, 0.999):
        assert pipe.flow_function(ratio - 1e-13) == pytest.approx(
            pipe.flow_function(ratio + 1e-13), abs=1e-9
        )
    assert pipe.flow_function(1.0) == 0.0
    assert pipe(5e5, 3e5) == -pipe(3e5, 5e5) > 0.0
    # The same pressures move less of a warmer gas.
    warm = Tube(1.0, 4e-3, Gas(temperature=350.0))
    assert warm(5e5, 3e5) == pytest.approx(
        pipe(5e5, 3e5) * math.sqrt(TEMPERATURE / 350.0), rel=1e-14
    )


@pytest.mark.parametrize("alphas", [ISOTHERMAL, {}], ids=["isothermal", "polytropic"])
@pytest.mark.parametrize("kind", [tube, orifice])
def test_a_line_between_two_chambers_evens_them_out(kind: Any, alphas: dict[str, float]) -> None:
    size = {} if kind is tube else {"area": 4e-6}
    two = [
        chamber("a", initial_pressure=6e5, **alphas),
        chamber("b", dead_volume=3e-4, initial_pressure=5e4, **alphas),
    ]
    run = simulate(
        rig(lines=[kind("", "chamber.a", "chamber.b", **size)], chambers=two), {}, 0.05, rows=41
    )
    a, b = run["muscle_pressure.a"], run["muscle_pressure.b"]
    assert a[-1] == pytest.approx(b[-1], abs=1e-2)
    total = run["air_mass.a"] + run["air_mass.b"]
    np.testing.assert_allclose(total, total[0], rtol=1e-14)
    assert run["air_mass.a"][-1] < run["air_mass.a"][0]
    if alphas:
        half = 0.5 * math.pi / 4.0 * 0.004**2 if kind is tube else 0.0
        volumes = np.array([1e-4, 3e-4]) + half
        mixed = float(volumes @ [6e5, 5e4] / volumes.sum())
        assert a[-1] == pytest.approx(mixed, abs=1.0)
        np.testing.assert_allclose(run["air_mass.a"], (a + AMBIENT) * volumes[0] / RT, rtol=1e-9)


def test_radau_and_the_explicit_method_agree() -> None:
    two = [chamber("a", initial_pressure=6e5), chamber("b", dead_volume=2e-5)]
    model = rig(lines=[tube("", "chamber.a", "chamber.b")], chambers=two)
    one = simulate(model, {}, 0.02, rows=6)
    other = simulate(model, {}, 0.02, rows=6, method="Radau", rtol=1e-9)
    for name in ("muscle_pressure.a", "muscle_pressure.b"):
        np.testing.assert_allclose(other[name], one[name], atol=1e-7 * np.ptp(one[name]) + 0.1)


def test_a_tank_fills_a_chamber_as_the_one_link_model_says() -> None:
    """The shoulder described as a graph moves as the plant does, which was written on its own."""
    plant = shoulder()
    body = plant.muscle.geometry
    shape = {
        key: getattr(body, key)
        for key in ("rest_length", "rest_diameter", "braid_angle", "wall_thickness")
    }
    elastic = {
        "modulus_slope": list(plant.muscle.modulus_slope),
        "modulus_offset": list(plant.muscle.modulus_offset),
    }
    keys = ("upper_axial", "upper_offset", "lower_axial", "lower_offset", "rest_angle")
    tendon = {"kind": "tendon", **{key: getattr(plant.joint, key) for key in keys}}
    keys = (
        "inertia",
        "first_moment",
        "length",
        "payload",
        "viscous",
        "coulomb",
        "coulomb_speed",
        "gravity",
    )
    arm = {"kind": "one_link", **{key: getattr(plant.arm, key) for key in keys}, "links": []}
    model = rig(
        supplies=[tank(volume=0.015, initial_pressure=13.8e5)],
        valves=[valve("", "supply", "chamber", discharge_area_max=8.4e-6)],
        chambers=[chamber(dead_volume=1.5e-4)],
        muscles=[
            muscle(
                "",
                "joint",
                None,
                model="robinson",
                geometry="elliptic",
                count=6,
                **shape,
                **elastic,
            )
        ],
        joints=[
            joint(
                "",
                tendon,
                plant.joint.min_angle,
                plant.joint.max_angle,
                rest_angle=tendon["rest_angle"],
            )
        ],
        arm=arm,
    )
    time = 0.005 * np.arange(101)
    command = 5.0 + 0.8 * np.sin(9.0 * time) + 0.3 * np.sin(23.0 * time)
    initial = {
        "muscle_pressure": 2.6e5,
        "supply_pressure": 13.8e5,
        "joint_angle": 0.7,
        "joint_rate": 0.0,
    }
    got = simulate(model, {"valve_command": command}, 0.005, initial)
    absolute = {
        name: value + (AMBIENT if "pressure" in name else 0.0) for name, value in initial.items()
    }
    want = plant.simulate(command, 0.005, absolute)
    np.testing.assert_allclose(got["joint_angle"], want.joint_angle, rtol=0.0, atol=1e-8)
    np.testing.assert_allclose(got["joint_rate"], want.joint_rate, rtol=0.0, atol=1e-7)
    np.testing.assert_allclose(got["muscle_pressure"] + AMBIENT, want.muscle_pressure, rtol=1e-8)
    np.testing.assert_allclose(got["supply_pressure"] + AMBIENT, want.supply_pressure, rtol=1e-8)
    # Books: energy in as (P0 - Pf) V, air in the isothermal tank as P V, work against its own sum
    # over samples.
    spent = (got["supply_pressure"][0] - got["supply_pressure"]) * 0.015
    np.testing.assert_allclose(got["energy_supplied"], spent, atol=1e-6)
    np.testing.assert_allclose(got["supply_air_mass"], want.supply_pressure * 0.015 / RT, rtol=1e-9)
    torque = [
        plant.torque(p, q) for p, q in zip(want.muscle_pressure, want.joint_angle, strict=True)
    ]
    power = np.array(torque) * want.joint_rate
    for name, rate in (("muscle_work", power), ("joint_work", np.maximum(power, 0.0))):
        assert got[name][-1] == pytest.approx(float(np.trapezoid(rate, time)), rel=2e-3)
    assert float(np.abs(balance(got)).max()) < 1e-16


def test_an_isothermal_muscle_obeys_the_gas_law() -> None:
    """The integrated mass is P V / (R T) with V of the geometry, while the arm moves: V' belongs to
    V.
    """
    model = antagonists(chambers=[chamber(side, **ISOTHERMAL) for side in ("flexor", "extensor")])
    drive = 5.0 + 2.0 * np.sin(np.arange(41) * 0.3)
    run = simulate(
        model,
        {"valve_command.flexor": drive, "valve_command.extensor": 10.0 - drive},
        0.01,
        {"joint_angle.elbow": -0.3},
    )
    assert float(np.ptp(run["joint_angle.elbow"])) > 0.1
    geometry = Network(model).pulls[0].muscle.geometry
    for side, sign in (("flexor", 1.0), ("extensor", -1.0)):
        shortening = 0.02 * (1.0 + sign * run["joint_angle.elbow"])
        volume = 1e-4 + 2.0 * np.array([geometry.solve(e).air_volume for e in shortening / 0.2])
        want = (run[f"muscle_pressure.{side}"] + AMBIENT) * volume / RT
        np.testing.assert_allclose(run[f"air_mass.{side}"], want, rtol=1e-8)
    assert float(np.abs(balance(run)).max()) < 1e-16
    tank_air = run["supply_air_mass"]
    np.testing.assert_allclose(tank_air[0] - tank_air, run["mass_supplied"], atol=1e-16)


# ------------------------------------------------------------------ supplies and ways


def test_a_regulator_follows_its_setting_with_one_time_constant() -> None:
    outlet = regulator(initial_pressure=2e5, time_constant=0.04)
    setting = np.where(np.arange(31) < 15, 6e5, 1e5)
    run = simulate(rig(supplies=[outlet], chambers=[chamber()]), {"supply_command": setting}, 0.01)
    want = [2e5]
    for level in setting[:-1]:
        want.append(level + (want[-1] - level) * math.exp(-0.01 / 0.04))
    np.testing.assert_allclose(run["supply_pressure"], want, rtol=1e-9)
    kept = simulate(rig(supplies=[outlet], chambers=[chamber()]), {}, 0.01, rows=5)
    np.testing.assert_allclose(kept["supply_pressure"], 2e5, rtol=1e-12)


def test_a_regulator_droops_with_the_flow() -> None:
    """Into the open: p = p_set - droop mdot(p), a linear equation while the nozzle is choked."""
    outlet = regulator("a", initial_pressure=6e5, time_constant=0.02, droop=5e7)
    run = simulate(
        rig(
            supplies=[outlet],
            lines=[orifice("", "supply.a", "ambient", 1e-6)],
            chambers=[chamber()],
        ),
        {},
        0.05,
        rows=21,
    )
    per_pressure = 1e-6 * math.sqrt(2.0 / RT) * flow_function(0.1)
    want = (6e5 + AMBIENT) / (1.0 + 5e7 * per_pressure) - AMBIENT
    assert run["supply_pressure.a"][-1] == pytest.approx(want, rel=1e-9)
    np.testing.assert_allclose(run["mass_supplied"], run["mass_vented"], rtol=1e-12)
    rate = np.diff(run["mass_supplied"])[-1] / 0.05
    assert rate == pytest.approx(per_pressure * (want + AMBIENT), rel=1e-9)


def test_a_regulator_takes_air_back() -> None:
    outlet = regulator(initial_pressure=1e5, time_constant=0.02, droop=1e7)
    full = chamber(initial_pressure=5e5)
    run = simulate(
        rig(supplies=[outlet], lines=[orifice("", "supply", "chamber", 1e-6)], chambers=[full]),
        {},
        0.05,
        rows=41,
    )
    assert abs(run["mass_supplied"][-1]) < 1e-12
    assert run["mass_vented"][-1] > 0.0  # it relieves what it takes back
    assert float(run["supply_pressure"].max()) > 1.1e5
    assert run["muscle_pressure"][-1] == pytest.approx(1e5, abs=1.0)
    assert float(np.abs(balance(run)).max()) < 1e-16
    assert run["mass_vented"][-1] == pytest.approx(
        float(run["air_mass"][0] - run["air_mass"][-1]), rel=1e-9
    )


def test_a_constant_supply_gives_exergy_by_its_pressure_ratio() -> None:
    source = {"name": "", "kind": "constant", "initial_pressure": 6e5}
    model = rig(supplies=[source], valves=[valve("", "supply", "chamber")], chambers=[chamber()])
    run = simulate(model, {"valve_command": np.full(11, 7.0)}, 0.02)
    np.testing.assert_array_equal(run["supply_pressure"], 6e5)
    np.testing.assert_allclose(run["energy_supplied"], RT * run["mass_supplied"], rtol=1e-12)
    np.testing.assert_allclose(
        run["exergy_supplied"], math.log1p(6e5 / AMBIENT) * run["energy_supplied"], rtol=1e-9
    )
    # Filling a rigid chamber with one exponent: P V = P0 V + alpha_in m R T.
    gained = 1.4 * RT / 1e-4 * run["mass_supplied"]
    np.testing.assert_allclose(run["muscle_pressure"], gained, rtol=1e-8)


def test_a_line_fed_by_a_valve_has_an_inlet_of_its_own() -> None:
    """Rigid, isothermal, of half the tube and the given volume; it starts at the pressure of the
    far end.
    """
    feed = tube("feed", "", "chamber.limb", 3.0, 4e-3, inlet_volume=2e-6)
    model = rig(
        supplies=[tank()],
        valves=[valve("v", "supply", "line.feed")],
        lines=[feed],
        chambers=[chamber("limb", initial_pressure=1.5e5)],
    )
    command = np.array([5.0] * 3 + [8.0] * 20 + [5.0] * 40 + [3.0] * 20)
    run = simulate(model, {"valve_command.v": command}, 0.005)
    np.testing.assert_allclose(run["line_pressure.feed"][:4], 1.5e5, rtol=1e-12)
    volume = 2e-6 + 0.5 * math.pi / 4.0 * 0.004**2 * 3.0
    np.testing.assert_allclose(
        run["line_air_mass.feed"], (run["line_pressure.feed"] + AMBIENT) * volume / RT, rtol=1e-8
    )
    lead = run["line_pressure.feed"] - run["muscle_pressure.limb"]
    assert lead[15] > 1e4
    assert lead[-1] < -500.0
    assert abs(lead[62]) < 10.0
    assert run["mass_vented"][62] == 0.0 < run["mass_vented"][-1]
    assert float(np.abs(balance(run)).max()) < 1e-16


def test_an_inlet_behind_an_inlet_starts_at_the_far_end() -> None:
    lines = [orifice("one", "", "line.two", 1e-6, inlet_volume=1e-6), tube("two", "", "chamber")]
    model = rig(lines=lines, chambers=[chamber(initial_pressure=3e5)])
    run = simulate(model, {}, 0.01, rows=3)
    for name in ("line_pressure.one", "line_pressure.two", "muscle_pressure"):
        np.testing.assert_allclose(run[name], 3e5, rtol=1e-12)


def test_a_valve_can_be_fed_from_a_chamber() -> None:
    """A manifold: what one chamber loses the other gains, and venting acts on the second alone."""
    model = rig(
        valves=[valve("", "chamber.a", "chamber.b")],
        chambers=[chamber("a", initial_pressure=5e5), chamber("b")],
    )
    run = simulate(model, {"valve_command": [8.0] * 10 + [2.0] * 11}, 0.01)
    np.testing.assert_allclose(
        run["air_mass.a"] + run["air_mass.b"] + run["mass_vented"],
        run["air_mass.a"][0] + run["air_mass.b"][0],
    )
    assert run["muscle_pressure.b"][10] > 1e4
    assert run["air_mass.a"][10] == run["air_mass.a"][-1] < run["air_mass.a"][0]
    assert run["muscle_pressure.b"][-1] < 0.8 * run["muscle_pressure.b"][10]


# ------------------------------------------------------------------ bodies


def test_antagonists_at_equal_pressures_are_in_equilibrium() -> None:
    """At the middle they hold still; from elsewhere the arm comes back to it."""
    model = antagonists(valves=[], supplies=[], arm=one_link(viscous=4.0))
    both = {"muscle_pressure.flexor": 3e5, "muscle_pressure.extensor": 3e5}
    still = simulate(model, {}, 0.1, both, rows=6)
    assert float(np.abs(still["joint_angle.elbow"]).max()) < 1e-12
    np.testing.assert_allclose(still["muscle_pressure.flexor"], 3e5, rtol=1e-12)
    back = simulate(model, {}, 0.1, {**both, "joint_rate.elbow": 1.0}, rows=41)
    assert float(np.abs(back["joint_angle.elbow"]).max()) > 0.01
    assert abs(back["joint_angle.elbow"][-1]) < 1e-6
    pull = simulate(model, {}, 0.1, {**both, "muscle_pressure.flexor": 4e5}, rows=41)
    assert pull["joint_angle.elbow"][-1] > 0.05


def test_only_positive_work_counts_at_a_joint() -> None:
    """Between two shut muscles an arm swings: the joint's work is every rise of the muscles'
    work.
    """
    model = antagonists(valves=[], supplies=[], arm=one_link(viscous=0.0))
    both = {"muscle_pressure.flexor": 3e5, "muscle_pressure.extensor": 3e5, "joint_rate.elbow": 2.0}
    run = simulate(model, {}, 0.001, both, rows=401)
    rises = np.diff(run["muscle_work"])
    assert rises.min() < -1e-4
    assert run["joint_work"][-1] == pytest.approx(float(rises[rises > 0.0].sum()), rel=1e-3)


def test_antagonists_mirror_each_other() -> None:
    wave = 5.0 + 1.5 * np.sin(0.4 * np.arange(31))
    there = simulate(
        antagonists(), {"valve_command.flexor": wave, "valve_command.extensor": 9.0 - wave}, 0.01
    )
    back = simulate(
        antagonists(), {"valve_command.extensor": wave, "valve_command.flexor": 9.0 - wave}, 0.01
    )
    np.testing.assert_allclose(there["joint_angle.elbow"], -back["joint_angle.elbow"], atol=1e-9)
    np.testing.assert_allclose(
        there["muscle_pressure.flexor"], back["muscle_pressure.extensor"], rtol=1e-9
    )
    np.testing.assert_allclose(there["joint_work"], back["joint_work"], atol=1e-8)


def random_arm(seed: int, links: int) -> tuple[PlanarArm, list[Link], np.ndarray, np.ndarray]:
    numbers = np.random.default_rng(seed)
    parts = [
        Link(*numbers.uniform([0.1, 0.2, 0.05, 0.001, 0.0], [0.6, 4.0, 0.4, 0.2, 3.0]))
        for _ in range(links)
    ]
    return (
        PlanarArm(parts),
        parts,
        numbers.uniform(-3.0, 3.0, links),
        numbers.uniform(-5.0, 5.0, links),
    )


@given(st.integers(0, 10**6))
def test_two_links_are_those_of_the_textbook(seed: int) -> None:
    """H, C and G of Spong, Hutchinson and Vidyasagar, the angles counted from the gravity
    vector.
    """
    arm, (first, second), q, v = random_arm(seed, 2)
    m1, m2 = first.mass + first.payload, second.mass + second.payload
    c1, c2 = (
        (p.mass * p.centre + p.payload * p.length) / m for p, m in ((first, m1), (second, m2))
    )
    i1, i2 = (
        p.inertia + p.mass * (p.centre - c) ** 2 + p.payload * (p.length - c) ** 2
        for p, c in ((first, c1), (second, c2))
    )
    coupled = m2 * first.length * c2
    h12 = m2 * c2**2 + coupled * math.cos(q[1]) + i2
    h22 = m2 * c2**2 + i2
    h11 = m1 * c1**2 + m2 * (first.length**2 + c2**2) + 2.0 * coupled * math.cos(q[1]) + i1 + i2
    h = -coupled * math.sin(q[1])
    coriolis = np.array([[h * v[1], h * (v[0] + v[1])], [-h * v[0], 0.0]])
    lower = m2 * c2 * GRAVITY * math.sin(q[0] + q[1])
    weight = [(m1 * c1 + m2 * first.length) * GRAVITY * math.sin(q[0]) + lower, lower]
    np.testing.assert_allclose(arm.mass_matrix(q), [[h11, h12], [h12, h22]], rtol=1e-12, atol=1e-14)
    np.testing.assert_allclose(arm.bias(q, v), coriolis @ v + weight, rtol=1e-11, atol=1e-11)


@given(st.integers(0, 10**6), st.integers(1, 4))
def test_newton_and_lagrange_agree(seed: int, links: int) -> None:
    """The recursion against derivatives of the energies by complex steps; H' - 2C does no work."""
    arm, _, q, v = random_arm(seed, links)
    units = np.eye(links)
    own = [arm.kinetic_energy(q, unit) for unit in units]
    paired = [[arm.kinetic_energy(q, a + b) for a in units] for b in units]
    np.testing.assert_allclose(
        arm.mass_matrix(q), np.array(paired) - np.add.outer(own, own), rtol=1e-10, atol=1e-12
    )

    def momentum(at: np.ndarray) -> np.ndarray:
        return np.array(
            [
                (arm.kinetic_energy(at, v + unit) - arm.kinetic_energy(at, v - unit)) / 2.0
                for unit in units
            ]
        )

    step = 1e-30
    turning = momentum(q + 1j * step * v).imag / step
    pulled = [
        (arm.kinetic_energy(q + 1j * step * u, v) - arm.potential_energy(q + 1j * step * u)).imag
        / step
        for u in units
    ]
    np.testing.assert_allclose(arm.bias(q, v), turning - pulled, rtol=1e-9, atol=1e-9)
    inertial = arm.inverse_dynamics(q, v, [0.0] * links, 0.0)
    assert float(v @ inertial) == pytest.approx(0.5 * float(v @ turning), rel=1e-9, abs=1e-9)


def test_one_link_is_a_pendulum() -> None:
    """One link of the planar arm is the one-link arm, friction and payload included."""
    part = link("a", 0.4, 2.0, 0.15, 0.02, 0.7, viscous=0.3, coulomb=0.2)
    planar = rig(
        joints=[joint("a", low=-3.0, high=3.0)],
        arm={"kind": "planar", "gravity": GRAVITY, "links": [part]},
        chambers=[],
    )
    single = one_link(
        inertia=0.02 + 2.0 * 0.15**2,
        first_moment=0.3,
        length=0.4,
        payload=0.7,
        viscous=0.3,
        coulomb=0.2,
    )
    start = {"joint_angle.a": 1.2, "joint_rate.a": -0.5}
    one, other = (
        simulate({**planar, "arm": arm}, {}, 0.02, start, rows=51)
        for arm in (planar["arm"], single)
    )
    np.testing.assert_allclose(one["joint_angle.a"], other["joint_angle.a"], atol=1e-9)


def test_a_planar_arm_without_friction_keeps_its_energy() -> None:
    names = ["wrist", "shoulder", "elbow"]  # not in the order of the links
    parts = [
        link("shoulder", 0.3, 2.0, 0.14, 0.02, 0.5),
        link("elbow", 0.25, 1.2, 0.1, 0.01),
        link("wrist", 0.1, 0.4, 0.05, 1e-3, 1.0),
    ]
    model = rig(
        joints=[joint(name, low=-20.0, high=20.0) for name in names],
        arm={"kind": "planar", "gravity": GRAVITY, "links": parts},
    )
    start = {"joint_angle.shoulder": 2.0, "joint_angle.elbow": -1.0, "joint_rate.wrist": 3.0}
    run = simulate(model, {}, 0.02, start, rtol=1e-12, rows=101)
    arm = PlanarArm([Link.from_model(part) for part in parts])
    total = energy(arm, run, ["shoulder", "elbow", "wrist"])
    moved = np.ptp(energy(PlanarArm(arm.links, 0.0), run, ["shoulder", "elbow", "wrist"]))
    assert float(np.ptp(run["joint_angle.elbow"])) > 1.0
    np.testing.assert_allclose(total, total[0], rtol=0.0, atol=1e-9 * moved)


def two_joints() -> dict[str, Any]:
    """Two driven links: a polynomial transmission on one joint, antagonists on the other, tubes of
    their own.
    """
    sides = ("hip", "flexor", "extensor")
    wound = {"kind": "polynomial", "coefficients": [0.025, -0.004, 0.001], "rest_angle": -0.8}
    return rig(
        supplies=[tank()],
        valves=[valve(side, "supply", f"line.{side}") for side in sides],
        lines=[tube(side, "", f"chamber.{side}", 0.8) for side in sides],
        chambers=[chamber(side) for side in sides],
        muscles=[
            muscle("hip", "joint.hip", None, count=3),
            muscle("flexor", "joint.knee", pulley(0.02, -1.0)),
            muscle("extensor", "joint.knee", pulley(-0.02, 1.0)),
        ],
        joints=[joint("knee"), joint("hip", wound, low=-0.7, high=0.9)],
        arm={
            "kind": "planar",
            "gravity": GRAVITY,
            "links": [link("hip", 0.4, 3.0, 0.2, 0.04), link("knee", 0.35, 1.5, 0.15, 0.02, 1.0)],
        },
    )


def test_muscles_work_on_a_planar_arm_and_the_books_close() -> None:
    """Without friction and stops the arm's energy grows by just the work of the muscles; no air is
    lost.
    """
    model = two_joints()
    phase = 0.25 * np.arange(41)
    commands = {
        "valve_command.hip": 6.0 + np.sin(phase),
        "valve_command.flexor": 5.5 + 1.5 * np.sin(2.0 * phase),
        "valve_command.extensor": 5.5 - 1.5 * np.sin(2.0 * phase),
    }
    run = simulate(model, commands, 0.01, {"muscle_pressure.hip": 1e5})
    total = energy(
        PlanarArm([Link.from_model(part) for part in model["arm"]["links"]]), run, ["hip", "knee"]
    )
    assert float(np.ptp(total)) > 0.5
    np.testing.assert_allclose(total - total[0], run["muscle_work"], atol=1e-7)
    assert bool(np.all(np.diff(run["joint_work"]) >= 0.0))
    assert bool(np.all(run["joint_work"] >= run["muscle_work"] - 1e-9))
    assert float(np.abs(balance(run)).max()) < 1e-16


def test_stops_hold_a_fallen_arm() -> None:
    """A link lies on its stop as deep as its weight presses: k depth = m g c sin(q)."""
    part = link("a", 0.4, 2.0, 0.15, 0.02, viscous=2.0)
    held = joint("a", low=0.3, high=1.0, stop_stiffness=500.0, stop_damping=5.0)
    run = simulate(
        rig(joints=[held], arm={"kind": "planar", "gravity": GRAVITY, "links": [part]}),
        {},
        0.1,
        {"joint_angle.a": 0.6},
        rows=61,
    )
    end = run["joint_angle.a"][-1]
    assert 500.0 * (0.3 - end) == pytest.approx(2.0 * GRAVITY * 0.15 * math.sin(end), rel=1e-5)


def hanging(**changes: Any) -> dict[str, Any]:
    load = {
        "kind": "mass",
        "min_length": 0.14,
        "max_length": 0.202,
        "mass": 20.0,
        "viscous": 900.0,
        "coulomb": 0.0,
    }
    load |= {
        "coulomb_speed": 0.01,
        "gravity": GRAVITY,
        "stop_stiffness": 1e6,
        "stop_damping": 1e3,
        **changes,
    }
    return rig(chambers=[chamber()], muscles=[muscle("", "load", None)], load=load)


def test_a_hanging_mass_comes_to_rest_where_the_muscles_carry_it() -> None:
    model = hanging()
    run = simulate(model, {}, 0.2, {"muscle_pressure": 3e5, "length": 0.18}, rows=41)
    means = Network(model).pulls[0].muscle
    force = 2.0 * float(means.force(run["muscle_pressure"][-1], 1.0 - run["length"][-1] / 0.2))
    assert force == pytest.approx(20.0 * GRAVITY, rel=1e-6)
    assert abs(run["length_rate"][-1]) < 1e-8
    free = simulate(
        hanging(viscous=0.0), {}, 0.002, {"muscle_pressure": 3e5, "length": 0.18}, rows=16
    )
    assert float(np.ptp(free["length"])) > 1e-3
    gained = 10.0 * free["length_rate"] ** 2 + 20.0 * GRAVITY * (0.18 - free["length"])
    np.testing.assert_allclose(free["muscle_work"], gained, atol=1e-7)
    dropped = simulate(hanging(mass=60.0), {}, 0.2, {"length": 0.2}, rows=21)
    depth = dropped["length"][-1] - 0.202
    force = 2.0 * float(
        means.force(dropped["muscle_pressure"][-1], 1.0 - dropped["length"][-1] / 0.2)
    )
    assert depth == pytest.approx((60.0 * GRAVITY - force) / 1e6, rel=1e-5)
    assert depth > 1e-5


def test_the_rate_of_a_load_is_that_of_its_length_and_meets_friction() -> None:
    start = {"muscle_pressure": 3e5, "length": 0.18, "length_rate": -0.3}
    free, rubbed = (
        simulate(hanging(viscous=0.0, coulomb=f), {}, 1e-4, start, rows=11) for f in (0.0, 30.0)
    )
    assert free["length_rate"][0] == -0.3
    np.testing.assert_allclose(
        np.gradient(free["length"], 1e-4)[1:-1], free["length_rate"][1:-1], rtol=1e-4
    )
    np.testing.assert_allclose(
        (rubbed["length_rate"] - free["length_rate"])[1:], 30.0 / 20.0 * free["time"][1:], rtol=1e-3
    )


@settings(deadline=None)
@given(st.floats(-0.6, 0.9), st.sampled_from(["tendon", "pulley", "polynomial"]))
def test_a_torque_arm_is_the_slope_of_the_shortening(angle: float, kind: str) -> None:
    tendon = {
        "upper_axial": 0.0254,
        "upper_offset": 0.027,
        "lower_axial": 0.027,
        "lower_offset": 0.005,
        "rest_angle": -0.7,
    }
    model = {
        "tendon": {**tendon, "kind": "tendon", "rest_angle": 0.3},
        "pulley": pulley(-0.03, 0.4),
        "polynomial": {
            "kind": "polynomial",
            "coefficients": [0.02, -0.01, 0.003],
            "rest_angle": -0.2,
        },
    }[kind]
    means, h = transmission(model), 1e-3
    angle += 0.9 if kind == "tendon" else 0.0
    d = [means.contraction(angle + n * h) for n in (-2, -1, 1, 2)]
    assert means.moment_arm(angle) == pytest.approx(
        (d[0] - 8.0 * d[1] + 8.0 * d[2] - d[3]) / (12.0 * h), abs=1e-11
    )
    assert means.contraction(model["rest_angle"]) == pytest.approx(0.0, abs=1e-16)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"effects": [{"id": "leak_muscle", "at": "", "parameters": {}}]}, "no effects"),
        (
            {
                "muscles": [
                    muscle("flexor", "joint.elbow", pulley(0.02, -1.0), friction_coefficient=0.1)
                ]
            },
            "direction",
        ),
        (
            {"lines": [tube("x", "chamber.flexor", "chamber.extensor", inlet_volume=1e-6)]},
            "inlet volume",
        ),
        ({"arm": None, "load": {"kind": "frame"}}, "no load 'frame'"),
    ],
)
def test_what_has_no_equation_here_is_refused(change: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Network(antagonists(**change))


def test_a_command_or_start_of_nothing_is_refused() -> None:
    with pytest.raises(ValueError, match="commands are"):
        simulate(antagonists(), {"valve_command.flexor": [5.0, 5.0]}, 0.01)
    with pytest.raises(ValueError, match="initial values of nothing"):
        simulate(rig(chambers=[chamber()]), {}, 0.01, {"muscle_pressure.a": 1.0}, rows=2)


def test_a_run_that_leaves_the_model_says_where() -> None:
    soft = hanging(mass=500.0, stop_stiffness=0.0)
    with pytest.raises(RuntimeError, match=r"failed in sample \d+: .*outside the table"):
        simulate(soft, {}, 0.01, {"length": 0.2}, rows=100)
