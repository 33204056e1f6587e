"""The reference of rigs with several blocks against closed forms and conservation laws (pamrs plays
no part here).
"""

from __future__ import annotations

import copy
import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest

from tests.reference.gas import critical_ratio, flow_function
from tests.reference.network import Network, Tube, simulate
from tests.reference.plant import Gas
from tests.tables import rows_of

AMBIENT, TEMPERATURE, GAS_CONSTANT, GRAVITY = 101325.0, 293.15, 287.05, 9.80665
RT = GAS_CONSTANT * TEMPERATURE
ISOTHERMAL = {"alpha_in": 1.0, "alpha_out": 1.0, "alpha": 1.0}
GAS = Gas()


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


# ------------------------------------------------------------------ supplies and ways


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


def hanging(**changes: Any) -> dict[str, Any]:
    load = {"kind": "mass", "min_length": 0.14, "max_length": 0.202, "mass": 20.0}
    load |= {"viscous": 900.0, "coulomb": 0.0, "coulomb_speed": 0.01, "gravity": GRAVITY}
    load |= {"stop_stiffness": 1e6, "stop_damping": 1e3, **changes}
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
