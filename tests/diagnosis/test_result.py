"""Result of a diagnosis: JSON, summary, validation; what is read from its file is what was
written.
"""

from __future__ import annotations

import dataclasses
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import pamrs
from pamrs import findings
from pamrs.diagnosis.result import Diagnosis, Trace
from pamrs.errors import DiagnosisError
from pamrs.findings import (
    BlockVerdict,
    Condition,
    EffectParameterFound,
    FreeRun,
    FreeRunError,
    NextExperiment,
    PairExperiment,
)
from pamrs.report import render_html, words
from pamrs.report.sentences._answer import unsettled_sentence
from tests.diagnosis import synthetic
from tests.tables import rows_of

MADE = pytest.mark.parametrize(
    "make", [synthetic.diagnosis, synthetic.sealed_chamber, synthetic.nothing]
)


def keys_of(cls: type, found: dict[str, list[str]]) -> dict[str, list[str]]:
    """Keys that JSON has of a type, in their order and each with its type; of what it holds too."""
    own = [field for field in dataclasses.fields(cls) if field.metadata.get("json", True)]
    found[cls.__name__] = [
        f"{field.metadata.get('key', field.name)}: {field.type}" for field in own
    ]
    for name in (name for field in own for name in re.findall(r"\w+", str(field.type))):
        inner = getattr(findings, name, None)
        if inner is not None and name not in found:
            keys_of(inner, found)
    return found


def test_keys_of_a_result_are_those_of_its_schema() -> None:
    """A key may be added; one that goes or means another thing is a new schema."""
    assert keys_of(Diagnosis, {}) == rows_of(__file__, "keys")


def test_not_finite_becomes_null() -> None:
    content = json.loads(synthetic.diagnosis(seconds=float("inf")).to_json())
    assert content["seconds"] is None
    assert content["parameters"]["arm.payload"]["std"] is None
    assert content["fit"]["gap_closed"] == 0.97


def test_numpy_values_become_json() -> None:
    condition = Condition("time", np.float64(0.5), 0.25, 1.0, "late")
    where = {"block": "arm", "intervals": [[0.0, 1.0]], "conditions": [condition]}
    found = synthetic.diagnosis(where=where, probabilities={"none": np.float64(0.25)})
    content = json.loads(found.to_json())
    told = {"name": "time", "share": 0.5, "time": 0.25, "mean": 1.0, "text": "late"}
    assert content["where"]["conditions"] == [told]
    assert content["probabilities"] == {"none": 0.25}


def test_failed_write_leaves_old_file(tmp_path: Path) -> None:
    path = tmp_path / "out.json"
    synthetic.diagnosis().to_json(path)
    old = path.read_text(encoding="utf-8")
    with pytest.raises(TypeError, match="object"):
        synthetic.diagnosis(probabilities={"none": object()}).to_json(path)
    assert path.read_text(encoding="utf-8") == old


def test_summary_names_the_effect() -> None:
    summary = synthetic.diagnosis().summary()
    assert "heat transfer" in summary
    assert "41.3 +- 2.2 W/(m2 K)" in summary
    assert "do not determine" in summary
    assert 12 <= len(summary.splitlines()) <= 32
    assert max(map(len, summary.splitlines())) <= 100
    assert summary.isascii()


def test_a_plain_number_stands_without_its_unit() -> None:
    found = synthetic.diagnosis()
    share = EffectParameterFound(0.00514, 0.00039, "1", interval=(0.0044, 0.0059))
    effect = dataclasses.replace(found.effects[0], parameters={"share": share})
    lines = dataclasses.replace(found, effects=[effect]).summary().splitlines()
    assert "  share = 0.00514 +- 0.00039" in lines


