"""Rules of the house that no linter knows."""

import doctest
import importlib
import inspect
import pkgutil
import re
import subprocess
import sys
import tomllib
from itertools import chain
from pathlib import Path

import pytest

import pamrs

ROOT = Path(__file__).parents[2]


def modules():
    """Every module of the package that is written in Python, entry points left out."""
    names = ["pamrs"]
    for found in pkgutil.walk_packages(pamrs.__path__, "pamrs."):
        if found.name.rpartition(".")[2] not in ("__main__", "_core"):
            names.append(found.name)
    return names


def public_callables():
    """The functions of the public interface and the public methods of its classes."""
    for name in pamrs.__all__:
        thing = getattr(pamrs, name, None)
        if inspect.isfunction(thing):
            yield f"pamrs.{name}", thing
        elif inspect.isclass(thing):
            for method, function in vars(thing).items():
                function = getattr(function, "__func__", function)
                if not method.startswith("_") and inspect.isfunction(function):
                    yield f"pamrs.{name}.{method}", function


CALLABLES = dict(public_callables())


@pytest.mark.parametrize("name", CALLABLES)
def test_every_argument_is_documented(name):
    function = CALLABLES[name]
    text = inspect.getdoc(function)
    assert text, f"{name} has no docstring"
    arguments = [
        word for word in inspect.signature(function).parameters if word not in ("self", "cls")
    ]
    if not arguments:
        return
    section = re.search(
        r"^Parameters\n-{3,}\n(.*?)(?=^\w[^\n]*\n-{3,}$|\Z)", text, re.MULTILINE | re.DOTALL
    )
    assert section, f"{name}: the docstring has no Parameters section"
    documented = set()
    for line in section[1].splitlines():
        if line and not line[0].isspace():
            documented |= {word.strip().lstrip("*") for word in line.split(" : ")[0].split(",")}
    missing = [word for word in arguments if word not in documented]
    assert not missing, f"{name}: not documented: {', '.join(missing)}"


