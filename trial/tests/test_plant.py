"""The trial's plant, its effects, and how they are scaled and written."""

import json
import math
import re
from dataclasses import replace

import numpy as np
import pytest

from pamrs.effects import CATALOGUE
from trial.__main__ import main
from trial.concealed import Spec, generate, make_case
from trial.effects import LISTED, TYPES, UNLISTED, Effects, Setting, draw
from trial.effects.arm import PayloadSwing
from trial.excitation import Excitation
from trial.plant import Plant
from trial.recording import ANGLE_STEP, Noise, follow, prepare, reach, run
from trial.rigfile import default_rig, read_rig, to_parameters
from trial.selfcheck import against_fine, against_lsoda

MODEL, TOLERANCE = read_rig(default_rig())
PAR = to_parameters(MODEL)
BARE = Plant(PAR)
NOISE = Noise(400.0, 42.0, math.radians(0.015), ANGLE_STEP)
SETTING = Setting(recordings=1, duration=10.0)
#: effects that no look at the angle or the muscle pressure tells
SUPPLY = {"supply_leak", "compressor_cut_in", "supply_gas_cooling"}
#: effects that leave the gas alone: with the same state, pressures go as without them
MECHANICAL = {name for name, kind in TYPES.items() if kind.block in ("muscle", "joint", "arm")} - {
    "tendon_compliance",
    "moment_arm_error",
}


@pytest.fixture(scope="module")
def cycle():
    """An open-loop recording and a sealed one after it, once for all effects."""
    rng = np.random.default_rng(3)
    return prepare(BARE, "open_cycles", 10.0, rng)


def moved(effects, cycle, supply=13.6e5):
    record = run(Plant(PAR, effects), *cycle, supply, NOISE, np.random.default_rng(1))
    return record, reach(record.clean - follow(BARE, record), NOISE)


@pytest.fixture(scope="module")
def plain(cycle):
    return moved(Effects(), cycle)


def effect_of(name, size=1.0):
    return draw(name, size, np.random.default_rng(5), SETTING)


def test_without_effects_the_windows_reproduce_the_recording(plain):
    assert max(plain[1].values()) < 0.03


@pytest.mark.parametrize("name", TYPES)
def test_effect_of_no_size_changes_nothing(name, cycle, plain):
    effect = effect_of(name)
    assert effect.active()
    none = effect.scaled(0.0)
    assert not none.active()
    assert Plant(PAR, Effects(none)).size == 4
    # and no jump on the way there
    record, far = moved(Effects(effect.scaled(1.0e-6)), cycle)
    assert max(far.values()) < 0.03
    assert np.abs((record.clean - plain[0].clean) / NOISE.floor()).max() < 0.1


@pytest.mark.parametrize("name", TYPES)
def test_effect_moves_its_channel(name, cycle, plain):
    # long enough for a slow stop or contact: bring it into the range of this recording
    effect = effect_of(name)
    if name == "joint_end_stop":
        effect = replace(effect, angle=math.radians(40.0))
    if name == "pam_crowding_contact":
        effect = replace(effect, onset=0.008)
    record, far = moved(Effects(effect), cycle)
    assert all(np.isfinite(v) for v in far.values())
    gauge = name == "clock_skew" or name.startswith("pressure")
    channel = "muscle_pressure" if gauge else "joint_angle"
    channel = "supply_pressure" if name in SUPPLY else channel
    assert far[channel] > 0.5
    if name in SUPPLY:
        assert far[channel] > far["muscle_pressure"]
    if TYPES[name].block == "sensors" and name != "clock_skew":
        # a transducer changes its own channel and nothing of the plant
        own, bare = (np.array(one.states)[:, :4] for one in (record, plain[0]))
        assert own == pytest.approx(bare, rel=1e-6, abs=1e-6)
        assert sorted(far.values())[1] < 0.03
    if name in MECHANICAL:
        assert far["supply_pressure"] < 0.05


def test_names_are_those_of_the_catalogue():
    # a tank feeds the rig, only a valve empties it, no gas has a thermometer, no arm a load cell;
    # the others are newer than the plans, whose cases stay the same
    lacking = {"supply_regulator_deadband", "com_offset", "sensor_lag", "parameter_drift"}
    lacking |= {"thermometer_lag", "supply_regulator_delay", "supply_regulator_slew"}
    lacking |= {
        "line_flow_law",
        "gauge_drift",
        "load_cell_drift",
        "tendon_give",
        "exhaust_back_pressure",
    }
    assert set(LISTED) == set(CATALOGUE) - lacking
    assert len(UNLISTED) >= 6
    assert not set(LISTED) & set(UNLISTED)
    assert all(kind.id == name and kind.graded and kind.block for name, kind in TYPES.items())


def test_integrator_is_accurate():
    assert against_fine(BARE, 4.0) < 1.0e-7
    # states of every kind: gas temperature, friction, spool, swing
    names = ("heat_transfer", "muscle_hysteresis", "payload_swing")
    effects = Effects(*map(effect_of, names))
    assert against_lsoda(Plant(PAR, effects), 1.5) < 1.0e-5


