"""The plans of the trial: their design, its cases, its forms and its scores."""

import hashlib
import json
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

import pamrs
from pamrs.effects import CATALOGUE
from pamrs.simulation import replay
from trial.__main__ import main
from trial.bench import Bench, search
from trial.cases import SCHEMA, bench_of, complete, make
from trial.concealed import store
from trial.design import PERCENTS, PLANS, ROUND, SECOND, STRENGTHS, THIRD, Spec, specs
from trial.effects import LISTED, Effects, Setting
from trial.errors import KINDS, model_errors
from trial.families import BY_LABEL, FORMS, KNOWN, LATER, LIMITS, MARKS, OTHER, UNLISTED, most
from trial.labs import BITS, MISSING, RATES, Lab, noise_of, table
from trial.marks import NAMED_SINCE, mark, place
from trial.plant import Plant
from trial.rig_kinds import PAIR, RIGS, nominal, parameters_of, stated
from trial.tables import markdown, measures, scores, targets, to_json

MODEL, TOLERANCE, SHOULDER = nominal("shoulder")
SETTING = Setting(recordings=1, duration=6.0)
QUICK = Lab(100, 16)
#: of the specs of 72 cases of the second plan, seed 11501
DIGEST = "dfd979b03d87580cc38fe844648ffe672eddccf69a41ffb964df8b8ae693d821"


@pytest.fixture(scope="module")
def plan():
    return specs(7, 2 * ROUND)


def spec_of(rig="blow_down", **more):
    names = (("multisine", "fit"), ("lift_hold", "held_out"))
    return replace(Spec("case_0001", 5, rig, QUICK, names, 6.0), **more)


# ------------------------------------------------------------------------------------ design


def test_a_case_is_the_same_however_many_are_made(plan):
    assert specs(7, 5) == plan[:5]
    assert specs(7, ROUND) == plan[:ROUND]
    assert specs(8, 5) != plan[:5]
    assert len({s.seed for s in plan}) == len(plan)


def test_the_second_plan_stays_as_it_was():
    """Its manifests are published. Numbers are rounded: the last bit of an exponential is that of a
    machine's library.
    """
    every = json.dumps([s.to_dict() for s in specs(11501, 3 * ROUND)])
    rounded = json.loads(every, parse_float=lambda text: float(f"{float(text):.9g}"))
    told = json.dumps(rounded, sort_keys=True)
    assert hashlib.sha256(told.encode()).hexdigest() == DIGEST
    assert {s.rig for s in specs(11501, ROUND)} == set(RIGS) - {PAIR}


def test_the_third_plan_has_every_rig_and_family():
    found = specs(7, 10 * ROUND, plan=THIRD)
    assert found[:5] == specs(7, 5, plan=THIRD)
    assert {s.rig for s in found[:ROUND]} == set(RIGS)
    families = {BY_LABEL[f].family for s in found for f in s.forms}
    assert {f.family for f in LATER} <= families
    assert all(s.to_dict()["plan"] == THIRD for s in found)
    assert {f.label for f in PLANS[THIRD].forms} == set(BY_LABEL)
    assert not {f.family for f in LATER} & {f.family for f in PLANS[SECOND].forms}


def test_one_round_has_every_stratum(plan):
    for found in (plan[:ROUND], plan[ROUND:]):
        marks = Counter(BY_LABEL[f].mark for s in found for f in s.forms[:1])
        assert set(marks) == set(MARKS)
        assert Counter(len(s.forms) for s in found) == {0: 7, 1: 14, 2: 1, 3: 1, 4: 1}
        assert {s.percent for s in found} == set(PERCENTS)
        assert {s.rig for s in found} == set(PLANS[SECOND].rigs)
        assert {s.lab.rate for s in found} == set(RATES)
        assert {s.lab.bits for s in found} == set(BITS)
        assert {s.lab.missing for s in found} == {"", *MISSING}
        assert {s.lab.one for s in found} == {s.lab.dropouts for s in found} == {True, False}
        assert {bool(s.wrong) for s in found if s.forms} == {True, False}
        assert sum(not s.forms and not s.wrong for s in found) == 4
    assert {s.strength for s in plan if s.forms} == set(STRENGTHS)


