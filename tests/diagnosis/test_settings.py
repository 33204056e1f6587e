"""Settings of a diagnosis: few, each with its reason, passed in, in the result where changed; every
other number is a constant with its reason beside its use.
"""

from __future__ import annotations

import ast
import dataclasses
import json
from pathlib import Path

import pytest

import pamrs
from pamrs.diagnosis import DiagnosisSettings
from pamrs.effects import EFFECTS
from tests.diagnosis.held import held

ROOT = Path(__file__).parents[2]
DIAGNOSIS = ROOT / "python/pamrs/diagnosis"


def numbers(tree: ast.Module) -> dict[str, ast.stmt]:
    """Statements that give a name of a module a number, or a collection with a number in it."""
    found: dict[str, ast.stmt] = {}
    for statement in tree.body:
        value = getattr(statement, "value", None)
        if not isinstance(statement, (ast.Assign, ast.AnnAssign)) or value is None:
            continue
        constants = [n.value for n in ast.walk(value) if isinstance(n, ast.Constant)]
        if {int, float} & set(map(type, constants)) and not isinstance(value, ast.Subscript):
            targets = getattr(statement, "targets", None) or [statement.target]
            names = [n for t in targets for n in ast.walk(t) if isinstance(n, ast.Name)]
            found |= {n.id: statement for n in names}
    return found


def without_reason(text: str) -> list[str]:
    """Numbers of a module with no comment behind, above or text below them."""
    tree, lines = ast.parse(text), text.splitlines()
    alone = (n for n in tree.body if isinstance(n, ast.Expr) and isinstance(n.value, ast.Constant))
    texts = {n.lineno for n in alone if isinstance(n.value.value, str)}
    return [
        name
        for name, own in numbers(tree).items()
        if "#" not in lines[own.lineno - 1]
        and not lines[own.lineno - 2].startswith("#")
        and (own.end_lineno or own.lineno) + 1 not in texts
    ]


def test_every_number_of_a_module_has_its_reason() -> None:
    assert without_reason("_A = 1\n\n_B = 2  # of a cubic\n# of air\n_C = (3, 4)\n") == ["_A"]
    found = {
        path.relative_to(DIAGNOSIS).as_posix(): without_reason(path.read_text("utf-8"))
        for path in sorted(DIAGNOSIS.rglob("*.py"))
    }
    assert sum(map(len, found.values())) == 0, {k: v for k, v in found.items() if v}
    assert len(found) > 50


def test_a_name_of_a_constant_has_one_value() -> None:
    pairs = {
        (n.id.lstrip("_"), ast.unparse(node.value))
        for path in [*DIAGNOSIS.rglob("*.py"), *DIAGNOSIS.with_name("findings").rglob("*.py")]
        for node in ast.parse(path.read_text("utf-8")).body
        if isinstance(node, (ast.Assign, ast.AnnAssign)) and node.value is not None
        for n in ast.walk(node)
        if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store) and n.id.isupper()
    }
    names = [name for name, _ in pairs]
    assert len(names) > 200
    assert not [pair for pair in pairs if names.count(pair[0]) > 1]


def test_no_function_reads_a_default() -> None:
    """Whoever needs settings is given them; only what a user calls makes the published ones."""
    asked = ("next_experiment/_choice.py", "next_experiment/_planning.py")
    makers = {"__init__.py", "result.py", *asked}
    for path in sorted(DIAGNOSIS.rglob("*.py")):
        tree = ast.parse(path.read_text(encoding="utf-8"))
        calls = {getattr(n.func, "id", "") for n in ast.walk(tree) if isinstance(n, ast.Call)}
        inside = path.relative_to(DIAGNOSIS).as_posix()
        assert "DiagnosisSettings" not in calls or inside in makers, inside


def test_settings_are_few_and_each_says_what_it_is_and_where_it_comes_from() -> None:
    every = dataclasses.fields(DiagnosisSettings)
    assert 20 < len(every) <= 50
    for one in every:
        told = one.metadata
        assert all(told[key] for key in ("unit", "about", "origin")), one.name
        assert len(told["about"].split()) >= 2, one.name
        assert told["least"] <= one.default <= told["most"], one.name


def test_every_setting_is_read() -> None:
    folders = (DIAGNOSIS, DIAGNOSIS.parent / "experiments")
    text = "".join(path.read_text("utf-8") for f in folders for path in f.rglob("*.py"))
    unread = [f.name for f in dataclasses.fields(DiagnosisSettings) if f".{f.name}" not in text]
    assert not unread


def test_settings_go_through_json() -> None:
    settings = DiagnosisSettings(most_room=340.0, most_singles=3, seed=7)
    told = json.loads(json.dumps(settings.to_dict()))
    assert told == {"most_singles": 3, "most_room": 340.0, "seed": 7}
    assert DiagnosisSettings.from_dict(told) == settings != DiagnosisSettings()
    assert DiagnosisSettings().to_dict() == {}
    with pytest.raises(dataclasses.FrozenInstanceError):
        settings.most_room = 1.0  # type: ignore[misc]


@pytest.mark.parametrize(
    ("values", "message"),
    [
        (
            {"most_room": -1.0},
            r"most_room = -1.0 is not allowed: a finite number, at least .* \[K\]",
        ),
        ({"noise_chance": float("nan")}, r"noise_chance = nan is not allowed: .*, at most 0.5"),
        ({"most_singles": 1.5}, r"most_singles = 1.5 is not allowed: a whole number, at least 1"),
        ({"most_singles": True}, r"most_singles = True is not allowed"),
        ({"most_room": "warm"}, r"most_room = 'warm' is not allowed"),
        ({"seed": -1}, r"seed = -1 is not allowed: a whole number, at least 0"),
        (
            {"softness": 1.0},
            r"settings has 'softness', which is not allowed: one of smoothing_time",
        ),
        ({3: 1}, r"settings has the key 3"),
        (5, r"settings = 5 is not allowed"),
    ],
)
def test_what_is_not_allowed_is_named(values: dict[str, object], message: str) -> None:
    with pytest.raises(pamrs.ParameterError, match=message):
        DiagnosisSettings.from_dict(values)


def test_a_setting_that_changes_changes_the_outcome_and_is_kept() -> None:
    case = held(3e-11, 60.0)
    usual = pamrs.diagnose(case)
    assert usual.verdict == "effects"
    assert usual.settings == DiagnosisSettings()
    content = json.loads(usual.to_json())
    assert content["settings"] == {}
    assert content["version"] == pamrs.__version__
    cautious = DiagnosisSettings(most_probability=0.3, drift_probability=0.2, named=0.45)
    other = pamrs.diagnose(case, settings=cautious)
    assert other.verdict == "unlisted"
    assert max(other.probabilities["leak_muscle"], 0.0) <= 0.4 < usual.probabilities["leak_muscle"]
    told = json.loads(other.to_json())["settings"]
    assert told == {"most_probability": 0.3, "drift_probability": 0.2, "named": 0.45}
    assert DiagnosisSettings.from_dict(told) == other.settings == cautious


def words(path: Path) -> list[tuple[int, str]]:
    """Every text in the code of a module, docstrings left out."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    documented = (ast.Module, ast.FunctionDef, ast.ClassDef)
    first = [n.body[0] for n in ast.walk(tree) if isinstance(n, documented) and n.body]
    docs = {id(n.value) for n in first if isinstance(n, ast.Expr)}
    own = [n for n in ast.walk(tree) if isinstance(n, ast.Constant) and id(n) not in docs]
    return [(n.lineno, n.value) for n in own if isinstance(n.value, str)]


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
