"""How much there is: statements of each package, lines of each function, and things that a class
name stands for.

Statements are counted (nodes of ``ast.stmt``), which no packing of lines makes fewer. A change that
passes one budget lowers another one in the same commit; the sum grows only where an issue has
granted it.
"""

from __future__ import annotations

import ast
from collections import Counter
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]

#: Statements that a package of pamrs may have; ``.`` are the modules beside the packages.
PACKAGES = {
    ".": 1112,
    "campaigns": 1142,
    "cli": 1401,
    "control": 4593,
    "design": 530,
    "diagnosis": 11168,
    "effects": 404,
    "experiments": 1078,
    "findings": 961,
    "fit": 2936,
    "library": 71,
    "recordings": 5015,
    "report": 1959,
    "rig": 2226,
    "rigs": 141,
    "simulation": 1095,
    "studio": 663,
    "sweeps": 812,
}
#: The same of what is not the package.
ASIDE = {
    "tests": 28013,
    "benchmarks/tests": 240,
    "reproduction": 5045,
    "reproduction/tests": 1356,
    "trial": 5716,
    "trial/tests": 1235,
}
#: All of pamrs: the sum of the budgets is not above it.
MOST = 37307
#: Share of a budget that a package may stay below it; with more to spare, the budget is lowered.
SPARE = 0.01


@cache
def tree(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"))


def files(folder: str) -> list[Path]:
    """Python files below a folder, but for those in a folder of tests beside them."""
    home = ROOT / folder
    return sorted(path for path in home.rglob("*.py") if home / "tests" not in path.parents)


def statements(path: Path) -> int:
    return sum(isinstance(node, ast.stmt) for node in ast.walk(tree(path)))


def counted() -> dict[str, int]:
    """Statements by package, then of the folders beside it."""
    found: Counter[str] = Counter()
    for path in files("python/pamrs"):
        first, *rest = path.relative_to(ROOT / "python/pamrs").parts
        found[first if rest else "."] += statements(path)
    found.update({folder: sum(map(statements, files(folder))) for folder in ASIDE})
    return found


def judged(found: dict[str, int], budgets: dict[str, int]) -> list[str]:
    """What is against the budgets, by how much, and what to do."""
    said = []
    for name in sorted({*found, *budgets}):
        more = found.get(name, 0) - budgets.get(name, 0)
        if more > 0:
            said.append(
                f"{name} has {found[name]} statements, {more} above its budget: take them away, or "
                f"lower the budget of another package by {more} in the same commit and raise this"
            )
        elif more < -max(10, SPARE * budgets[name]) or name not in found:
            said.append(
                f"{name} has {-more} fewer than its budget: lower it to {found.get(name, 0)}"
            )
    return said


def test_no_package_is_above_its_budget_or_far_below() -> None:
    assert not judged(counted(), PACKAGES | ASIDE), "\n".join(judged(counted(), PACKAGES | ASIDE))


def test_the_budgets_together_do_not_grow() -> None:
    more = sum(PACKAGES.values()) - MOST
    assert more <= 0, f"the budgets are {more} above {MOST} together: lower others by as many"


def test_a_budget_says_by_how_much_it_is_passed() -> None:
    over, under, gone = judged({"a": 7, "b": 1}, {"a": 5, "b": 40, "c": 3})
    assert "a has 7 statements, 2 above its budget" in over
    assert "lower the budget of another package by 2" in over
    assert "b has 39 fewer than its budget: lower it to 1" in under
    assert "lower it to 0" in gone
    assert not judged({"a": 5, "b": 31}, {"a": 5, "b": 40})


MOST_LINES = 70


def lengths(path: Path) -> Iterator[tuple[str, int]]:
    """Name and lines of code of every function: without its signature, docstring, comments and
    blank lines, as clippy counts.
    """
    lines = path.read_text(encoding="utf-8").splitlines()
    for node in ast.walk(tree(path)):
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
            body = node.body[ast.get_docstring(node) is not None :]
            own = lines[body[0].lineno - 1 : node.end_lineno] if body else []
            yield node.name, sum(bool(line.strip()) and line.strip()[0] != "#" for line in own)


@pytest.mark.parametrize("folder", ["python/pamrs", "trial", "benchmarks", "reproduction"])
def test_functions_can_be_read_in_one_sitting(folder: str) -> None:
    found = {(path, name): count for path in files(folder) for name, count in lengths(path)}
    assert len(found) > 100
    assert not {key: count for key, count in found.items() if count > MOST_LINES}


#: Names of two classes, which are public in their packages or in messages.
TWICE = {"Clock", "Entry", "Event", "Form", "Part", "Reader"}


def test_a_class_name_stands_for_one_thing() -> None:
    found = Counter(
        node.name
        for path in files("python/pamrs")
        for node in ast.walk(tree(path))
        if isinstance(node, ast.ClassDef)
    )
    assert {name for name, count in found.items() if count > 1} == TWICE