def test_specs_are_possible(plan):
    for s in plan:
        rig = RIGS[s.rig]
        assert all(BY_LABEL[f].block in rig.blocks for f in s.forms)
        assert len({BY_LABEL[f].family for f in s.forms}) == len(s.forms)
        for name, z in s.wrong:
            model, tolerance, _ = nominal(s.rig)
            section, key = name.split(".")
            assert 4.0 <= abs(z) <= 15.0
            assert model[section][key] + z * tolerance[name] >= 0.29 * model[section][key]
        roles = [role for _, role in s.recordings]
        assert roles == ["fit"] if s.lab.one else {"fit", "held_out"} == set(roles)
        assert s.duration * s.lab.rate <= 12_000


# ------------------------------------------------------------------------------------- forms


def test_marks_of_the_forms():
    assert len(BY_LABEL) == len(FORMS) + len(LATER)
    for form in (*FORMS, *LATER):
        assert (form.family in CATALOGUE.keys() - NAMED_SINCE) == (form.mark != UNLISTED)
        assert not (form.first and form.mark != KNOWN)
    families = {m: {f.family for f in FORMS if f.mark == m} for m in MARKS}
    assert families[OTHER] <= families[KNOWN] == set(LISTED)
    assert len(families[OTHER]) >= 20
    assert set(LIMITS) <= families[KNOWN] | families[UNLISTED]


def test_other_forms_are_not_the_known_ones():
    """A form of the same class differs in a field that scaling does not touch."""
    for family in {f.family for f in FORMS if f.mark == OTHER}:
        kinds = {m: [f for f in FORMS if f.family == family and f.mark == m] for m in MARKS}
        for other in kinds[OTHER]:
            one = other.draw(np.random.default_rng(3), SETTING)
            for known in kinds[KNOWN]:
                two = known.draw(np.random.default_rng(3), SETTING)
                fixed = [k for k in one.to_dict() if k not in one.graded]
                assert type(one) is not type(two) or any(
                    one.to_dict()[k] != two.to_dict()[k] for k in fixed
                ), (other.label, known.label)


def test_truths_are_parameters_of_the_catalogue():
    for form in (*FORMS, *LATER):
        if form.truths:
            effect = form.draw(np.random.default_rng(4), SETTING)
            told = form.truths(effect, SHOULDER.par)
            listed = CATALOGUE[form.family].parameters
            names = {getattr(p, "name", p) for p in listed}
            assert set(told) <= names, form.label
            assert all(np.isfinite(v) for v in told.values())


@pytest.fixture(scope="module")
def bench():
    names = (("multisine", "fit"),)
    spec = replace(spec_of("shoulder"), recordings=names, duration=2.0)
    noise = noise_of(QUICK, RIGS["shoulder"], np.random.default_rng(1))
    return Bench(spec, MODEL, TOLERANCE, noise)


OWN = [
    f
    for f in (*FORMS, *LATER)
    if f.draw(np.random.default_rng(1), SETTING).__module__.endswith(("forms", "later"))
]


@pytest.mark.parametrize("form", OWN, ids=lambda f: f.label)
def test_a_form_of_no_size_changes_nothing(form, bench):
    effect = form.draw(np.random.default_rng(5), SETTING)
    assert Plant(SHOULDER.par, Effects(effect.scaled(0.0))).size == 4
    assert most(effect) > 1.0
    # two of them begin to act at larger angles than two seconds reach
    # and moduli take more than two seconds to drift
    late = form.name in ("seal", "sliding") or form.family == "parameter_drift"
    least = 0.0 if late else 0.3
    for size, low, high in ((1.0e-6, 0.0, 0.1), (3.0, least, 1e9)):
        _, moved = bench.against(bench.run([effect.scaled(size)]), MODEL)[0]
        assert low <= np.sqrt((moved**2).mean(axis=0) / bench.floor**2).max() < high


