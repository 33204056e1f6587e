"""What may import what: the order of the packages, no cycles, nothing private from outside."""

import ast
import graphlib
from functools import cache
from pathlib import Path

import grimp
import pytest

import pamrs.diagnosis.fit
import pamrs.simulation

ROOT = Path(__file__).parents[2]

#: From the bottom to the top; a package imports only what stands in lines above its own.
#: Those in one line do not know each other.
LAYERS = (
    ("errors",),
    ("units", "channels"),
    ("declared", "_checks"),
    (
        "_arrays",
        "_files",
        "_losses",
        "_progress",
        "_tables",
        "_views",
        "_writing",
    ),
    ("findings",),
    ("effects",),
    ("rig",),
    ("recordings", "rigs"),
    ("simulation",),
    ("experiments", "report"),
    ("fit", "library"),
    ("control", "design"),
    ("sweeps",),
    ("diagnosis",),
    ("campaigns",),
    ("studio",),
    ("cli",),
)
#: The same inside the diagnosis: its steps, then the result, what is said of it, and who runs it.
STEPS = ("settings", "prepare", "fit", "noise", "missing", "screen", "evidence", "search", "model")
STEPS_OF_A_DIAGNOSIS = (
    *STEPS,
    "limits",
    "next_experiment",
    "result",
    "laws",
    "explain",
    "",
)
#: Names that a module may take from the root package, which loads all others on first use.
FROM_ROOT = {"_core", "__version__"}


@cache
def graph(*, annotations: bool = True) -> grimp.ImportGraph:
    """Imports between the modules of pamrs, those inside functions too."""
    return grimp.build_graph("pamrs", cache_dir=None, exclude_type_checking_imports=not annotations)


def edges(*, annotations: bool = True) -> set[tuple[str, str]]:
    """Who imports whom; the root package and entry points, which nothing imports, are left out."""
    found = graph(annotations=annotations)
    return {
        (importer, imported)
        for importer in found.modules
        if importer != "pamrs" and not importer.endswith(".__main__")
        for imported in found.find_modules_directly_imported_by(importer)
        if imported != "pamrs"
    }


def part(module: str) -> str:
    """The package, or module, directly in pamrs that a module belongs to."""
    return module.split(".")[1]


def test_every_part_has_its_place():
    parts = {part(module) for module in graph().modules if module != "pamrs"}
    named = [name for layer in LAYERS for name in layer]
    assert len(named) == len(set(named))
    assert parts - {"__main__"} == set(named)


def test_no_package_imports_one_beside_or_above_it():
    height = {name: index for index, layer in enumerate(LAYERS) for name in layer}
    against = {
        (a, b) for a, b in edges() if part(a) != part(b) and height[part(b)] >= height[part(a)]
    }
    assert not against, "imports that go upward"


def test_no_step_of_a_diagnosis_imports_a_later_one():
    def step(module: str) -> str:
        return module.partition("pamrs.diagnosis")[2].strip(".").partition(".")[0]

    own = {(step(a), step(b)) for a, b in edges() if part(a) == part(b) == "diagnosis"}
    assert {name for pair in own for name in pair} == set(STEPS_OF_A_DIAGNOSIS)
    height = {name: index for index, name in enumerate(STEPS_OF_A_DIAGNOSIS)}
    assert not {(a, b) for a, b in own if height[b] > height[a]}


#: What fits a model, or runs one: `pamrs.diagnosis.fit` and `pamrs.simulation` have it.
WORK = {
    "changes",
    "fit",
    "fit_events",
    "levenberg_marquardt",
    "look_for_events",
    "predicted_with_doubt",
    "replay",
    "residuals",
    "simulate",
    "spread_over_pieces",
    "stacked",
}


def test_what_explains_a_diagnosis_fits_and_simulates_nothing():
    """Models are fitted and run by the steps before, which hand over what they found."""
    taken = {name for _, name in imports_of(ROOT / "python" / "pamrs" / "diagnosis" / "explain")}
    assert "pamrs.diagnosis.fit.Problem" in taken
    assert set(pamrs.diagnosis.fit.__all__) | set(pamrs.simulation.__all__) >= WORK
    assert not [name for name in taken if name.rpartition(".")[2] in WORK]
    assert not [name for name in taken if name.startswith("pamrs.diagnosis.search.find")]


