"""The antagonistic pair of the trial: its plant, its recordings, its cases and its scores."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest

import pamrs
from trial.bench import Bench
from trial.cases import _truths, make
from trial.concealed import store
from trial.design import PAIRS, ROUND, Spec, possible, specs
from trial.drive import FREE
from trial.effects import Effects, Setting, draw
from trial.effects.chamber import Leak
from trial.effects.sensors import PressureLag
from trial.effects.valve import InputLag
from trial.errors import KINDS, pair_errors, stated_lines
from trial.families import BY_LABEL, KNOWN, LATER, OTHER
from trial.inserted import truth_of
from trial.labs import Lab, noise_of
from trial.marks import covered, mark
from trial.pair.bench import PairBench
from trial.pair.course import FIT, HELD, PairDriver
from trial.pair.places import BOTH, PLACES, SIDES, Placed, has_place
from trial.pair.plant import PairPlant, pair_parameters
from trial.pair.recording import CHANNELS, PairPath
from trial.plant import Plant
from trial.pooled import page, pooled
from trial.rig_kinds import PAIR, RIGS, nominal, nominal_pair, stated
from trial.selfcheck import against_lsoda
from trial.tables import markdown, scores, to_json
from trial.tests import test_cases as cases
from trial.tests.test_cases import again, group

MODEL, TOLERANCE = stated(PAIR)
PAR = pair_parameters(MODEL)
RIG = RIGS[PAIR]
LEAK = Leak("laminar", 2.0e-16)
EXACT = {"pressure": 0.01, "angle": 1.0e-9, "pressure_step": 1.0, "angle_step": 1.0e-7}


def spec_of(*names, lab=None, rig=PAIR, duration=4.0, **more):
    roles = tuple((name, "fit") for name in names)
    return replace(Spec("case_0001", 5, rig, lab or Lab(200, 16), roles, duration), **more)


def bench_of(spec, **noise):
    made = noise_of(spec.lab, RIGS[spec.rig], np.random.default_rng(6))
    kind, (model, tolerance) = PairBench if spec.rig == PAIR else Bench, stated(spec.rig)
    return kind(spec, model, tolerance, replace(made, **noise))


# ------------------------------------------------------------------------------------- plant


@pytest.mark.parametrize("name", [*FIT, *HELD, FREE])
def test_every_course_is_that_of_the_package(name, tmp_path):
    """Nominal values and no effect; both valves move, and the joint with them."""
    spec = spec_of(name, duration=8.0)
    record = bench_of(spec, **EXACT).run(())[0]
    assert (np.ptp(record.command, axis=0) > 0.3).all()
    assert (np.ptp(record.clean[:, [0, 1]], axis=0) > 0.2e5).all()
    assert record.clean.shape[1] == len(CHANNELS)
    errors = again(record, RIG, tmp_path, spec.lab)
    assert set(errors) == set(CHANNELS)
    assert max(errors.values()) < 1.0e-3
    assert errors["joint_angle.elbow"] < 5.0e-5


def test_the_driver_holds_a_reference_at_a_level():
    plant = nominal_pair()
    pressures = plant.holding(1.0, 2.0e5)
    assert np.mean(pressures) == pytest.approx(2.0e5)
    absolute = tuple(p + PAR.ambient for p in pressures)
    y = plant.initial(absolute, 8.0e5, 1.0, 0.0, 0.0)
    assert plant.derivative(y, (0.0, 0.0))[4] == pytest.approx(0.0, abs=1.0e-9)
    driver = PairDriver(plant, RIG, 0.005, np.random.default_rng(1))
    spec = spec_of("slow_triangle", duration=12.0)
    record = bench_of(spec).run(())[0]
    course = bench_of(spec).drives[0][0]
    driver.reset()
    off = np.degrees(course.reference - record.clean[:, 3])[600:]
    assert np.sqrt((off**2).mean()) < 8.0


def test_two_equal_sides_mirror_each_other():
    """What the flexor does to the arm one way the extensor does the other way."""
    model = {k: dict(v) if isinstance(v, dict) else v for k, v in MODEL.items()}
    for block in ("valve", "chamber", "muscle"):
        model[f"{block}.extensor"] = model[f"{block}.flexor"]
    pull = model["transmission.flexor"]
    model["transmission.extensor"] = {
        **pull, "radius": -pull["radius"], "rest_angle": -pull["rest_angle"],
    }  # fmt: skip
    plant = PairPlant(pair_parameters(model), (Placed(LEAK, "flexor"),))
    other = PairPlant(pair_parameters(model), (Placed(LEAK, "extensor"),))
    # a weight pulls an angle and its negative the opposite ways as well
    y = plant.initial((3.0e5, 4.5e5), 7.0e5, 0.3, 0.2, 0.0)
    z = other.initial((4.5e5, 3.0e5), 7.0e5, -0.3, -0.2, 0.0)
    # the stop at zero is one-sided: leave it out
    for p in (plant, other):
        p.par.flexor.joint.update(min_angle=-2.0, max_angle=2.0)
    plant, other = PairPlant(plant.par, plant.effects), PairPlant(other.par, other.effects)
    step = [1.0e-3, 1.0e-3]
    for i in range(40):
        x = (0.3 * math.sin(0.7 * i), 0.2 * math.cos(0.4 * i))
        y, step[0] = plant.advance(y, x, 0.02, step[0])
        z, step[1] = other.advance(z, (x[1], x[0]), 0.02, step[1])
    assert [z[1], z[0], z[2], -z[3], -z[4]] == pytest.approx(y[:5], rel=1.0e-6)
    assert abs(y[0] - y[1]) > 1.0e4


@pytest.mark.parametrize("side", SIDES)
def test_a_leak_acts_at_its_side_only(side):
    bare, leaky = nominal_pair(), PairPlant(PAR, (Placed(LEAK, side),))
    y = bare.rest(8.0e5)
    before, after = (p.derivative(y, (0.1, 0.1)) for p in (bare, leaky))
    own, other = (0, 1) if side == "flexor" else (1, 0)
    assert after[own] < before[own] - 100.0
    assert after[other] == before[other]
    both = PairPlant(PAR, (Placed(LEAK, BOTH),)).derivative(y, (0.1, 0.1))
    assert both[own] == after[own]
    assert both[other] < before[other] - 100.0


def test_places_are_checked():
    assert Placed(LEAK, BOTH).sides == SIDES
    with pytest.raises(ValueError, match="leak_muscle at '' is not allowed"):
        Placed(LEAK)
    with pytest.raises(ValueError, match="payload_change at 'flexor' is not allowed"):
        Placed(draw("payload_change", 1.0, np.random.default_rng(1)), "flexor")


def test_one_valve_may_be_late():
    plant = PairPlant(PAR, (Placed(InputLag(0.007, 0.0, 0.1), "extensor"),))
    path = PairPath(plant, 0.005)
    found = [path.spans((5.0 + 0.1 * i, 5.0 + 0.1 * i), 0.005 * i) for i in range(5)]
    for i, spans in enumerate(found[2:], 2):
        assert sum(span for _, span in spans) == pytest.approx(0.005)
        assert [x for (x, _), _ in spans] == pytest.approx([0.02 * i] * 2)
        # the extensor's opening is that of 7 ms ago: it changes 2 ms after the sample
        assert [x for (_, x), _ in spans] == pytest.approx([0.02 * (i - 2), 0.02 * (i - 1)])
        assert spans[0][1] == pytest.approx(0.002)


def test_a_late_gauge_reads_its_own_side():
    lag = PressureLag(0.05, 2.5e5)
    plant = PairPlant(PAR, (Placed(lag, "extensor"),))
    y, step = plant.rest(8.0e5), 1.0e-3
    for _ in range(10):
        y, step = plant.advance(y, (0.2, 0.2), 0.005, step)
    flexor, extensor, _, _ = plant.reading(y)
    assert flexor == pytest.approx(y[0] - PAR.ambient)
    assert extensor < y[1] - PAR.ambient - 1.0e3


# ---------------------------------------------------------------- families of later plans


@pytest.mark.parametrize("form", [f for f in LATER if f.mark == KNOWN], ids=lambda f: f.label)
def test_known_forms_are_those_of_the_catalogue(form, tmp_path):
    """With its true values as the key tells them pamrs repeats the recording."""
    spec = spec_of("multisine", "slow_triangle", rig="elbow", duration=6.0)
    bench = bench_of(spec, **EXACT)
    effect = form.draw(np.random.default_rng(4), Setting(2, 6.0))
    plain, records = bench.run(()), bench.run((effect,))
    truth = form.truths(effect, bench.par)
    usual = {"form": "straight"} if form.name == "straight" else {}
    known = pamrs.load_rig(RIGS["elbow"].path).with_effect(form.family, truth, **usual)
    for i, record in records.items():
        errors = again(record, RIGS["elbow"], tmp_path, spec.lab, known)
        without = again(record, RIGS["elbow"], tmp_path, spec.lab)
        assert errors["joint_angle"] < 3.0e-3
        assert without["joint_angle"] > 3.0 * errors["joint_angle"]
        assert np.abs(record.clean - plain[i].clean).max() > 0.0


@pytest.mark.parametrize("form", [f for f in LATER if f.mark == OTHER], ids=lambda f: f.label)
def test_other_forms_run_on_both_plants(form):
    effect = form.draw(np.random.default_rng(4), Setting(1, 6.0))
    assert against_lsoda(Plant(nominal("elbow")[2].par, Effects(effect)), 1.0) < 1.0e-5
    placed = Placed(effect, BOTH if has_place(form.family, form.block) else "")
    assert against_lsoda(PairPlant(PAR, (placed,)), 1.0) < 1.0e-5
    bench = bench_of(spec_of("multisine", duration=4.0))
    moved = bench.against(bench.run((placed.scaled(3.0),)), MODEL)[0][1]
    assert np.sqrt((moved**2).mean(axis=0) / bench.floor**2)[3] > 0.3


@pytest.mark.parametrize("name", ["shoulder", "hanging_mass", "regulated_joint", PAIR])
def test_later_families_run_on_every_rig_that_has_them(name):
    rig, bench = RIGS[name], bench_of(spec_of("multisine", rig=name, duration=1.0))
    forms = [f for f in LATER if possible(f, rig, Lab(200, 16))]
    assert {f.family for f in forms} | set(rig.without) >= {f.family for f in LATER}
    for form in forms:
        drawn = form.draw(np.random.default_rng(4), Setting(1, 1.0))
        place = "flexor" if has_place(form.family, form.block) else ""
        effect = Placed(drawn, place) if name == PAIR else drawn
        assert np.isfinite(bench.run((effect.scaled(min(5.0, effect.most())),))[0].clean).all()


# ------------------------------------------------------------------------------------- cases


def test_the_plan_of_pairs():
    found = specs(7, 3 * ROUND, plan=PAIRS)
    assert specs(7, 4, plan=PAIRS) == found[:4]
    assert {s.rig for s in found} == {PAIR}
    at = [place for s in found for place in s.places]
    assert set(at) == {*PLACES, ""}
    for s in found:
        for form, place in zip((BY_LABEL[f] for f in s.forms), s.places, strict=True):
            assert bool(place) == has_place(form.family, form.block)
    names = {name for s in found for name, _ in s.wrong}
    assert {"valve.flexor.discharge_area_max", "muscle.extensor.modulus_scale"} <= names
    for s in found:
        for name, z in s.wrong:
            section, _, key = name.rpartition(".")
            value = MODEL[section][key] + z * TOLERANCE[name]
            assert value >= 0.29 * MODEL[section][key]


def test_each_side_has_curves_of_its_own():
    made = pair_errors(RIG, 1.0, PAR.weight, np.random.default_rng(2))
    assert {type(e.effect) for e in made} == set(KINDS)
    force = [e for e in made if e.id == "model_error.muscle"]
    assert [e.at for e in force] == list(SIDES)
    assert force[0].effect.curve != force[1].effect.curve
    assert [e.at for e in made if e.id == "model_error.arm"] == [""]
    lines = stated_lines(RIG, made, 1.0)
    assert lines.count("muscle = ") == 1
    assert 'transmission = "1 %"' in lines


@pytest.fixture(scope="module")
def case():
    lab = Lab(100, 16, dropouts=True)
    recordings = (("multisine", "fit"), ("antagonistic_steps", "held_out"))
    forms = ("leak_muscle/laminar", "joint_end_stop/progressive")
    spec = spec_of(lab=lab, forms=forms, strength=10.0, percent=1, stated=True)
    return make(replace(spec, places=("extensor", ""), recordings=recordings, plan=PAIRS))


def test_a_case_tells_where_its_effects_act_and_loads(case, tmp_path):
    key = json.loads(case.key)
    leak, stop = key["effects"]
    assert (leak["at"], "at" in stop) == ("extensor", False)
    assert leak["reached"] == pytest.approx(10.0, rel=0.16)
    assert key["plan"] == PAIRS
    assert {"muscle.flexor", "muscle.extensor", "arm"} <= set(key["model_error"]["sizes"])
    term = next(t for t in key["terms"] if t["id"] == "leak_muscle")
    assert term["left"]["muscle_pressure.extensor"] > 2.0 * term["left"]["muscle_pressure.flexor"]
    assert term["share"] > 0.5
    assert truth_of(key) == "leak_muscle@extensor+joint_end_stop"
    store(case, tmp_path)
    loaded = pamrs.load_case(tmp_path / "case_0001")
    assert loaded.rig.model_error["transmission"]
    wanted = {*CHANNELS, "valve_command.flexor", "valve_command.extensor"}
    assert set(loaded.recordings[0].channels) == wanted


def test_truths_at_both_sides_are_those_that_are_alike():
    spec = spec_of("multisine", duration=0.5)
    bench = bench_of(spec)
    form = BY_LABEL["muscle_creep/one_branch"]
    drawn = form.draw(np.random.default_rng(1), Setting(1, 1.0))
    told = {at: _truths(form, Placed(drawn, at), bench) for at in PLACES}
    # one value of a muscle's stiffness cannot be that of two muscles and of one
    assert told["flexor"]["stiffness"] == drawn.stiffness / 2.0
    assert told["extensor"]["stiffness"] == drawn.stiffness
    assert told[BOTH] == {"time_constant": drawn.time_constant[0]}


def test_wrong_parameters_of_named_blocks():
    wrong = (("valve.flexor.discharge_area_max", 12.0),)
    key = json.loads(make(spec_of("multisine", lab=Lab(100, 16), wrong=wrong)).key)
    entry = key["wrong_parameters"]["valve.flexor.discharge_area_max"]
    assert entry["value"] - entry["nominal"] == pytest.approx(12.0 * 1.5e-7)
    (term,) = key["terms"]
    assert (term["block"], term["at"]) == ("chamber", "flexor")
    assert max(term["left"].values()) > 3.0


# ------------------------------------------------------------------------------------ scores


def result_of(*named, share=0.9):
    """Effects as id and place, and a healthy chamber beside the other one."""
    terms = [f"{name}@{at}" if at else name for name, at in named]
    sides = [at or "extensor" for _, at in named]
    groups = []
    for side in SIDES:
        own = [t for t, s in zip(terms, sides, strict=True) if s == side]
        groups.append(group([f"chamber.{side}"], "effects" if own else "none", own))
    budget = [
        {"block": f"chamber.{side}", "kind": "effect", "id": name, "share": share}
        for (name, _), side in zip(named, sides, strict=True)
    ]
    said = cases.result_of("effects" if named else "none", groups=groups, budget=budget)
    effects = [
        {"id": name, **({"at": at} if at else {}), "probability": 0.9, "parameters": {}}
        for name, at in named
    ]
    return said | {"effects": effects, "probabilities": {"+".join(terms) or "none": 0.9}}


@pytest.mark.parametrize(
    ("named", "leading", "placed"),
    [
        ((("leak_muscle", "extensor"),), True, True),
        ((("leak_muscle", "flexor"),), True, False),
        ((("leak_muscle", ""),), True, False),
        ((("heat_transfer", "extensor"),), False, None),
        ((), False, None),
    ],
)
def test_the_name_counts_and_its_place_apart(case, named, leading, placed):
    key = json.loads(case.key)
    found = mark(key, result_of(*named))
    assert (found.leading, found.placed) == (leading, placed)
    assert found.tags["place"] == ("extensor",)
    if named == (("leak_muscle", "extensor"),):
        assert [(b.block, b.leading) for b in found.blocks] == [
            ("chamber", None),
            ("chamber", True),
        ]
        assert found.claims == ((0.9, True), (0.9, True))
        assert found.shares[0] is True
        assert found.said == "leak_muscle at extensor"
    assert mark(key, None).placed is None


def test_both_sides_are_one_name_without_a_place_or_two_with(case):
    key = json.loads(case.key)
    key["effects"][0]["at"] = BOTH
    two = result_of(("leak_muscle", "flexor"), ("leak_muscle", "extensor"))
    assert mark(key, two).placed is True
    assert mark(key, result_of(("leak_muscle", ""))).placed is True
    assert mark(key, result_of(("leak_muscle", "flexor"))).placed is False


def test_blocks_of_a_pair():
    assert covered(["chamber.flexor"]) == {"chamber", "chamber.flexor"}
    assert {"chamber.flexor", "chamber.extensor"} <= covered(["valve"])
    assert covered(["arm.elbow"]) == {"arm"}


def test_places_in_the_tables(case, tmp_path):
    key = json.loads(case.key)
    found = [mark(key, result_of(("leak_muscle", at))) for at in ("extensor", "flexor")]
    told = scores(found)
    assert told["places"]["extensor"]["hits"] == 1
    assert told["places"]["extensor"]["n"] == 2
    text = markdown(told)
    assert "## Places of right names" in text
    assert "### By place" in text
    assert "place wrong" in text
    (tmp_path / "pair.json").write_text(to_json(told))
    trials = pooled([tmp_path / "pair.json"])
    assert [m.placed for m in trials["pair"]] == [True, False]
    assert "## Places of right names" in page(trials)
