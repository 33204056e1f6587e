"""Settings of a diagnosis: one home for every number, each with its reason, passed in, in the
result.
"""

from __future__ import annotations

import ast
import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest

import pamrs
from pamrs.diagnosis import DiagnosisSettings
from pamrs.diagnosis.settings import EvidenceSettings, NoiseSettings, settings_table
from pamrs.effects import EFFECTS
from pamrs.recordings import Recording

ROOT = Path(__file__).parents[2]
DIAGNOSIS = ROOT / "python/pamrs/diagnosis"
CONSTANTS = {
    "prepare/_ambient.py": {"_SAME"},  # of temperatures that are told as one
    # of a filter, a flip of a converter, a least squares and a quotient
    "prepare/_deviations.py": {"_TAPS", "_SOON", "_ROWS", "_TINY"},
    "prepare/_signals.py": {"_TERMS"},  # of a cubic
    "screen/_leave_one_out.py": {"_RIDGE"},  # keeps a matrix invertible
    "prepare/_plausible.py": {"_DEGREES", "_TOLD"},  # of a circle; findings that a message lists
    "prepare/_rails.py": {"_TOLD"},  # recordings that a message counts
    "next_experiment/_chains.py": {"_LEAST_SHARE"},  # of the choked flow
    "explain/_conditions.py": {"_MAP_CELLS", "_ONE_SIDED"},  # of a picture and of words
    "explain/_assemble.py": {"_REFERENCE_DENSITY"},  # of ISO 6358
    "explain/_closure_words.py": {"_UNITS"},  # of sizes that are told
    "prove.py": {"TIMEOUT", "_POLL"},  # of processes
}
"""Numbers of modules that steer no verdict, and what they are."""


def sealed_case(conductance: float = 3e-11) -> pamrs.Case:
    """A hold of a known chamber that leaks, 60 s at 10 Hz."""
    rig = pamrs.rigs.sealed_chamber()
    truth = rig.with_effect("leak_muscle", {"conductance": conductance})
    run = pamrs.simulate(
        truth, duration=60.0, sample_time=0.1, step=0.01, initial={"muscle_pressure": 7e5}
    )
    pressure = run["muscle_pressure"] + np.random.default_rng(1).normal(0.0, 150.0, run.time.size)
    mask = {"muscle_pressure": np.ones(run.time.size, dtype=bool)}
    recording = Recording(
        "hold",
        "fit",
        run.time,
        0.1,
        {"muscle_pressure": pressure},
        mask,
        [],
        {"muscle_pressure": "Pa"},
    )
    return pamrs.Case("hold", rig, [recording], Path())


def numbers(tree: ast.Module) -> set[str]:
    """Names that a module gives a number, or a collection with a number in it, at its own level."""
    found = set()
    for statement in tree.body:
        if isinstance(statement, ast.Assign):
            targets, value = statement.targets, statement.value
        elif isinstance(statement, ast.AnnAssign) and statement.value is not None:
            targets, value = [statement.target], statement.value
        else:
            continue
        literal = (
            not isinstance(value, (ast.Call, ast.Subscript))
            or isinstance(value, ast.Call)
            and not value.args
        )
        constants = [
            n
            for n in ast.walk(value)
            if isinstance(n, ast.Constant) and type(n.value) in (int, float)
        ]
        if constants and literal:
            found |= {
                n.id for target in targets for n in ast.walk(target) if isinstance(n, ast.Name)
            }
    return found


def test_no_module_keeps_a_number_of_its_own() -> None:
    found = {}
    for path in sorted(DIAGNOSIS.rglob("*.py")):
        inside = path.relative_to(DIAGNOSIS).as_posix()
        if not inside.startswith("settings/"):
            own = numbers(ast.parse(path.read_text(encoding="utf-8")))
            found[inside] = own - CONSTANTS.get(inside, set())
            assert CONSTANTS.get(inside, set()) <= own, f"{inside}: not there any more"
    assert not {name: own for name, own in found.items() if own}


def test_no_function_reads_a_default() -> None:
    """Whoever needs settings is given them; only what a user calls makes the published ones."""
    makers = {
        "__init__.py",
        "result.py",
        "next_experiment/_choice.py",
        "next_experiment/_planning.py",
    }
    for path in sorted(DIAGNOSIS.rglob("*.py")):
        inside = path.relative_to(DIAGNOSIS).as_posix()
        tree = ast.parse(path.read_text(encoding="utf-8"))
        calls = {
            n.func.id
            for n in ast.walk(tree)
            if isinstance(n, ast.Call) and isinstance(n.func, ast.Name)
        }
        made = {name for name in calls if name.endswith("Settings")}
        assert not made or inside.startswith("settings/") or inside in makers, (
            f"{inside} makes {made}"
        )


def test_every_setting_says_what_it_is_and_where_it_comes_from() -> None:
    table = list(settings_table())
    assert len({s.name for s in table}) == len(table) > 200
    for one in table:
        assert all(len(text) >= 1 for text in (one.unit, one.reason, one.origin)), one.name
        assert len(one.reason.split()) >= 2, one.name