def test_swinging_payload_obeys_the_double_pendulum():
    swing = PayloadSwing(share=0.4, length=0.3, drag=0.0, loss=0.0)
    plant = Plant(PAR, Effects(swing))
    angle, rate, phi, spin, torque = 0.7, 0.5, 0.2, -0.8, 12.0
    inertia, weight = PAR.inertia + PAR.payload * PAR.length**2, PAR.weight
    d, y = [0.0] * plant.size, [0.0, 0.0, angle, rate, phi, spin]
    alpha = swing.motion(plant.env, 4)(torque, angle, rate, inertia, weight, y, d)
    mass, lever = 0.4 * PAR.payload, 0.4 * PAR.payload * PAR.length * 0.3
    c, s = math.cos(angle - phi), math.sin(angle - phi)
    swung, weighs = lever * (d[5] * c + spin**2 * s), weight * math.sin(angle)
    assert inertia * alpha + swung + weighs == pytest.approx(torque)
    hanging = mass * 0.3**2 * d[5] + lever * (alpha * c - rate**2 * s)
    hanging += mass * PAR.gravity * 0.3 * math.sin(phi)
    assert hanging == pytest.approx(0.0, abs=1e-9)


def test_full_heat_transfer_conserves_gas():
    plant = Plant(PAR, Effects(effect_of("heat_transfer")))
    y, step = plant.rest(14.0e5), 1.0e-3

    def mass(state):
        volume = plant.tables.at(state[2])[2] + PAR.dead_volume
        return state[0] * volume / (PAR.gas_constant * state[4])

    y, step = plant.advance(y, 0.1, 1.0, step)
    full, hot = mass(y), y[4]
    y, step = plant.advance(y, 0.0, 5.0, step)
    assert hot > PAR.temperature + 2.0
    assert abs(y[4] - PAR.temperature) < 0.2 * (hot - PAR.temperature)
    assert mass(y) == pytest.approx(full, rel=1e-5)


def test_pressure_at_the_manifold_leads_the_muscle():
    plant = Plant(PAR, Effects(effect_of("tube_flow_restriction", 30.0)))
    y = plant.initial(3.0e5, 14.0e5, 0.6)
    filling, venting, shut = (plant.reading(y, x)[0] for x in (0.2, -0.2, 0.0))
    assert filling > shut + 1.0e3
    assert venting < shut - 1.0e3
    # the hose makes the flow smaller
    assert abs(plant.derivative(y, -0.5)[0]) < abs(BARE.derivative(y, -0.5)[0])


RECORDINGS = (("multisine", "fit"), ("open_cycles", "fit"), ("angle_steps", "held_out"))


def test_parameters_stay_inside_their_tolerances():
    for kind in ("none", "leak_muscle", "parameters"):
        key = json.loads(generate(Spec("c", kind, 8, RECORDINGS[:1], 2.0), default_rig()).key)
        far = [abs(z) for z in key["moved_tolerances"].values() if abs(z) > 1.0]
        if kind == "parameters":
            assert 1 <= len(far) <= 2
            assert all(1.5 <= z <= 2.5 for z in far)
        else:
            assert not far
            assert any(key["moved_tolerances"].values())


def test_wrong_arguments_are_named(tmp_path):
    with pytest.raises(ValueError, match="given twice"):
        Effects(effect_of("leak_muscle"), effect_of("leak_muscle"))
    with pytest.raises(ValueError, match="two effects at the port 'motion'"):
        Plant(PAR, Effects(effect_of("payload_swing"), effect_of("base_flexibility")))
    for kind in ("huge", "none+leak_muscle", "wrong_parameter"):
        with pytest.raises(ValueError, match=f"unknown kind '{re.escape(kind)}'"):
            make_case(tmp_path, tmp_path / "k", kind, seed=1)
    with pytest.raises(ValueError, match="strength must be positive"):
        make_case(tmp_path, tmp_path / "k", "none", seed=1, strength=0.0)
    with pytest.raises(ValueError, match="must not lie inside a case folder"):
        make_case(tmp_path, tmp_path / "case_001", "none", seed=1)
    assert not list(tmp_path.iterdir())


def test_a_case_does_not_tell_what_it_conceals(tmp_path):
    words = ["--out", str(tmp_path / "c"), "--keys-dir", str(tmp_path / "k"), "--seed", "3"]
    more = ["--kind", "leak_muscle+payload_swing", "--recordings", "1", "--duration", "2"]
    assert main(["make", *words, *more]) == 0
    key = json.loads((tmp_path / "k" / "case_001.json").read_text())
    assert key["effects"] == ["leak_muscle", "payload_swing"]
    assert key["verdict"] == "effects"
    folder = tmp_path / "c" / "case_001"
    told = "".join(path.read_text() for path in folder.iterdir() if path.name != "rig.toml")
    assert (folder / "case.toml").is_file()
    assert not any(name in told for name in TYPES)
    assert main(["make", *words, "--kind", "huge"]) == 2


def test_open_loop_commands_do_not_depend_on_the_plant():
    made = [prepare(BARE, "open_cycles", 6.0, np.random.default_rng(2)) for _ in range(2)]
    assert isinstance(made[0][0], Excitation)
    assert np.array_equal(made[0][2], made[1][2])
    record, _ = moved(Effects(effect_of("leak_muscle", 5.0)), made[0])
    assert np.array_equal(record.command, made[0][2])