def test_model_error_is_in_every_block(bench):
    made = model_errors(RIGS["shoulder"], 1.0, 98.0, np.random.default_rng(2))
    assert {type(e) for e in made} == set(KINDS)
    three = model_errors(RIGS["shoulder"], 3.0, 98.0, np.random.default_rng(2))
    assert [e.rms for e in three] == pytest.approx([3.0 * e.rms for e in made])
    place = np.linspace(0.0, 3.0, 500)
    for error in three:
        wave = np.array([error.curve.at(x * 40.0 * np.pi / min(error.curve.wave)) for x in place])
        assert wave.std() == pytest.approx(error.rms, rel=0.25)
    assert not model_errors(RIGS["shoulder"], 0.0, 98.0, np.random.default_rng(2))
    air = {e.id.split(".")[1] for e in model_errors(RIGS["chamber"], 1.0, 0.0, bench_rng())}
    assert air == {"valve", "chamber", "supply", "muscle_pressure"}
    records = bench.run(made)
    assert max(bench.left(bench.against(records, MODEL)).values()) > 1.0


def bench_rng():
    return np.random.default_rng(6)


# ------------------------------------------------------------------------------------- cases


def again(record, rig, path, lab, known=None, rest=0.0):
    """How far pamrs is from a recording that it repeats from its first values, over the range of
    each channel.
    """
    text, channels = table(record, rig, lab, [], rest)
    (path / "one.csv").write_text(text)
    recording = pamrs.load_recording(path / "one.csv")
    simulated = replay(known or pamrs.load_rig(rig.path), recording)
    found = {}
    for name in (name for name in channels if "command" not in name):
        true = recording.channels[name]
        off = np.abs(np.asarray(simulated[name]) - true).max()
        found[name] = off / (np.ptp(true) + 1.0e-9)
    return found


@pytest.mark.parametrize("name", RIGS)
def test_the_plant_of_every_rig_is_that_of_the_package(name, tmp_path):
    """Nominal values and no effect: pamrs repeats the recording from its first values."""
    model, tolerance = stated(name)
    rig, lab = RIGS[name], Lab(200, 16)
    spec = replace(spec_of(name), lab=lab, duration=3.0)
    noise = replace(noise_of(lab, rig, bench_rng()), pressure=0.01, angle=1.0e-9)
    fine = bench_of(spec, model, tolerance, replace(noise, pressure_step=1.0, angle_step=1.0e-7))
    rest = model.get("muscle", {}).get("rest_length", 0.0)
    errors = again(fine.run(())[0], rig, tmp_path, lab, rest=rest)
    assert max(errors.values()) < 3.0e-3, errors


@pytest.mark.parametrize(
    ("rig", "forms"), [("blow_down", ("leak_muscle/laminar",)), ("chamber", ("supply_leak/slit",))]
)
def test_a_case_reaches_its_strength_and_loads(rig, forms, tmp_path):
    lab = Lab(50, 16, dropouts=True)
    spec = spec_of(rig, forms=forms, strength=10.0, percent=1, lab=lab, duration=4.0)
    case = make(spec)
    if rig == "blow_down":
        again = make(spec)
        assert (again.key, again.files) == (case.key, case.files)
    key = json.loads(case.key)
    assert key["schema"] == SCHEMA
    assert key["verdict"] == "effects"
    (effect,) = key["effects"]
    assert effect["reached"] == pytest.approx(10.0, rel=0.16)
    assert {"effect", "model_error"} == {t["kind"] for t in key["terms"]}
    assert key["model_error"]["sizes"]
    assert key["lost"]
    store(case, tmp_path)
    loaded = pamrs.load_case(tmp_path / spec.name)
    assert [r.role for r in loaded.recordings] == ["fit", "held_out"]
    assert any(not np.all(m) for r in loaded.recordings for m in r.mask.values())