def test_an_instruction_that_pairs_share_is_given_once() -> None:
    what = "For the chamber of flexor: step the pressure by two sizes and watch for 4 s"
    zero = ["unlisted", "sensors.flexor.pressure_zero"]
    pairs = [
        PairExperiment(["unlisted", "leak_muscle"], f"{what}. A model with a leak says it."),
        PairExperiment(zero, "Measure it by itself with a gauge."),
    ]
    own = NextExperiment(f"{what}; what fades is heat.", pairs=pairs)
    found = dataclasses.replace(synthetic.diagnosis(traces=[]), next_experiment=own)
    summary = " ".join(found.summary().split())
    assert summary.count("watch for 4 s") == 1
    same = "effect outside the catalogue or muscle leak? The same experiment. A model with a leak"
    assert same in summary
    assert "or wrong pressure zero of flexor? Measure it by itself" in summary
    assert render_html(found).count("watch for 4 s") == 1


def test_errors_of_a_block_with_a_name_have_their_unit() -> None:
    found = synthetic.diagnosis()
    named = {"joint_angle.elbow": found.fit.held_out["joint_angle"]}
    errors = dataclasses.replace(found.fit, held_out=named)
    lines = dataclasses.replace(found, fit=errors).summary().splitlines()
    assert any(line.startswith("joint_angle.elbow [deg]") for line in lines)


def test_summary_says_how_the_whole_rig_runs_and_what_is_only_closest() -> None:
    errors = {"joint_angle": FreeRunError("rad", 0.1, 0.01, None, None)}
    run = FreeRun("random", "held_out", 30.0, errors)
    summary = synthetic.diagnosis(verdict="unlisted", free_run=[run]).summary()
    assert "Whole rig from its commands alone, random: joint_angle 5.73 to 0.573 deg" in summary
    assert "not named, but closest: heat transfer" in summary
    assert summary.isascii()


ARM = {"blocks": ["arm"], "ambiguity": [], "wrong_parameters": [], "effects": []}


def _judged(verdict: str, probabilities: dict[str, float], **more: Any) -> Diagnosis:
    """A result of one group of blocks."""
    block = BlockVerdict(verdict=verdict, probabilities=probabilities, **(ARM | more))
    effects = []
    for name in block.effects:
        chance = sum(p for key, p in probabilities.items() if name in key.split("+"))
        effects.append({"id": name, "probability": chance, "parameters": {}})
    case = {"verdict": verdict, "probabilities": probabilities, "ambiguity": block.ambiguity}
    more = {"blocks": [block], "where": {"block": "arm"}, "traces": []}
    return synthetic.diagnosis(effects=effects, **case, **more)


@pytest.mark.parametrize(
    ("verdict", "probabilities", "more", "said", "badge", "chance"),
    rows_of(__file__, "headline_badge_page_and_json_say_the_same"),
)
def test_headline_badge_page_and_json_say_the_same(
    verdict: str,
    probabilities: dict[str, float],
    more: dict[str, Any],
    said: str,
    badge: str,
    chance: float,
) -> None:
    found = _judged(verdict, probabilities, **more)
    assert said in found.headline
    assert found.answer.probability == pytest.approx(chance)
    html = render_html(found)
    assert f">{badge}</span>" in html
    assert f"<span>probability {words.format_probability(chance)}" in html
    assert found.headline in found.summary().replace("\n", " ")
    assert json.loads(found.to_json())["verdict"] == found.verdict


def test_it_is_settled_from_the_probability_that_the_settings_say() -> None:
    found = _judged("effects", {"muscle_creep": 0.7, "unlisted": 0.3}, effects=["muscle_creep"])
    bold = dataclasses.replace(found, settings=pamrs.DiagnosisSettings(settled=0.65))
    assert not found.answer.settled
    assert bold.answer.settled


def test_what_has_no_name_is_not_settled_however_sure_it_is_that_something_acts() -> None:
    found = _judged("unlisted", {"unlisted": 0.97, "muscle_creep": 0.03})
    assert (found.answer.settled, found.answer.why) == (False, "name")
    assert unsettled_sentence(found) == (
        "It is not settled: what is missing in the arm has no name."
    )


def test_notebook_html_escapes() -> None:
    html = synthetic.diagnosis(where={"text": "<script>"})._repr_html_()
    assert "<script>" not in html
    assert "heat transfer" in html


