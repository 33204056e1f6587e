"""A campaign: what it asks for, keeps, takes back and says; diagnoses are stood in for where only
what follows from them is asked.
"""

import itertools
import json
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import pamrs
from pamrs._writing import write_atomically
from pamrs.campaigns import Bench, Budget, _choice, _loop, campaign
from pamrs.campaigns._bench import Commands
from pamrs.campaigns._play import play
from pamrs.campaigns.simulated import SimulatedBench
from pamrs.channels import unit_of
from pamrs.control.live import LiveError
from pamrs.diagnosis import DiagnosisSettings
from pamrs.errors import CaseError, DiagnosisError, ParameterError, RecordingError, SimulationError
from pamrs.experiments import library, protocol_of
from pamrs.findings import NextExperiment, RankedExperiment
from pamrs.recordings import load_recording

FAST = Bench(period=0.02, settle=1.0)
LIMITS = Budget(60.0, 9, 5000.0)


@pytest.fixture(scope="module")
def rig():
    return pamrs.rigs.shoulder()


@pytest.fixture(scope="module")
def pool(rig):
    return {e.name: e for e in library(rig, DiagnosisSettings())}


class Found:
    """Stands in for a diagnosis."""

    def __init__(self, rig, settled=False, probability=0.5, ask=None, limits=()):
        self.rig, self.verdict, self.limits = rig, "effects", list(limits)
        self.answer = SimpleNamespace(
            settled=settled,
            names=("leak_muscle",),
            probability=probability,
            why="" if settled else "sets",
        )
        self.wrong_parameters = []
        self.ambiguity = [] if settled else [["leak_muscle"], ["supply_leak"]]
        self.probabilities = {"leak_muscle": probability, "supply_leak": 1.0 - probability}
        self.headline = "A leak" if settled else "A leak of the muscle or of the supply"
        self.next_experiment = ask or NextExperiment()

    def report(self, path):
        write_atomically(path, "<html>")

    def to_json(self, path):
        write_atomically(path, "{}")


@pytest.fixture
def diagnosed(monkeypatch):
    """Answers of diagnoses, one after the other, the last one ever after; cases that were asked."""
    answers, asked = [], []

    def diagnose(case, **options):
        asked.append([recording.name for recording in case.recordings])
        return answers[min(len(asked), len(answers)) - 1]

    monkeypatch.setattr(_loop, "diagnose", diagnose)
    plan = SimpleNamespace(limits=[], additions=[])
    monkeypatch.setattr(_loop, "plan_of", lambda *given: plan)
    return SimpleNamespace(answers=answers, asked=asked, plan=plan)


def asks(rig, pool, name, **changes):
    """What a diagnosis asks for: an experiment of the pool, without rivals that were compared."""
    return NextExperiment(f"Play {name}.", protocol=protocol_of(pool[name]), **changes)


