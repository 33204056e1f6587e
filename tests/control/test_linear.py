"""Linear models against central differences of what the core simulates, rig by rig and effect by
effect.
"""

import math

import numpy as np
import pytest

import pamrs
from pamrs.control._at_rest import resting, without_dry_friction
from pamrs.control.linear import equilibrium, linearise
from pamrs.effects import EFFECTS
from pamrs.simulation import core_rig
from tests.tables import rows_of

SAMPLE = 2.5e-4  # s
STEP = 1e-5  # s, so that the integrator's error is none beside that of the differences
COMMAND = 1e-5  # V
#: Half widths of the differences, by the channel or the effect's state; of a mass in parts of it.
WIDTHS = rows_of(__file__, "widths")
#: Where the typical values show little: sums of terms are zero without coefficients, and a delay is
#: none.
GIVEN = rows_of(__file__, "given")
#: Chambers that do not hold the joint: where they are at ambient pressure, a muscle may have a
#: corner.
PRESSED = {
    "antagonistic_joint": {"muscle_pressure.extensor": 2e5},
    "recruitment": {"muscle_pressure.pair_2": 1e5, "muscle_pressure.pair_3": 0.8e5},
}
#: Of what the rigs of POINTS may have: none of them has a line without a tube.
SMOOTH = [
    "",
    *(name for name, info in EFFECTS.items() if info.kink is None and info.at != "line"),
]


def settled(name):
    """A packaged rig with where its joints rest: what :func:`equilibrium` and :func:`linearise`
    take.
    """
    rig = pamrs.rigs.named(name)
    joints = rig.tables("joint")
    joint, chamber = next(iter(joints)), next(iter(rig.tables("chamber")))
    start = PRESSED.get(name, {})
    middle = 0.5 * (joints[joint]["min_angle"] + joints[joint]["max_angle"])
    middle = 0.8 if len(joints) > 1 else middle
    return rig, {"angle": middle, "joint": joint, "chamber": chamber, "initial": start}


def settle(rig, given):
    """The same with the other joints at rest too."""
    start = given["initial"]
    for _ in range(60 if len(rig.tables("joint")) > 1 else 0):
        for joint, angle in (("elbow", 0.8), ("wrist", 0.6)):
            start = equilibrium(rig, angle, joint=joint, chamber=joint, initial=start)
    return {**given, "initial": start}


class Differences:
    """Sampled matrices of a rig's simulation about a start, by central differences of one short
    sample.
    """

    def __init__(self, rig, start, side):
        self.simulator = pamrs.Simulator(rig, sample_time=SAMPLE, step=STEP, initial=start)
        self.map = core_rig(rig).state_map()
        self.at = self.simulator.state
        self.places = {
            name: k for k, (name, role) in enumerate(self.map) if not role.startswith("effect_")
        }
        self.at[self._of("effect_begun")] = 1.0
        self.null = {name: table["null_voltage"] for name, table in rig.tables("valve").items()}
        self.sides = {"mean": (1.0, -1.0), "fill": (1.0, 0.0), "vent": (0.0, -1.0)}[side]
        self.follow = self._of("effect_follows") + self._of("memory")
        self.follows = self._followed()

    def _of(self, role):
        return [k for k, (_, found) in enumerate(self.map) if found == role]

    def place(self, name):
        """Place and role of a state of the linear model."""
        effect, _, block = name.partition(".air_mass")
        if effect != name:
            name = f"chamber{block}"
        roles = ("pressure", "position", "rate", "free_mass", "effect_moves", "effect_opens")
        return next(
            (k, role) for k, (found, role) in enumerate(self.map) if found == name and role in roles
        )

    def width(self, name):
        place, role = self.place(name)
        own = WIDTHS.get(name.partition(".")[0], 1e-5)
        return 3e-5 * self.at[place] if role == "free_mass" else own

    def after(self, state, **changed):
        self.simulator.restore(state)
        self.simulator.step({**self.null, **changed})
        return self.simulator.state

    def _followed(self):
        """What follows the joints, by the angle of each: from a slow motion of each."""
        angles, rates = self._of("position"), self._of("rate")
        rest, changes = self.after(self.at), []
        for rate in rates:
            state = self.at.copy()
            state[rate] += 1e-3
            changes.append(self.after(state) - rest)
        moved = np.array(changes)
        return dict(
            zip(angles, np.linalg.solve(moved[:, angles], moved[:, self.follow]), strict=True)
        )

    def sampled(self, states, inputs):
        """State and input matrix of a sample."""
        places = [self.place(name)[0] for name in states]
        columns = []
        for name, place in zip(states, places, strict=True):
            sides = self.sides if self.place(name)[1] == "effect_opens" else (1.0, -1.0)
            ends = []
            for side in sides:
                state = self.at.copy()
                state[place] += side * self.width(name)
                if place in self.follows:
                    state[self.follow] += side * self.width(name) * self.follows[place]
                ends.append(self.after(state))
            columns.append((ends[0] - ends[1])[places] / ((sides[0] - sides[1]) * self.width(name)))
        for name in inputs:
            valve, (up, down) = name.partition(".")[2], self.sides
            null = self.null[valve]
            ends = [self.after(self.at, **{valve: null + side * COMMAND}) for side in (up, down)]
            columns.append((ends[0] - ends[1])[places] / ((up - down) * COMMAND))
        whole = np.array(columns).T
        return whole[:, : len(states)], whole[:, len(states) :]

    def read(self, states, outputs):
        """What the sensors read by each state."""
        columns = []
        for name in states:
            samples = []
            for side in (1.0, -1.0):
                state = self.at.copy()
                state[self.place(name)[0]] += side * self.width(name)
                self.simulator.restore(state)
                samples.append(self.simulator.observe())
            wide = 2.0 * self.width(name)
            columns.append([(samples[0][out] - samples[1][out]) / wide for out in outputs])
        return np.array(columns).T