def test_a_parameter_far_off_is_one_that_shows(tmp_path):
    # the tank's volume is taken up by other parameters, the valve's area is not
    wrong = (("supply.volume", 4.0), ("valve.discharge_area_max", 12.0))
    key = json.loads(make(spec_of("chamber", wrong=wrong)).key)
    assert list(key["wrong_parameters"]) == ["valve.discharge_area_max"]
    (term,) = key["terms"]
    assert (term["kind"], term["block"]) == ("parameter", "chamber")
    assert max(term["left"].values()) > 3.0
    assert key["verdict"] == "parameters"


def test_channels_that_nobody_logged():
    case = make(spec_of("hanging_mass", lab=replace(QUICK, missing="command"), duration=2.0))
    head = case.files["multisine.csv"].splitlines()[0]
    assert "command" not in head
    assert "length [mm]" in head
    gauge = make(spec_of("chamber", lab=replace(QUICK, missing="supply_pressure"), duration=2.0))
    assert "supply_pressure" not in gauge.files["multisine.csv"].splitlines()[0]


@pytest.mark.parametrize(
    ("power", "bound", "expected"), [(1.0, 1e6, 300.0), (0.5, 1e6, 300.0), (1.0, 20.0, 40.0)]
)
def test_search_reaches_strong_effects_or_their_bound(power, bound, expected):
    tried = []

    def reached(factor):
        tried.append(factor)
        return float("inf") if factor > 5.0e5 else 2.0 * factor**power

    factor, found = search(reached, 300.0, bound, 0.7)
    assert found == pytest.approx(expected, rel=0.15)
    assert factor <= bound
    with pytest.raises(ArithmeticError, match="can be run"):
        search(lambda _: float("inf"), 10.0, 1e6, 1.0)


def test_write_goes_on_and_publishes_the_keys(tmp_path, capsys, monkeypatch):
    # its first case is healthy and has no muscle
    def words(n):
        return ["write", str(tmp_path), "--cases", n, "--seed", "32", "--duration", "2"]

    with pytest.raises(SystemExit):
        main([*words("1"), "--plan", "full"])
    seen = []

    def stored(case, out):
        told = json.loads((tmp_path / "manifest.json").read_text())["keys"]
        seen.append(told[case.name] == case.digest() and not (out / case.name).exists())
        store(case, out)

    monkeypatch.setattr("trial.plan.store", stored)
    assert main(words("1")) == 0
    assert seen == [True], "the digest is there before the case"
    told = json.loads((tmp_path / "manifest.json").read_text())["keys"]
    key = (tmp_path / "keys" / "case_0001.json").read_bytes()
    assert told["case_0001"] == hashlib.sha256(key).hexdigest()
    (spec,) = specs(32, 1, 2.0)
    assert complete(tmp_path, spec, told)
    assert not complete(tmp_path, replace(spec, strength=77.0), told)
    before = {p: p.read_bytes() for p in tmp_path.rglob("*") if p.is_file()}
    assert main(words("1")) == 0
    assert len(seen) == 1, "what is there is not made again"
    (tmp_path / "keys" / "case_0001.json").write_text("{}")
    next((tmp_path / "cases" / "case_0001").glob("*.csv")).unlink()
    assert main(words("1")) == 0
    assert {p: p.read_bytes() for p in tmp_path.rglob("*") if p.is_file()} == before
    capsys.readouterr()
    place = ["--keys", str(tmp_path / "keys"), "--results", str(tmp_path / "results")]
    assert main(["score", *place, "--json", str(tmp_path / "s.json")]) == 0
    assert "## Targets" in capsys.readouterr().out
    assert json.loads((tmp_path / "s.json").read_text())["all"]["missing"] == 1
    (tmp_path / "manifest.json").write_text('{"schema": "other"}')
    assert main(words("1")) == 2
    assert "schema" in capsys.readouterr().err


# ------------------------------------------------------------------------------------ scores


