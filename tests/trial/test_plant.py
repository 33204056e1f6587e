"""The trial's plant, its effects, and how they are scaled and written."""

import hashlib
import json
import math
from dataclasses import replace

import numpy as np
import pytest

from pamrs.effects import CATALOGUE
from trial import concealed, plan
from trial.concealed import Spec, generate
from trial.effects import LISTED, TYPES, UNLISTED, Effects, Setting, Start, draw
from trial.effects.arm import PayloadSwing
from trial.excitation import Excitation
from trial.plan import kinds, specs, write_plan
from trial.plant import Plant
from trial.recording import ANGLE_STEP, CHANNELS, CommandPath, Noise, follow, prepare, reach, run
from trial.rigfile import default_rig, read_rig, to_parameters
from trial.selfcheck import against_fine, against_lsoda
from trial.strength import STRENGTHS, aim

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
    shape, control, command = prepare(BARE, "open_cycles", 10.0, rng)
    return shape, control, command


def moved(effects, cycle, supply=13.6e5):
    record = run(Plant(PAR, effects), *cycle, supply, NOISE, np.random.default_rng(1))
    return record, reach(record.clean - follow(BARE, record), NOISE)


def effect_of(name, size=1.0):
    return draw(name, size, np.random.default_rng(5), SETTING)


def test_without_effects_the_windows_reproduce_the_recording(cycle):
    _, far = moved(Effects(), cycle)
    assert max(far.values()) < 0.03


@pytest.mark.parametrize("name", TYPES)
def test_effect_of_no_size_changes_nothing(name, cycle):
    effect = effect_of(name)
    assert effect.active()
    none = effect.scaled(0.0)
    assert not none.active()
    assert Plant(PAR, Effects(none)).size == 4
    # and no jump on the way there
    record, far = moved(Effects(effect.scaled(1.0e-6)), cycle)
    plain, _ = moved(Effects(), cycle)
    assert max(far.values()) < 0.03
    assert np.abs((record.clean - plain.clean) / NOISE.floor()).max() < 0.1


@pytest.mark.parametrize("name", TYPES)
def test_effect_moves_its_channel(name, cycle):
    # long enough for a slow stop or contact: bring it into the range of this recording
    effect = effect_of(name)
    if name == "joint_end_stop":
        effect = replace(effect, angle=math.radians(40.0))
    if name == "pam_crowding_contact":
        effect = replace(effect, onset=0.008)
    record, far = moved(Effects(effect), cycle)
    assert all(np.isfinite(v) for v in far.values())
    channel = (
        "supply_pressure"
        if name in SUPPLY
        else "muscle_pressure"
        if name.startswith("pressure")
        else "joint_angle"
    )
    if name == "clock_skew":
        channel = "muscle_pressure"
    assert far[channel] > 0.5
    if name in SUPPLY:
        assert far[channel] > far["muscle_pressure"]
    if TYPES[name].block == "sensors" and name != "clock_skew":
        # a transducer changes its own channel and nothing of the plant
        plain, _ = moved(Effects(), cycle)
        assert np.array(record.states)[:, :4] == pytest.approx(
            np.array(plain.states)[:, :4], rel=1e-6, abs=1e-6
        )
        assert sorted(far.values())[1] < 0.03
    if name in MECHANICAL:
        assert far["supply_pressure"] < 0.05


def test_names_are_those_of_the_catalogue():
    # a tank feeds the rig, only a valve empties it, no gas has a thermometer, no arm a load cell;
    # the others are newer than the plans, whose cases stay the same
    lacking = {"supply_regulator_deadband", "com_offset", "sensor_lag", "parameter_drift"}
    lacking |= {"thermometer_lag", "supply_regulator_delay", "supply_regulator_slew"}
    lacking |= {"line_flow_law", "gauge_drift", "load_cell_drift"}
    assert set(LISTED) == set(CATALOGUE) - lacking
    assert len(UNLISTED) >= 6
    assert not set(LISTED) & set(UNLISTED)
    assert all(
        TYPES[name].id == name and TYPES[name].graded and TYPES[name].block for name in TYPES
    )


def test_integrator_is_accurate():
    assert against_fine(BARE, 4.0) < 1.0e-7
    # states of every kind: gas temperature, friction, spool, swing
    effects = Effects(
        *(effect_of(n) for n in ("heat_transfer", "muscle_hysteresis", "payload_swing"))
    )
    assert against_lsoda(Plant(PAR, effects), 1.5) < 1.0e-5