def log(rig, tmp_path, pool, parts=1):
    """A first recording; of several parts of it the first."""
    run = pool["step_and_shut"].simulate(rig)
    few = slice(run.time.size // parts)
    heads = ("valve_command", "supply_pressure", "muscle_pressure", "joint_angle")
    table = {"time": run.time[few]} | {name: run[name][few] for name in heads}
    return pamrs.Case.from_arrays(rig, {"free": table}).recordings


def test_a_run_is_foretold_played_scored_and_kept(rig, pool, diagnosed, tmp_path):
    other = rig.with_parameters({"arm.payload": 12.0})
    rivals = [("none", rig, 0.5), ("arm.payload", other, 0.5)]
    ask = asks(rig, pool, "step_and_shut", hypotheses=rivals)
    diagnosed.answers += [Found(rig, ask=ask), Found(rig, settled=True, probability=0.97)]
    out, seen = tmp_path / "out", []

    class Watched(SimulatedBench):
        def prepare(self):
            seen.append(sorted(path.name for path in (out / "step_01").glob("*")))
            super().prepare()

    found = campaign(
        Watched(rig),
        rig,
        log(rig, tmp_path, pool, parts=8),  # more than that would show the payload already
        out=out,
        budget=LIMITS,
        bench=FAST,
    )
    (step,) = found.steps
    assert (found.why, step.finished, step.changed) == ("decided", True, True)
    # what every rival predicts was there before the device was prepared for the run
    wanted = {"commands.csv", "foretold.csv", "sheet.md", "rival_1.toml", "rival_2.toml"}
    assert wanted <= set(seen[-1])
    assert "recording_1.csv" not in seen[-1]
    # the true one leaves what is noise, the other one much more
    assert step.telling == "joint_angle"
    assert max(step.scores["none"].values()) < 1.5
    assert step.scores["arm.payload"]["joint_angle"] > 5.0
    assert diagnosed.asked == [["free"], ["free", f"01 {step.name}"]]
    kept = json.loads((out / "campaign.json").read_text())
    assert kept["steps"][0]["after"]["headline"] == "A leak"
    for page in (out / "campaign.html", out / "step_01" / "page.html"):
        text = page.read_text()
        assert "A leak of the muscle or of the supply" in text
        assert "Known now" in text
        assert "<svg" in text
    # the same call again finds nothing more to do
    before = log(rig, tmp_path, pool, parts=8)
    again = campaign(SimulatedBench(rig), rig, before, out=out, bench=FAST)
    assert (again.why, len(again.steps)) == ("decided", 1)


@pytest.mark.parametrize(
    "name", ["shoulder", "antagonistic_joint", "regulated_joint", "two_joint_arm"]
)
def test_an_experiment_is_like_itself_as_a_file_holds_it(name):
    own = library(pamrs.rigs.named(name), DiagnosisSettings())
    assert own
    for one, other in itertools.product(own, own):
        numbers = json.loads(json.dumps(one.excitation))
        assert _choice.alike(other, one.name, numbers) == (one is other)
    moved = {key: value for key, value in own[0].excitation.items() if key != "kind"} | {"kind": ""}
    assert not _choice.alike(own[0], own[0].name, moved)


def test_a_run_that_failed_is_kept_and_played_again(rig, pool, diagnosed, tmp_path):
    ask = asks(rig, pool, "fast_triangle")
    diagnosed.answers += [Found(rig, ask=ask), Found(rig, settled=True)]

    class Dying(SimulatedBench):
        def read(self):
            return super().read() if self.clock.now() < 3.0 else None

    given = (rig, log(rig, tmp_path, pool))
    with pytest.raises(LiveError, match="it gave no reading"):
        campaign(Dying(rig), *given, out=tmp_path, bench=FAST, budget=LIMITS)
    partial = (tmp_path / "step_01" / "recording_1.csv").read_text()
    assert len(partial.splitlines()) > 90
    found = campaign(SimulatedBench(rig), *given, out=tmp_path, bench=FAST, budget=LIMITS)
    (step,) = found.steps
    assert (tmp_path / "step_01" / "recording_1.csv").read_text() == partial
    assert step.recordings == ["step_01/recording_1.csv", "step_01/recording_2.csv"]
    assert len(found.steps[0].spent) == step.cost.runs == 2
    assert diagnosed.asked[-1] == ["free", "01 fast_triangle"]
    assert found.why == "decided"


def test_after_two_runs_that_change_nothing_a_repeat_is_asked_and_then_other_means(
    rig, pool, diagnosed, tmp_path
):
    ranking = [RankedExperiment("multisine", "", "force", 0.4, 30.0)]
    ask = asks(rig, pool, "fast_triangle", ranking=ranking)
    diagnosed.answers.append(Found(rig, ask=ask))
    given = (rig, log(rig, tmp_path, pool))
    found = campaign(SimulatedBench(rig), *given, out=tmp_path, bench=FAST, budget=LIMITS)
    names = [(step.name, step.repeats) for step in found.steps]
    assert names[0] == ("fast_triangle", False)
    assert not names[1][1]
    assert names[1][0] != "fast_triangle"
    assert names[2] == ("fast_triangle", True)
    assert (len(names), found.why) == (3, "unchanged")
    assert "changed nothing" in found.text
    assert "a sensor: force" in found.text
    assert "another payload: " in found.text


def test_where_nothing_is_missing_what_was_not_seen_is_asked_for(rig, pool, diagnosed, tmp_path):
    hidden = SimpleNamespace(effect="valve_hysteresis", verdict="not seen")
    diagnosed.plan.limits.append(
        SimpleNamespace(effect="valve_hysteresis", verdict="named", recording="fast_triangle")
    )
    blind, healthy = Found(rig, limits=[hidden]), Found(rig, settled=True)
    for one in (blind, healthy):
        one.verdict, one.answer.names = "none", ("none",)
    blind.answer.why = "unseen"
    diagnosed.answers += [blind, healthy]
    before = log(rig, tmp_path, pool)
    found = campaign(SimulatedBench(rig), rig, before * 2, out=tmp_path, bench=FAST, budget=LIMITS)
    (step,) = found.steps
    assert step.name == "fast_triangle"
    assert step.why == "It would show valve hysteresis at the usual size."
    assert found.why == "decided"


def test_a_settled_answer_of_one_recording_has_to_predict_another(rig, pool, diagnosed, tmp_path):
    diagnosed.plan.limits.append(
        SimpleNamespace(effect="leak_muscle", verdict="seen", recording="fast_triangle")
    )
    diagnosed.answers.append(Found(rig, settled=True))
    given = (rig, log(rig, tmp_path, pool))
    found = campaign(SimulatedBench(rig), *given, out=tmp_path, bench=FAST, budget=LIMITS)
    assert [step.name for step in found.steps] == ["fast_triangle"]
    assert found.why == "decided"


def test_where_no_allowed_experiment_parts_the_rivals_it_says_so(
    rig, pool, diagnosed, tmp_path, monkeypatch
):
    rivals = [("leak_muscle", rig, 0.5), ("supply_leak", rig, 0.5)]
    ask = asks(rig, pool, "fast_triangle", hypotheses=rivals, expected_information_bits=0.01)
    compared = []

    def propose(nominal, hypotheses, *given, experiments, **others):
        compared.append(sorted(one.name for one in experiments))
        return ask

    monkeypatch.setattr(_choice, "propose", propose)
    diagnosed.answers.append(Found(rig, ask=ask))
    given = (rig, log(rig, tmp_path, pool))
    found = campaign(SimulatedBench(rig), *given, out=tmp_path, bench=FAST, budget=LIMITS)
    assert (found.why, found.steps) == ("nothing parts", [])
    assert "No allowed experiment parts what is left: A leak of the muscle or of" in found.text
    # only what a device can play alone was compared
    assert "multisine" in compared[0]
    assert not {"other_payload", "free_decay", "holds_both_sides"} & set(compared[0])
    # where what is open has no model either, its block is asked about all the same
    nameless = Found(rig, ask=ask)
    nameless.verdict, nameless.ambiguity = "parameters", [["parameters"], ["unlisted"]]
    diagnosed.answers[:] = [nameless]
    goes_on = campaign(None, *given, out=tmp_path / "nameless", bench=FAST, budget=LIMITS)
    assert (goes_on.why, goes_on.steps[0].name) == ("no recording", "fast_triangle")


@pytest.mark.parametrize(
    ("budget", "told"),
    [
        (Budget(runs=0), "1 of 0 runs"),
        (Budget(minutes=0.2), "of 0.2 minutes"),
        (Budget(air=1e-6), "of 1e-06 litres of air"),
    ],
)
def test_a_budget_is_kept_to_and_said(rig, pool, diagnosed, tmp_path, budget, told):
    diagnosed.answers.append(Found(rig, ask=asks(rig, pool, "multisine")))
    given = (rig, log(rig, tmp_path, pool))
    found = campaign(SimulatedBench(rig), *given, out=tmp_path, bench=FAST, budget=budget)
    assert (found.why, found.steps) == ("budget", [])
    assert told in found.text


def test_limits_that_allow_nothing_are_named(rig, pool, diagnosed, tmp_path):
    diagnosed.answers.append(Found(rig))
    narrow = Bench(limits={"valve_command": (6.0, 7.0)}, safe={"valve_command": 6.0})
    with pytest.raises(
        ParameterError, match=r"limits allow no experiment of rig 'shoulder': of "
    ) as e:
        campaign(SimulatedBench(rig), rig, log(rig, tmp_path, pool), out=tmp_path, bench=narrow)
    assert "limits allow 6 to 7 V" in str(e.value)


def test_no_proposed_command_leaves_the_limits(rig, pool, diagnosed, tmp_path):
    diagnosed.answers.append(Found(rig, ask=asks(rig, pool, "fast_triangle")))
    bench = Bench(period=0.02, settle=0.5, limits={"valve_command": (4.0, 6.0)})
    plant = SimulatedBench(rig)
    given = (rig, log(rig, tmp_path, pool))
    found = campaign(plant, *given, out=tmp_path, bench=bench, budget=Budget(60, 1, 5000))
    (step,) = found.steps
    assert step.name != "fast_triangle"
    sent = np.loadtxt(tmp_path / "step_01" / "recording_1.csv", delimiter=",", skiprows=1)[:, 1]
    assert sent.min() >= 4.0
    assert sent.max() <= 6.0


def test_a_run_that_went_too_high_is_no_leave_for_the_next_one(rig, pool, diagnosed, tmp_path):
    names = ("step_and_shut", "fast_triangle")
    diagnosed.answers += [Found(rig, ask=asks(rig, pool, name)) for name in names]
    area = float(rig.parameter("valve.discharge_area_max").value)
    plant = SimulatedBench(rig.with_parameters({"valve.discharge_area_max": 2.0 * area}))
    before = log(rig, tmp_path, pool, parts=8)
    found = campaign(plant, rig, before, out=tmp_path, bench=FAST, budget=Budget(60, 2, 5000))
    first, second = found.steps
    known = before[0].channels["muscle_pressure"].max()
    reached = load_recording(tmp_path / first.recordings[0]).channels["muscle_pressure"].max()
    assert reached > 1.1 * known
    assert max(second.numbers["levels_bar"]) < 1.06e-5 * known


def test_without_a_device_a_person_plays_it_and_brings_the_recording(
    rig, pool, diagnosed, tmp_path
):
    diagnosed.answers += [Found(rig, ask=asks(rig, pool, "multisine")), Found(rig, settled=True)]
    given = (rig, log(rig, tmp_path, pool))
    found = campaign(None, *given, out=tmp_path, budget=LIMITS)
    home = tmp_path / "step_01"
    assert (found.why, found.text) == (
        "no recording",
        f"Waits for the recording of {home / 'sheet.md'}",
    )
    sheet = (home / "sheet.md").read_text()
    for words in ("# Step 1: multisine", "valve_command = 5 V", "within 0 to 10 V", "commands.csv"):
        assert words in sheet
    (home / "broken.csv").write_text("time [s],nonsense\n1,2\n")
    with pytest.raises(RecordingError, match="nonsense"):
        campaign(None, *given, out=tmp_path, recording=home / "broken.csv")
    assert not list(home.glob("recording*"))
    commands = np.loadtxt(home / "commands.csv", delimiter=",", skiprows=1)[:, 1]
    run = pamrs.simulate(rig, commands, sample_time=pool["multisine"].sample_time)
    lines = [
        "time [s],valve_command [V],muscle_pressure [bar],joint_angle [deg],supply_pressure [bar]"
    ]
    columns = (
        run.time,
        commands,
        run["muscle_pressure"] / 1e5,
        np.degrees(run["joint_angle"]),
        run["supply_pressure"] / 1e5,
    )
    lines += [",".join(f"{value:.6g}" for value in row) for row in zip(*columns, strict=True)]
    (home / "recording.csv").write_text("\n".join(lines) + "\n")
    found = campaign(None, *given, out=tmp_path)
    assert found.why == "decided"
    assert diagnosed.asked[-1] == ["free", "01 multisine"]
    with pytest.raises(CaseError, match="no step waits for one"):
        campaign(None, *given, out=tmp_path, recording=home / "recording.csv")


def test_a_payload_that_a_person_hung_on_is_known_in_its_recording(rig, pool, diagnosed, tmp_path):
    one = pool["other_payload"]
    diagnosed.answers += [
        Found(rig, ask=asks(rig, pool, "other_payload")),
        Found(rig, settled=True),
    ]
    given = (rig, log(rig, tmp_path, pool))
    campaign(None, *given, out=tmp_path)
    home = tmp_path / "step_01"
    assert "arm.payload = 4.535" in (home / "sheet.md").read_text()
    bench = SimulatedBench(rig.with_parameters(one.changes))
    bench_commands = Commands(rig, FAST)
    play(bench, bench_commands, protocol_of(one), tmp_path / "log.csv")
    found = campaign(None, *given, out=tmp_path, recording=tmp_path / "log.csv")
    (step,) = found.steps
    # with its own payload the rig file's model leaves noise alone
    assert max(step.scores["none"].values()) < 1.5


def test_a_folder_of_another_rig_and_a_device_of_another_rig_are_refused(rig, diagnosed, tmp_path):
    diagnosed.answers.append(Found(rig, settled=True))
    other = SimpleNamespace(commands=("valve_command.left",), name="/dev/ttyACM0")
    with pytest.raises(
        ParameterError, match="device = /dev/ttyACM0 takes valve_command.left, which"
    ):
        campaign(other, rig, out=tmp_path)
    told = SimpleNamespace(
        commands=("valve_command",), channels=("time", "muscle_pressure.left"), name="board"
    )
    with pytest.raises(
        ParameterError, match="tells muscle_pressure.left, which is not allowed: .*muscle_pressure,"
    ):
        campaign(told, rig, out=tmp_path)
    with pytest.raises(ParameterError, match="no command that a device could play"):
        campaign(other, pamrs.rigs.sealed_chamber(), out=tmp_path / "sealed")
    with pytest.raises(CaseError, match="holds the campaign of another rig"):
        campaign(None, rig.with_parameters({"arm.payload": 8.0}), out=tmp_path)
    (tmp_path / "campaign.json").write_text("{}")
    with pytest.raises(CaseError, match="campaign.json: is no campaign"):
        campaign(None, rig, out=tmp_path)


@pytest.mark.parametrize("name", ["rig.toml", "result.json", "step_01"])
def test_a_file_that_no_campaign_wrote_is_not_written_over(rig, tmp_path, name):
    (tmp_path / name).write_text("mine")
    with pytest.raises(CaseError, match=f"out = {tmp_path} is not allowed: it holds {name} and"):
        campaign(None, rig, out=tmp_path)
    assert [(path.name, path.read_text()) for path in tmp_path.iterdir()] == [(name, "mine")]


@pytest.mark.parametrize(
    ("name", "changed", "told"),
    [
        ("fast_triangle", {"bench": Bench(limits={"valve_command": (4.0, 6.0)})}, "allow 4 to 6"),
        ("fast_triangle", {"bench": Bench(highest=1.5e5)}, "ask for other commands"),
        ("fast_triangle", {"budget": Budget(minutes=0.2)}, "of 0.2 minutes"),
        ("other_payload", {"bench": Bench(unattended=True)}, "another payload"),
        ("other_payload", {"device": True}, "another payload"),
    ],
)
def test_an_open_step_that_is_not_allowed_any_more_is_withdrawn(
    rig, pool, diagnosed, tmp_path, name, changed, told
):
    diagnosed.answers += [Found(rig, ask=asks(rig, pool, name)), Found(rig, settled=True)]
    before = log(rig, tmp_path, pool) * 2
    found = campaign(None, rig, before, out=tmp_path, budget=LIMITS)
    assert [step.name for step in found.steps] == [name]
    device = SimulatedBench(rig) if changed.pop("device", False) else None
    given = {"budget": LIMITS, **changed}
    found = campaign(device, rig, before, out=tmp_path, **given)
    step = found.steps[0]
    assert told in step.withdrawn
    assert (step.recordings, step.finished) == ([], False)
    assert f"{name}: withdrawn, " in found.summary()
    assert f"Withdrawn: {step.withdrawn[:9]}" in (tmp_path / "campaign.html").read_text()


def test_each_replay_of_a_run_that_fails_counts_in_the_budget(rig, pool, diagnosed, tmp_path):
    class Dead(SimulatedBench):
        def read(self):
            return None

    diagnosed.answers.append(Found(rig, ask=asks(rig, pool, "fast_triangle")))
    given = {"out": tmp_path, "bench": FAST, "budget": Budget(60.0, 2, 5000.0)}
    before = log(rig, tmp_path, pool)
    for _ in range(2):
        with pytest.raises(LiveError):
            campaign(Dead(rig), rig, before, **given)
    found = campaign(SimulatedBench(rig), rig, before, **given)
    assert (found.why, len(found.steps[0].spent)) == ("budget", 2)
    assert found.steps[0].withdrawn == "the budget would be passed, 3 of 2 runs"


def heard(rig, one, path, *names):
    """A recording of an experiment with some of its channels."""
    run, columns = one.simulate(rig), ["time", *names]
    table = np.column_stack([run.time, *(run[name] for name in names)])
    units = [unit_of(name) for name in columns]
    heads = ",".join(f"{name} [{unit}]" for name, unit in zip(columns, units, strict=True))
    np.savetxt(path, table, delimiter=",", header=heads, comments="")
    return path


def test_a_recording_that_cannot_be_of_its_step_is_refused(rig, pool, diagnosed, tmp_path):
    diagnosed.answers.append(Found(rig, ask=asks(rig, pool, "fast_triangle")))
    given, out = (rig, log(rig, tmp_path, pool)), tmp_path / "out"
    campaign(None, *given, out=out, budget=LIMITS)
    for names, told in (
        (["muscle_pressure", "joint_angle"], "step 1 needs valve_command"),
        (["valve_command"], "step 1 needs one of .*joint_angle"),
    ):
        file = heard(rig, pool["fast_triangle"], tmp_path / "brought.csv", *names)
        with pytest.raises(CaseError, match=told):
            campaign(None, *given, out=out, budget=LIMITS, recording=file)
    assert not list((out / "step_01").glob("recording*"))


@pytest.mark.parametrize("by", ["recording", "device", "waiting"])
def test_a_recording_that_cannot_be_diagnosed_is_replaced(
    rig, pool, diagnosed, tmp_path, monkeypatch, by
):
    diagnosed.answers += [Found(rig, ask=asks(rig, pool, "fast_triangle"))]
    given, out = (rig, log(rig, tmp_path, pool)), tmp_path / "out"
    names = ("valve_command", "muscle_pressure", "joint_angle", "supply_pressure")
    file = heard(rig, pool["fast_triangle"], tmp_path / "brought.csv", *names)
    campaign(None, *given, out=out, budget=LIMITS)
    good = _loop.diagnose

    def failing(case, **options):
        if len(case.recordings) > 1:
            raise DiagnosisError("it stands still")
        return good(case, **options)

    monkeypatch.setattr(_loop, "diagnose", failing)
    (out / "step_01" / "recording.csv").write_bytes(file.read_bytes())
    with pytest.raises(DiagnosisError, match=r"recording_1.csv cannot .*: it stands still; step 1"):
        campaign(None, *given, out=out, budget=LIMITS)
    waits = campaign(None, *given, out=out, budget=LIMITS)
    assert (waits.why, len(waits.steps[0].spent)) == ("no recording", 1)
    monkeypatch.setattr(_loop, "diagnose", good)
    diagnosed.answers.append(Found(rig, settled=True))
    brought = {"recording": file} if by == "recording" else {}
    if by == "waiting":
        (out / "step_01" / "recording.csv").write_bytes(file.read_bytes())
    device = SimulatedBench(rig) if by == "device" else None
    found = campaign(device, *given, out=out, budget=LIMITS, bench=FAST, **brought)
    (step,) = found.steps
    assert found.why == "decided"
    assert step.recordings == ["step_01/recording_1.csv", "step_01/recording_2.csv"]


def test_a_rival_that_leaves_its_range_takes_no_score_from_the_others(
    rig, pool, diagnosed, tmp_path, monkeypatch
):
    rivals = [("none", rig, 0.5), ("leak_muscle", rig.with_parameters({"arm.payload": 12.0}), 0.5)]
    ask = asks(rig, pool, "step_and_shut", hypotheses=rivals)
    diagnosed.answers += [Found(rig, ask=ask), Found(rig, settled=True)]
    scored = _loop.foretold

    def leaving(hypotheses, *given):
        if any(label == "leak_muscle" for label, *_ in hypotheses):
            raise SimulationError("leak_muscle leaves its range")
        return scored(hypotheses, *given)

    monkeypatch.setattr(_loop, "foretold", leaving)
    given = (rig, log(rig, tmp_path, pool, parts=8))
    found = campaign(SimulatedBench(rig), *given, out=tmp_path, bench=FAST, budget=LIMITS)
    (step,) = found.steps
    assert list(step.scores) == ["none"]
    assert max(step.scores["none"].values()) < 1.5
    assert "leaves its range" in (tmp_path / "step_01" / "page.html").read_text()


def test_why_a_run_is_asked_for_is_true(rig, pool, diagnosed, tmp_path):
    whys = []
    for found, verdict in ((None, ""), (Found(rig), "effects"), (Found(rig), "unlisted")):
        if found is not None:
            found.verdict = verdict
        own = _choice.Pool(dict(pool), {}, {}, {}, [])
        given = (own, {}, [], DiagnosisSettings())
        whys.append(_choice.proposed(rig, found, *given, repeat=False).why)
    assert whys[0].startswith("Nothing was recorded yet:")
    assert whys[1].startswith("The answer is not settled:")
    assert whys[2].startswith("Not all that is missing has a name yet:")


@pytest.mark.slow
def test_a_leak_is_found_from_one_poor_log(tmp_path):
    """The whole of it as ``make campaign`` runs it, nothing stood in for."""
    root = Path(__file__).parents[2]
    words = ["--kind", "leak_muscle", "--seed", "7", "--out", str(tmp_path / "out")]
    script = [sys.executable, str(root / "demo" / "campaign.py"), *words]
    done = subprocess.run(script, cwd=root, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "concealed: leak_muscle\n   named:     leak_muscle" in done.stdout
    kept = json.loads((tmp_path / "out" / "campaign" / "campaign.json").read_text())
    assert kept["ended"]["why"] == "decided"
    # the run that proves it was foretold by the leak, and by no rig without it
    scores = kept["steps"][0]["scores"]
    assert scores["leak_muscle"]["muscle_pressure"] < 2.0
    assert scores["none"]["muscle_pressure"] > 5.0