def agrees(rig, given, *, side="mean", held=("supply_pressure",), friction="rest"):
    """The linear model of a rig, having been compared with differences."""
    model = linearise(rig, **given, side=side, held=held, friction=friction)
    rig = resting(without_dry_friction(rig) if friction == "moving" else rig)
    by = Differences(rig, equilibrium(rig, **given), side)
    widths = np.array([by.width(name) for name in model.states])
    # a chamber that loses air does not rest meanwhile, and one that gets some gets all of it as it
    # gets the most
    ids = [effect["id"] for effect in rig.effects]
    error = 1e-4 if any("leak" in one or one == "closure_flow" for one in ids) else 5e-6
    found = by.sampled(model.states, model.inputs)
    # in half widths, so that every entry is seen beside what its row does
    scales = (widths / widths[:, None], COMMAND / widths[:, None])
    for expected, matrix, scale in zip(found, model.sampled(SAMPLE), scales, strict=True):
        difference = np.abs(matrix - expected) * scale
        assert difference.max() < error * np.abs(expected * scale).max(), (model.states, difference)
    assert model.c == pytest.approx(by.read(model.states, model.outputs), abs=1e-6)
    return model


RIGS = [
    name
    for name in pamrs.rigs.names()
    if pamrs.rigs.named(name).tables("joint") and pamrs.rigs.named(name).tables("valve")
]


@pytest.mark.parametrize(
    ("name", "effect"),
    [
        # every effect on the first rig, and of the others every third one that the next rig leaves
        pytest.param(name, effect, marks=pytest.mark.slow if i and (i + j) % 3 else ())
        for i, name in enumerate(RIGS)
        for j, effect in enumerate(SMOOTH)
    ],
)
def test_the_derivatives_are_those_of_the_simulation(name, effect):
    rig, given = settled(name)
    rig = rig.with_effect(effect, GIVEN.get(effect)) if effect else rig
    # the friction of a muscle follows what gives as it does the joint: the differences leave it
    rig = rig.with_parameters(
        {
            own: 0.0
            for own in rig.parameters
            if effect == "tendon_give" and own.endswith(("friction_coefficient", "friction_floor"))
        }
    )
    agrees(rig, settle(rig, given), held=())


@pytest.mark.parametrize("side", ["fill", "vent"])
@pytest.mark.parametrize(
    "effect",
    [
        "",
        "input_path_lag",
        "valve_centre_leakage",
        "tube_flow_restriction",
        "closure_flow",
        "closure_supply",
    ],
)
def test_a_side_of_a_valve_is_the_slope_on_that_side(side, effect):
    rig, given = settled("antagonistic_joint")
    agrees(rig.with_effect(effect, GIVEN.get(effect)) if effect else rig, given, side=side, held=())


@pytest.mark.parametrize("name", ["shoulder", "antagonistic_joint"])
def test_without_dry_friction_too(name):
    rig, given = settled(name)
    for effect in ("joint_coulomb_stribeck", "muscle_hysteresis", "muscle_creep"):
        rig = rig.with_effect(effect, GIVEN.get(effect))
    model = agrees(rig, given, friction="moving")
    assert any(state.startswith("muscle_creep") for state in model.states)