def key_of(case, effects=(), wrong=(), percent=0, rig="shoulder", error=5.0):
    def entry(name, mark, block, reached=30.0):
        truth = {"conductance": 2.0} if name == "leak_muscle" else {}
        return {
            "id": name, "form": "x", "mark": mark, "first_catalogue": False, "block": block,
            "wanted": 30.0, "reached": reached, "catalogue_parameters": truth,
        }  # fmt: skip

    told = [entry(*e) for e in effects]
    channel = {"arm": "joint_angle", "chamber": "muscle_pressure", "supply": "supply_pressure"}
    terms = [
        {"block": e["block"], "kind": "effect", "id": e["id"], "share": 0.8,
         "left": {channel[e["block"]]: e["reached"]}}
        for e in told
    ]  # fmt: skip
    terms += [
        {"block": "arm", "kind": "parameter", "id": n, "left": {"joint_angle": 9.0}, "share": 1.0}
        for n in wrong
    ]
    if percent:
        left = {"joint_angle": error}
        terms.append({"block": "arm", "kind": "model_error", "id": "m", "left": left})
    lab = {"rate": 200, "bits": 12, "dropouts": True, "missing": "supply_pressure", "one": False}
    return {
        "schema": SCHEMA, "case": case, "effects": told, "terms": terms,
        "wrong_parameters": {
            n: {"nominal": 1.0, "value": 2.0, "tolerances": 9.0} for n in wrong
        },
        "spec": {"rig": rig, "lab": lab, "percent": percent, "strength": 30.0, "stated": True},
    }  # fmt: skip


def result_of(verdict, named=(), wrong=(), groups=(), sets=(), seconds=4.0, **more):
    def parameters(name):
        return {"conductance": {"value": 2.1, "std": 0.1}} if name == "leak_muscle" else {}

    return {
        "schema": "pamrs.diagnosis/1", "verdict": verdict, "seconds": seconds,
        "effects": [{"id": n, "probability": 0.9, "parameters": parameters(n)} for n in named],
        "wrong_parameters": [{"name": n, "value": 2.3, "interval": [1.9, 2.6]} for n in wrong],
        "probabilities": {"+".join(named) or verdict: 0.9}, "ambiguity": list(sets),
        "blocks": list(groups), **more,
    }  # fmt: skip


def group(blocks, verdict, named=(), p=0.9, **more):
    return {
        "blocks": list(blocks), "verdict": verdict, "effects": list(named),
        "probabilities": {"+".join(named) or verdict: p}, "wrong_parameters": [], "ambiguity": [],
        **more,
    }  # fmt: skip


LEAK = ("leak_muscle", KNOWN, "chamber")
CREEP = ("muscle_creep", OTHER, "arm")
HOSE = ("hose_torque", UNLISTED, "arm")


def test_marks_of_effects():
    groups = [group(["chamber"], "effects", ["leak_muscle"]), group(["arm"], "unlisted", p=0.7)]
    sets = [["muscle_creep"], ["x"]]
    said = result_of("effects", ["leak_muscle"], groups=groups, sets=sets)
    found = mark(key_of("a", [LEAK, CREEP]), said)
    assert (found.leading, found.holds, found.wrong, found.false_name) == (True, True, None, None)
    assert found.inside == (True,)
    assert [(b.block, b.leading) for b in found.blocks] == [("chamber", True), ("arm", False)]
    assert found.claims == ((0.9, True), (0.7, False))
    assert found.tags["form"] == (KNOWN, OTHER)
    assert found.tags["block"] == ("chamber", "arm")
    assert found.seen
    assert found.above
    weak = mark(key_of("b", [(*LEAK, 1.5)], percent=1), result_of("effects", ["muscle_creep"]))
    assert (weak.leading, weak.holds, weak.seen) == (False, False, False)
    assert weak.tags["strength"] == ("1.5",)
    buried = mark(key_of("c", [(*CREEP, 4.0)], percent=3), result_of("unlisted"))
    assert (buried.seen, buried.above, buried.leading) == (True, False, False)