def test_swinging_payload_obeys_the_double_pendulum():
    swing = PayloadSwing(share=0.4, length=0.3, drag=0.0, loss=0.0)
    plant = Plant(PAR, Effects(swing))
    angle, rate, phi, spin, torque = 0.7, 0.5, 0.2, -0.8, 12.0
    inertia, weight = (
        PAR.inertia + PAR.payload * PAR.length**2,
        (PAR.first_moment + PAR.payload * PAR.length) * PAR.gravity,
    )
    d = [0.0] * plant.size
    alpha = swing.motion(plant.env, 4)(
        torque, angle, rate, inertia, weight, [0.0, 0.0, angle, rate, phi, spin], d
    )
    mass, lever = 0.4 * PAR.payload, 0.4 * PAR.payload * PAR.length * 0.3
    c, s = math.cos(angle - phi), math.sin(angle - phi)
    assert inertia * alpha + lever * (d[5] * c + spin**2 * s) + weight * math.sin(
        angle
    ) == pytest.approx(torque)
    hanging = (
        mass * 0.3**2 * d[5]
        + lever * (alpha * c - rate**2 * s)
        + mass * PAR.gravity * 0.3 * math.sin(phi)
    )
    assert hanging == pytest.approx(0.0, abs=1e-9)


def test_full_heat_transfer_conserves_gas():
    plant = Plant(PAR, Effects(effect_of("heat_transfer")))
    y, step = plant.rest(14.0e5), 1.0e-3

    def mass(state):
        return (
            state[0]
            * (plant.tables.at(state[2])[2] + PAR.dead_volume)
            / (PAR.gas_constant * state[4])
        )

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


def test_delay_shifts_the_command():
    lag = replace(effect_of("input_path_lag"), pure=0.0125, lag=0.0)
    path = CommandPath(Plant(PAR, Effects(lag)))
    sent = [path.spans(5.0 + (0.5 if i == 0 else 0.0), 0.005 * i) for i in range(5)]
    opened = [(i, x, span) for i, spans in enumerate(sent) for x, span in spans if abs(x) > 0.05]
    assert opened[0][0] == 2
    assert opened[0][2] == pytest.approx(0.0025)
    assert sum(span for _, _, span in opened) == pytest.approx(0.005)


def test_memory_starts_where_the_arm_is():
    at = Start(1.0e5, 14.0e5, 0.3, 0.012, 20.0)
    for name in TYPES:
        effect = effect_of(name)
        assert len(effect.start(at)) == len(effect.sizes())


@pytest.mark.parametrize(
    "law", [lambda f: 7.0 * f, lambda f: 40.0 * f**0.5, lambda f: 12.0 * f / (1.0 + f) + f**2]
)
@pytest.mark.parametrize("target", STRENGTHS.values())
def test_aim_finds_the_size(law, target):
    factor, found, kept = aim(lambda f: (law(f), f), target, 1.0e6)
    assert found == pytest.approx(target, rel=0.1)
    assert kept == factor
    assert found == law(factor)


def test_aim_stops_at_what_is_physical():
    factor, found, _ = aim(lambda f: (f, None), 10.0, 4.0)
    assert (factor, found) == (4.0, 4.0)


RECORDINGS = (("multisine", "fit"), ("open_cycles", "fit"), ("angle_steps", "held_out"))


@pytest.mark.parametrize(
    ("kind", "label", "measure"),
    [
        ("leak_muscle", "medium", "reach"),
        ("payload_swing", "strong", "reach"),
        ("muscle_hysteresis", "weak", "left"),
    ],
)
def test_wanted_multiple_is_met(kind, label, measure):
    key = json.loads(
        generate(Spec("c", kind, 3, RECORDINGS, 6.0, (label,), measure=measure), default_rig()).key
    )
    found = key["reach" if measure == "reach" else "reach_left"]
    assert found == pytest.approx(STRENGTHS[label], rel=0.3)
    assert key["reach_left"] <= key["reach"] * 1.05
    assert key["reach_channel"] in CHANNELS
    top = max(max(r["reach"].values()) for r in key["recordings"].values() if r["role"] == "fit")
    assert key["reach"] == pytest.approx(top)


def test_a_shift_of_a_parameter_leaves_little():
    # 0.8 tolerances more payload is what the refit can absorb; the same plant with a leak is not
    spec = Spec("c", "none", 4, RECORDINGS[:2], 8.0)
    bench = concealed._Bench(spec, MODEL, TOLERANCE, BARE, NOISE)
    changed = {k: dict(v) for k, v in MODEL.items()}
    changed["arm"]["payload"] += 0.8 * TOLERANCE["arm.payload"]
    heavy = concealed._Bench(spec, changed, TOLERANCE, BARE, NOISE).measure(Effects())
    as_effect = {i: (r, r.clean - follow(BARE, r, i)) for i, (r, _) in heavy.items()}
    raw = bench.most_moved(as_effect)[1]
    assert raw > 5.0
    assert bench.left(as_effect) < 0.2 * raw


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