@pytest.mark.parametrize("conductance", [1e-6, 1e-7])
def test_a_wide_hose_behind_a_shut_valve_changes_no_slope(conductance):
    rig, given = settled("shoulder")
    hose = rig.with_effect("tube_flow_restriction", {"conductance": conductance, "tap": 1.0})
    for side in ("fill", "vent", "mean"):
        bare, model = linearise(rig, **given, side=side), linearise(hose, **given, side=side)
        assert model.b == pytest.approx(bare.b, rel=1e-7)
        assert model.a == pytest.approx(bare.a, rel=1e-9, abs=1e-9)


def test_a_muscle_without_pressure_has_the_mean_of_two_slopes():
    rig, given = settled("recruitment")
    both = (rig, rig.with_effect("activation_pressure"))
    bare, model = (linearise(one, **{**given, "initial": {}}) for one in both)
    slope = tuple(map(bare.states.index, ("joint_rate.shoulder", "muscle_pressure.pair_2")))
    assert model.a[slope] == pytest.approx(0.5 * bare.a[slope], rel=1e-6)


def test_each_of_several_effects_of_one_id_is_a_state_in_the_order_given():
    rig, given = settled("antagonistic_joint")
    for time_constant, at in ((0.02, "extensor"), (0.05, "flexor")):
        rig = rig.with_effect("pressure_lag", {"time_constant": time_constant}, at=at)
    rig = rig.with_effect("heat_transfer", {"initial_temperature_rise": 5.0}, at="flexor")
    rig = rig.with_effect("muscle_creep", at="extensor")
    model = agrees(rig, given)
    assert model.states[4:] == (
        "pressure_lag.extensor",
        "pressure_lag.flexor",
        "heat_transfer.air_mass.flexor",
        "muscle_creep.extensor",
    )
    assert model.a[4, 4] == pytest.approx(-50.0, rel=1e-12)
    assert model.a[5, 5] == pytest.approx(-20.0, rel=1e-12)
    without = linearise(rig.without_effect("pressure_lag", at="extensor"), **given)
    assert without.states[4] == "pressure_lag.flexor"


def test_at_rest_effects_are_as_the_catalogue_says():
    rig = pamrs.rigs.named("antagonistic_joint")
    assert resting(rig) is rig
    rig = rig.with_effect("pressure_lag", {"time_constant": 1e-5}, at="flexor")
    rig = rig.with_effect("tube_flow_restriction", {"tap": 1.0}).with_effect("leak_muscle")
    rig = rig.with_effect("pressure_lag", at="extensor")
    changed = resting(rig)
    assert [(effect["id"], effect.get("at", "")) for effect in changed.effects] == [
        ("tube_flow_restriction", ""),
        ("leak_muscle", ""),
        ("pressure_lag", "extensor"),
    ]
    assert changed.effects[0]["parameters"]["tap"] == 0.0
    assert changed.effects[1:] == rig.effects[2:]


def test_the_core_counts_a_load_by_its_length():
    # at rest length without air, where a slack muscle has a slope on one side alone
    rig = pamrs.rigs.named("hanging_mass").with_parameters({"muscle.buckling_load": 1e9})
    (states, inputs, outputs), (a, b, c) = core_rig(rig).linearise({}, "mean")
    assert states == outputs == ["supply_pressure", "muscle_pressure", "length", "length_rate"]
    assert inputs == ["valve_command"]
    mass = rig.tables("load")[""]["mass"]

    def force(**start):
        return pamrs.Simulator(rig, sample_time=SAMPLE, initial=start).observe()["muscle_force"]

    length = rig.tables("muscle")[""]["rest_length"]
    by_length = (force(length=length) - force(length=length - 1e-6)) / 1e-6
    by_pressure = (force(muscle_pressure=10.0) - force(muscle_pressure=-10.0)) / 20.0
    assert a[2].tolist() == [0.0, 0.0, 0.0, 1.0]
    assert a[3, 1] == pytest.approx(-by_pressure / mass, rel=1e-6)
    assert a[3, 2] == pytest.approx(-by_length / mass, rel=1e-2)
    assert b[0, 0] < 0.0 < b[1, 0]
    assert c.tolist() == np.eye(4).tolist()


def test_a_lag_of_no_time_is_refused_by_the_core():
    rig, given = settled("shoulder")
    rig = rig.with_effect("pressure_lag", {"time_constant": 0.0})
    with pytest.raises(pamrs.errors.RigError, match="pressure_lag"):
        core_rig(rig).linearise(equilibrium(rig, **given), "mean")
    assert math.isfinite(linearise(rig, **given).a.sum())