def test_settings_go_through_json() -> None:
    settings = DiagnosisSettings().with_values(
        {
            "evidence.softness": 0.5,
            "prepare.start_reaches": [0.05, 0.1],
            "search.most_singles": 3,
            "seed": 7,
        }
    )
    again = DiagnosisSettings.from_dict(json.loads(json.dumps(settings.to_dict())))
    assert again == settings != DiagnosisSettings()
    assert again.prepare.start_reaches == (0.05, 0.1)
    # what is left out keeps its default
    assert (
        DiagnosisSettings.from_dict({"evidence": {"softness": 0.5}}).evidence == settings.evidence
    )
    with pytest.raises(dataclasses.FrozenInstanceError):
        settings.evidence.softness = 1.0  # type: ignore[misc]


@pytest.mark.parametrize(
    ("values", "message"),
    [
        (
            {"evidence.softness": -1.0},
            r"EvidenceSettings.softness = -1.0 is not allowed: a finite number above 0",
        ),
        (
            {"noise.chance": float("nan")},
            r"NoiseSettings.chance = nan is not allowed: .* above 0 and at most 0.5",
        ),
        (
            {"search.most_singles": 1.5},
            r"SearchSettings.most_singles = 1.5 is not allowed: a whole number at least 1",
        ),
        ({"search.most_singles": True}, r"most_singles = True is not allowed"),
        (
            {"screen.place_shares": []},
            r"place_shares = \[\] is not allowed: like \[0.5, 0.75, 0.93\]",
        ),
        ({"screen.place_shares": [0.5, "much"]}, r"place_shares = \[0.5, 'much'\] is not allowed"),
        ({"screen.place_shares": [1.5]}, r"place_shares = 1.5 is not allowed: .* at most 1"),
        (
            {"wrong_parameters.wrong_together": [["arm.mass"]]},
            r"wrong_together = .* is not allowed",
        ),
        (
            {"verdict.quiet_likely": 0.5},
            r"quiet_likely \+ quiet_other \+ quiet_unlisted = 0.67 is not allowed",
        ),
        ({"evidence.x": 1.0}, r"settings has no 'evidence.x': one of log_odds_explained"),
        ({"softness": 1.0}, r"settings has no 'softness': one of prepare"),
        ({"seed": -1}, r"seed = -1 is not allowed: a whole number, 0 or more"),
    ],
)
def test_what_is_not_allowed_is_named(values: dict[str, object], message: str) -> None:
    with pytest.raises(pamrs.ParameterError, match=message):
        DiagnosisSettings().with_values(values)


def test_groups_are_checked_as_a_whole() -> None:
    with pytest.raises(
        pamrs.ParameterError, match="evidence is a NoiseSettings; a EvidenceSettings is needed"
    ):
        DiagnosisSettings(evidence=NoiseSettings())  # type: ignore[arg-type]
    with pytest.raises(pamrs.ParameterError, match="settings has 'evidences'"):
        DiagnosisSettings.from_dict({"evidences": {}})
    with pytest.raises(pamrs.ParameterError, match=r"settings.evidence is a list"):
        DiagnosisSettings.from_dict({"evidence": []})
    with pytest.raises(pamrs.ParameterError, match="settings = 5 is not allowed"):
        DiagnosisSettings.from_dict(5)  # type: ignore[arg-type]
    with pytest.raises(pamrs.ParameterError, match="values has the key 3"):
        DiagnosisSettings().with_values({3: 1})  # type: ignore[dict-item]
    with pytest.raises(pamrs.ParameterError, match="EvidenceSettings has no 'soft'"):
        EvidenceSettings.from_dict({"soft": 1.0})


def test_a_setting_that_changes_changes_the_outcome_and_is_kept() -> None:
    case = sealed_case()
    usual = pamrs.diagnose(case)
    assert usual.verdict == "effects"
    assert usual.settings == DiagnosisSettings()
    cautious = DiagnosisSettings().with_values(
        {"evidence.most_probability": 0.3, "evidence.drift_probability": 0.2, "verdict.named": 0.45}
    )
    other = pamrs.diagnose(case, settings=cautious)
    assert other.verdict == "unlisted"
    assert max(other.probabilities["leak_muscle"], 0.0) <= 0.4 < usual.probabilities["leak_muscle"]
    told = json.loads(other.to_json())["settings"]
    assert DiagnosisSettings.from_dict(told) == other.settings == cautious


def words(path: Path) -> list[tuple[int, str]]:
    """Every text in the code of a module, docstrings left out."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    docs = {
        id(node.body[0].value)
        for node in ast.walk(tree)
        if isinstance(node, (ast.Module, ast.FunctionDef, ast.ClassDef))
        and node.body
        and isinstance(node.body[0], ast.Expr)
    }
    own = [
        n
        for n in ast.walk(tree)
        if isinstance(n, ast.Constant) and isinstance(n.value, str) and id(n) not in docs
    ]
    return [(n.lineno, n.value) for n in own]


@pytest.mark.parametrize("package", ["diagnosis", "report", "findings"])
def test_no_rule_is_for_a_single_effect(package: str) -> None:
    """What holds for an effect is a property that any effect may have, declared with it."""
    home = ROOT / "python/pamrs" / package
    told = [(path, line, text) for path in sorted(home.rglob("*.py")) for line, text in words(path)]
    assert told
    named = [
        f"{path.relative_to(home)}:{line}: {effect}"
        for path, line, text in told
        for effect in EFFECTS
        if effect in text.replace(".", " ").replace("+", " ").split()
    ]
    assert not named