def test_no_modules_import_each_other():
    """Imports for annotations alone are left out, but for a diagnosis and its report.

    Elsewhere a result has a method that draws it, and what draws it names the result in its
    signature; that import never runs. Between packages these imports count, see above.
    """
    needs: dict[str, set[str]] = {}
    strict = {
        (a, b) for a, b in edges() if {part(a), part(b)} <= {"diagnosis", "findings", "report"}
    }
    for importer, imported in edges(annotations=False) | strict:
        needs.setdefault(importer, set()).add(imported)
    try:
        graphlib.TopologicalSorter(needs).prepare()
    except graphlib.CycleError as error:
        pytest.fail(f"a cycle of imports: {' <- '.join(error.args[1])}")


#: Functions that load a module whose name is a value, which the graph of imports does not see.
LOADERS = {"import_module", "__import__", "exec_module"}


def loaded_by_name(path: Path) -> list[str]:
    """How each name of a module begins that a file loads as a value; empty of one not known."""
    text = path.read_text(encoding="utf-8")
    found = []
    for call in ast.walk(ast.parse(text)) if any(name in text for name in LOADERS) else ():
        named = {getattr(getattr(call, "func", None), key, "") for key in ("attr", "id")}
        if isinstance(call, ast.Call) and named & LOADERS:
            first = call.args[0]
            first = first.values[0] if isinstance(first, ast.JoinedStr) else first
            found.append(str(first.value) if isinstance(first, ast.Constant) else "")
    return found


def test_no_module_of_ours_is_loaded_by_its_name_from_outside_its_package():
    """The root alone loads everything on first use; a package loads so what is inside it."""
    home = ROOT / "python"
    files = [path.relative_to(home) for path in sorted((home / "pamrs").rglob("*.py"))]
    found = [(path, name) for path in files for name in loaded_by_name(home / path)]
    assert len(found) > 3
    assert not [
        (path, name)
        for path, name in found
        if path.parent.name != "pamrs"
        and not name.startswith(".".join(path.parent.parts) + ".")
        and (not name or name.startswith("pamrs"))
    ]


def test_only_the_core_and_the_version_come_from_the_root():
    modules = graph().modules
    for importer in sorted(graph().find_modules_that_directly_import("pamrs")):
        for details in graph().get_import_details(importer=importer, imported="pamrs"):
            line = details["line_contents"]
            names = {
                name.split(" as ")[0].strip()
                for name in line.partition(" import ")[2].strip("()").split(",")
            }
            others = {name for name in names - FROM_ROOT if f"pamrs.{name}" not in modules}
            assert not others, f"{importer}: {line}"


def test_nothing_imports_an_entry_point():
    for module in graph().modules:
        if module.endswith("__main__"):
            assert not graph().find_modules_that_directly_import(module)


def imported(node: ast.AST) -> list[str]:
    """Modules, and names as if they were, that a statement at its own level imports."""
    if isinstance(node, ast.Import):
        return [alias.name for alias in node.names]
    if isinstance(node, ast.ImportFrom) and node.module and not node.level:
        return [f"{node.module}.{alias.name}" for alias in node.names]
    return []


def imports_of(folder: Path) -> list[tuple[Path, str]]:
    """Every file below a folder, but its tests, with each of its imports."""
    return [
        (path, name)
        for path in sorted(folder.rglob("*.py"))
        if folder / "tests" not in path.parents
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        for name in imported(node)
    ]


def owner(module: str) -> str | None:
    """The package in which a private module or package may be imported; None for a public one."""
    words = module.split(".")
    private = [
        index
        for index, word in enumerate(words)
        if word.startswith("_") and not word.startswith("__")
    ]
    return ".".join(words[: private[0]]) if private else None


def test_private_modules_are_imported_in_their_package_alone():
    strange = [
        (a, b) for a, b in edges() if (home := owner(b)) and not f"{a}.".startswith(f"{home}.")
    ]
    assert not strange


@pytest.mark.parametrize(
    "folder", ["benchmarks", "cases", "demo", "docs", "fingerprints", "reproduction"]
)
def test_scripts_import_no_private_part_of_a_package(folder):
    """The private modules directly in pamrs are for all parts of this project."""
    mine = [pair for pair in imports_of(ROOT / folder) if pair[1].startswith("pamrs.")]
    assert not [(path, name) for path, name in mine if owner(name) not in (None, "pamrs")]


def test_trial_does_not_know_the_package():
    found = imports_of(ROOT / "trial")
    assert len(found) > 10
    assert not [(path, name) for path, name in found if name.split(".")[0] == "pamrs"]