def test_marks_of_unlisted_and_missing():
    hose = key_of("a", [HOSE])
    assert mark(hose, result_of("unlisted")).unlisted is True
    assert mark(hose, result_of("effects", ["muscle_creep"])).unlisted is False
    lost = mark(hose, None)
    assert (lost.verdict, lost.unlisted, lost.holds, lost.gap) == ("missing", False, False, 0.0)


def test_marks_of_wrong_parameters():
    key = key_of("a", wrong=["arm.payload"])
    right = mark(key, result_of("parameters", wrong=["arm.payload"]))
    assert (right.wrong, right.holds, right.false_name) == (True, True, False)
    assert right.inside == (True,)
    more = mark(key, result_of("parameters", wrong=["arm.payload", "arm.inertia"]))
    assert (more.wrong, more.false_name) == (True, True)
    both = result_of("effects", ["muscle_creep"], wrong=["arm.payload"])
    beside = mark(key_of("b", [CREEP], wrong=["arm.payload"]), both)
    assert (beside.leading, beside.wrong, beside.holds) == (True, True, True)
    assert beside.false_name is None


def test_marks_of_healthy_cases():
    assert mark(key_of("a"), result_of("parameters")).false_name is False
    assert mark(key_of("a"), result_of("unlisted")).false_name is True
    # what stays beside model error may be called unlisted, but has no name
    off = key_of("b", percent=3)
    assert mark(off, result_of("unlisted")).false_name is False
    assert mark(off, result_of("unlisted")).calm is False
    assert mark(off, result_of("none")).calm is True
    assert mark(off, result_of("effects", ["muscle_creep"])).false_name is True


def test_shares_are_scored_only_with_a_budget():
    key = key_of("a", [LEAK])
    assert mark(key, result_of("effects", ["leak_muscle"])).shares == ()
    for share, right in ((0.7, True), (0.5, False)):
        budget = [{"block": "chamber", "kind": "effect", "id": "leak_muscle", "share": share}]
        found = mark(key, result_of("effects", ["leak_muscle"], budget=budget))
        assert found.shares == (right,)


def test_places_of_blocks():
    assert place(["supply"]) == {"supply"}
    assert place(["valve", "line", "chamber.flexor"]) == {"chamber"}
    assert place(["arm", "muscle", "load"]) == {"arm"}


def test_tables():
    found = [
        mark(key_of("a", [LEAK]), result_of("effects", ["leak_muscle"])),
        mark(key_of("b", [CREEP], percent=1), result_of("effects", ["leak_muscle"], seconds=40.0)),
        mark(key_of("c", wrong=["arm.payload"]), result_of("parameters", wrong=["arm.payload"])),
        mark(key_of("d"), result_of("none")),
    ]
    whole = measures(found)
    assert (whole["leading name right"]["hits"], whole["leading name right"]["n"]) == (1, 2)
    assert whole["seconds"] == {"n": 4, "median": 4.0, "95 %": 40.0}
    told = scores(found)
    assert set(told["strata"]["form"]) == {KNOWN, OTHER}
    assert told["leave_form_out"]["leading name right"]["hits"] == 0
    assert json.loads(to_json(told))["schema"] == "pamrs.trial-scores/2"
    text = markdown(told)
    assert "### By strength" in text
    assert "| leave form out | 1 |" in text
    by = {(t.name, t.over): t for t in targets(found)}
    name = by["leading name right", "3 noises and more, model error of 0 and 1 %"]
    assert (name.measured, name.met, name.n) == (0.5, False, 2)
    assert by["seconds, median", "all"].met
    assert by["share within 15 points", name.over].met is None


def test_parameters_of_a_hanging_mass():
    model, _, plant = nominal("hanging_mass")
    assert plant.par.weight == pytest.approx(50.0 * 9.80665)
    assert parameters_of(model, RIGS["hanging_mass"]).joint["max_angle"] == pytest.approx(0.086)