def test_full_plan():
    found = kinds("full", np.random.default_rng(1))
    assert len(found) >= 300
    assert sum(k == "none" for k, _ in found) == sum(k == "parameters" for k, _ in found) == 30
    for name in LISTED:
        assert sorted(label for k, (label,) in (f for f in found if f[0] == name)) == sorted(
            [*STRENGTHS] * 3
        )
    pairs = [k.split("+") for k, _ in found if "+" in k]
    assert len(pairs) == 30
    assert all(TYPES[a].block != TYPES[b].block for a, b in pairs)
    assert sum(k in UNLISTED for k, _ in found) == 3 * len(UNLISTED)
    made = specs("full", 2)
    assert len({s.seed for s in made}) == len({s.name for s in made}) == len(made)
    assert [s.kind for s in made] != [k for k, _ in found]
    for spec in made:
        roles = dict(spec.recordings)
        assert 3 <= len(roles) <= 5
        assert "open_cycles" in roles
        assert {"fit", "held_out"} == set(roles.values())
    # a part of the plan has the same cases
    assert specs("full", 2, 20) == made[:20]


def test_small_plan_is_fixed():
    assert len(specs("small", 1)) == 12
    assert specs("small", 1) == specs("small", 1)
    assert specs("small", 1) != specs("small", 2)


@pytest.fixture
def two():
    cut = [s for s in specs("small", 7, duration=3.0) if s.kind in ("none", "pressure_lag")]
    return [replace(s, recordings=RECORDINGS) for s in cut]


def test_plan_goes_on_where_it_stopped(two, tmp_path):
    made = []
    manifest = write_plan(tmp_path, two[:1], progress=lambda *a: made.append(a))
    write_plan(tmp_path, two, progress=lambda *a: made.append(a))
    assert made == [(two[0].name, 1, 1), (two[1].name, 2, 2)]
    before = {p: p.read_bytes() for p in tmp_path.rglob("*") if p.is_file()}
    (tmp_path / "cases" / two[1].name / "multisine.csv").unlink()
    (tmp_path / "keys" / f"{two[0].name}.json").write_text("{}")
    write_plan(tmp_path, two, progress=lambda *a: made.append(a))
    assert [a[0] for a in made[2:]] == [two[0].name, two[1].name]
    assert {p: p.read_bytes() for p in tmp_path.rglob("*") if p.is_file()} == before
    digests = json.loads(manifest.read_text())["keys"]
    for spec in two:
        content = (tmp_path / "keys" / f"{spec.name}.json").read_bytes()
        assert digests[spec.name] == hashlib.sha256(content).hexdigest()
        folder = tmp_path / "cases" / spec.name
        assert (folder / "case.toml").is_file()
        # nothing in the case tells what is concealed
        told = "".join(p.read_text() for p in folder.iterdir() if p.name != "rig.toml")
        assert not any(name in told for name in TYPES)


def test_digest_is_published_before_the_case(two, tmp_path, monkeypatch):
    seen = []

    def store(case, out):
        seen.append(
            json.loads((tmp_path / "manifest.json").read_text())["keys"][case.name] == case.digest()
        )
        assert not (out / case.name).exists()

    monkeypatch.setattr(plan, "store", store)
    write_plan(tmp_path, two[:1])
    assert seen == [True]


def test_other_manifest_is_not_overwritten(two, tmp_path):
    (tmp_path / "manifest.json").write_text('{"schema": "other"}')
    with pytest.raises(ValueError, match="schema"):
        write_plan(tmp_path, two[:1])


def test_wrong_arguments_are_named(tmp_path):
    with pytest.raises(ValueError, match="unknown plan"):
        kinds("huge", np.random.default_rng(1))
    with pytest.raises(ValueError, match="given twice"):
        Effects(effect_of("leak_muscle"), effect_of("leak_muscle"))
    with pytest.raises(ValueError, match="two effects at the port 'motion'"):
        Plant(PAR, Effects(effect_of("payload_swing"), effect_of("base_flexibility")))
    with pytest.raises(ValueError, match="strength must be one of"):
        concealed.make_case(tmp_path, tmp_path / "k", "none", seed=1, wanted="huge")


def test_open_loop_commands_do_not_depend_on_the_plant():
    made = [prepare(BARE, "open_cycles", 6.0, np.random.default_rng(2)) for _ in range(2)]
    assert isinstance(made[0][0], Excitation)
    assert np.array_equal(made[0][2], made[1][2])
    record, _ = moved(Effects(effect_of("leak_muscle", 5.0)), made[0])
    assert np.array_equal(record.command, made[0][2])