def test_bad_input_is_refused() -> None:
    with pytest.raises(ValueError, match="verdict"):
        Diagnosis("case", "maybe")
    with pytest.raises(ValueError, match="before"):
        Trace("r", "fit", "force", "N", np.arange(3.0), np.arange(3.0), np.arange(4.0))


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0, "0"),
        (9.996, "10.0"),
        (1234567.0, "1.23 × 10⁶"),
        (-1.5e-9, "−1.50 × 10⁻⁹"),
        (float("nan"), "–"),
        (None, "–"),
        (9.999e-7, "1.00 × 10⁻⁶"),
        (412345.0, "412000"),
    ],
)
def test_format_number(value: float | None, text: str) -> None:
    assert words.format_number(value) == text


def test_format_uncertain() -> None:
    assert words.format_uncertain(1.234e-9, 5.6e-11) == "(1.234 ± 0.056) × 10⁻⁹"
    assert words.format_uncertain(41.27, 2.2) == "41.3 ± 2.2"
    assert words.format_uncertain(2.0, None) == "2.000"
    assert words.format_probability(0.9999) == "> 0.99"


@MADE
def test_what_was_written_is_read(make, tmp_path: Path) -> None:
    made = make()
    written = made.to_json(tmp_path / "result.json")
    assert (tmp_path / "result.json").read_text(encoding="utf-8") == written
    assert [p.name for p in tmp_path.iterdir()] == ["result.json"]
    assert "NaN" not in written
    assert "Infinity" not in written
    read = pamrs.load_result(tmp_path)
    assert isinstance(read, pamrs.Diagnosis)
    assert read.to_json() == written
    assert read == pamrs.load_result(tmp_path / "result.json") == made
    assert (read.case, read.text, repr(read)) == (made.case, made.text, repr(made))
    assert read.summary() == made.summary()
    assert made._repr_html_().startswith(read._repr_html_())  # behind it, a picture
    assert [type(one) for one in read.effects] == [type(one) for one in made.effects]
    assert [one.name for one in read.effects] == [one.name for one in made.effects]


def test_what_a_file_does_not_keep_says_what_to_do(tmp_path: Path) -> None:
    synthetic.diagnosis().to_json(tmp_path / "result.json")
    read = pamrs.load_result(tmp_path)
    with pytest.raises(DiagnosisError, match="rig is not kept .* --model wrote"):
        _ = read.rig
    with pytest.raises(DiagnosisError, match="run pamrs.diagnose on the case again"):
        read.report(tmp_path / "report.html")
    assert not (tmp_path / "report.html").exists()


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"schema": "pamrs.diagnosis/9"}, "'pamrs.diagnosis/9' is not allowed: pamrs.diagnosis/1"),
        ({"verdict": "maybe"}, "verdict is 'maybe'"),
        ({"effects": [{"probability": 0.5}]}, "is no complete result"),
        ({"effects": 3}, "is no complete result"),
        ({"where": [1]}, "is no complete result"),
        ({"settings": {"speed": 1}}, "settings has 'speed'"),
    ],
)
def test_what_is_no_result_is_named(change, said: str, tmp_path: Path) -> None:
    file = tmp_path / "result.json"
    file.write_text(json.dumps(json.loads(synthetic.diagnosis().to_json()) | change))
    with pytest.raises(DiagnosisError, match=said):
        pamrs.load_result(file)


def test_what_cannot_be_read_is_named(tmp_path: Path) -> None:
    with pytest.raises(DiagnosisError, match=r"result\.json: cannot be read"):
        pamrs.load_result(tmp_path)
    (tmp_path / "result.json").write_text("[1, 2")
    with pytest.raises(DiagnosisError, match="is not the JSON of a result"):
        pamrs.load_result(tmp_path)
    (tmp_path / "result.json").write_text("[1, 2]")
    with pytest.raises(DiagnosisError, match="schema = None"):
        pamrs.load_result(tmp_path)