@pytest.mark.parametrize("name", modules())
def test_examples_in_docstrings_run(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    outcome = doctest.testmod(importlib.import_module(name), optionflags=doctest.ELLIPSIS)
    assert outcome.failed == 0


@pytest.mark.parametrize("name", modules())
def test_modules_and_functions_say_what_they_are(name):
    module = importlib.import_module(name)
    assert module.__doc__
    for word, function in vars(module).items():
        if not word.startswith("_") and getattr(function, "__module__", "") == name:
            assert function.__doc__ or not inspect.isfunction(function), word


HEAVY = ("scipy", "pandas", "matplotlib", "jinja2", "xarray", "zarr", "dask")


@pytest.mark.parametrize(
    ("used", "absent"),
    [
        ("dir(pamrs)", (*HEAVY, "numpy", "pamrs._core", "pamrs.rig", "pamrs.control")),
        ("pamrs.rigs.shoulder(); pamrs.load_recording; pamrs.load_case", (*HEAVY, "typer")),
        ("import pamrs.cli; pamrs.cli.main(['--help'])", (*HEAVY, "numpy")),
        ("pamrs.simulate(pamrs.rigs.tube(), sample_time=0.1, duration=0.2)", ("matplotlib",)),
    ],
)
def test_import_is_light(used, absent):
    told = f"sys.exit(','.join(m for m in {absent!r} if m in sys.modules) or 0)"
    code = f"import sys, pamrs; {used}; {told}"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, f"{used} also imports {done.stderr}"


def test_public_names_exist():
    assert set(pamrs.__all__) <= set(dir(pamrs))
    assert dir(pamrs.rigs) == sorted(pamrs.rigs.names())
    for name in pamrs.__all__:
        assert getattr(pamrs, name) is not None
    with pytest.raises(AttributeError, match="nonsense"):
        _ = pamrs.nonsense


def plain(name):
    return re.sub(r"[-_.]+", "-", name).lower()


def pinned(lock):
    text = (ROOT / lock).read_text(encoding="utf-8")
    return {plain(name) for name in re.findall(r"^([\w.-]+)==", text, re.MULTILINE)}


def test_locks_pin_every_dependency():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    extras = dict(project["optional-dependencies"])
    wanted = {name: extras.pop(name) for name in ("bench", "docs")}
    wanted["dev"] = [*project["dependencies"], *chain.from_iterable(extras.values())]
    taken = set()
    for name, requirements in wanted.items():
        needed = {plain(re.split(r"[\s<>=!~\[;]", one)[0]) for one in requirements} - {"pamrs"}
        there = pinned(f"requirements-{name}.lock")
        assert needed <= there
        assert not taken & there
        taken |= there


def test_locks_are_what_pyproject_allows():
    """`make lock` takes the oldest Python that is supported, and pins what is in the ranges."""
    requirements = pytest.importorskip("packaging.requirements")
    with (ROOT / "pyproject.toml").open("rb") as file:
        project = tomllib.load(file)["project"]
    files = [ROOT / f"requirements-{name}.lock" for name in ("dev", "bench", "docs")]
    lines = [file.read_text(encoding="utf-8").splitlines() for file in files]
    oldest = project["requires-python"].removeprefix(">=")
    for head, *_ in lines:
        assert f"made for Python {oldest} by `make lock`" in head
    pins = (line.split("==") for _, *rest in lines for line in rest)
    pinned = {name.lower().replace("_", "-"): version for name, version in pins}
    for text in chain(project["dependencies"], *project["optional-dependencies"].values()):
        wanted = requirements.Requirement(text)
        if wanted.name != "pamrs":
            assert pinned[wanted.name.lower().replace("_", "-")] in wanted.specifier, text
    recipe = (ROOT / "Makefile").read_text(encoding="utf-8").partition("\nlock:")[2]
    assert f"!= ({oldest.replace('.', ', ')})" in recipe.partition("\n\n")[0]


#: pages that are read whole, with the most words that they may have
PAGES = {"README.md": 900, "ARCHITECTURE.md": 1200}


@pytest.mark.parametrize("name", PAGES)
def test_pages_that_are_read_whole_stay_short(name):
    assert len((ROOT / name).read_text(encoding="utf-8").split()) <= PAGES[name]


DECISIONS = {page.name[:4]: page for page in (ROOT / "docs/decisions").glob("[0-9]*.md")}
MOST_DECISIONS = 35


@pytest.mark.parametrize("number", DECISIONS)
def test_a_decision_has_a_status_and_all_its_parts(number):
    heading, _, status, *rest = DECISIONS[number].read_text(encoding="utf-8").splitlines()
    assert heading.startswith(f"# {number} ")
    found = re.match(r"Status: (in force \(\d{4}-\d\d-\d\d\)|replaced by (\d{4}))\.", status)
    assert found, f"{number}: {status}"
    assert found[2] is None or found[2] in DECISIONS
    text = "\n".join(rest)
    missing = [
        part
        for part in ("Decided", "Reason", "Price", "Alternatives")
        if f"\n**{part}.** " not in text
    ]
    assert found[2] or not missing


def test_the_index_lists_every_decision_and_there_are_few():
    assert 0 < len(DECISIONS) <= MOST_DECISIONS
    index = (ROOT / "docs/decisions/README.md").read_text(encoding="utf-8")
    listed = re.findall(r"^- \[(\d{4})\]\((\S+)\) \S", index, re.MULTILINE)
    assert sorted(listed) == sorted((number, page.name) for number, page in DECISIONS.items())


def referenced_decisions(path):
    """Numbers of decisions that a file names: `docs/decisions/NNNN and NNNN`, `decision NNNN`, and
    within the decisions `(NNNN)` too, but for what a page takes in.
    """
    text = re.sub(r"^Status: .*$", "", path.read_text(encoding="utf-8"), flags=re.MULTILINE)
    more = r"(?:(?:, then |, | and )\d{4})*"
    for found in re.findall(rf"\bdecisions?[/ ](\d{{4}}{more})", text):
        yield from re.findall(r"\d{4}", found)
    if path.parent == ROOT / "docs/decisions":
        yield from re.findall(r"\((0\d{3})\)", text)


def test_decisions_that_are_referred_to_exist():
    folders = ("python", "crates", "tests", "trial", "benchmarks", "fingerprints", "cases", "docs")
    files = [*ROOT.glob("*.md")]
    for folder in (*folders, "reproduction"):
        every = (ROOT / folder).rglob("*")
        files += [path for path in every if path.suffix in (".py", ".rs", ".md", ".toml")]
    named = {(path, number) for path in files for number in referenced_decisions(path)}
    assert len(named) > 50
    assert not {
        f"{path.relative_to(ROOT)}: {number}" for path, number in named if number not in DECISIONS
    }


def test_links_between_pages_lead_somewhere():
    folders = ("docs", "cases", "trial", "benchmarks", "tests")
    pages = [*ROOT.glob("*.md"), *(p for name in folders for p in (ROOT / name).rglob("*.md"))]
    assert len(pages) > 50
    lost = []
    for page in pages:
        if page.parent.name == "pages":  # texts of pages that stand elsewhere
            continue
        text = re.sub(r"```.*?```", "", page.read_text(encoding="utf-8"), flags=re.DOTALL)
        for link in re.findall(r"\]\(([^)#\s]+)", text):
            if "://" not in link and not (page.parent / link).exists():
                lost.append(f"{page.relative_to(ROOT)}: {link}")
    assert not lost
