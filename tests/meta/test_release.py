"""What goes out with a release says the same everywhere, and CI runs what it names."""

import re
import tomllib
from pathlib import Path

import pamrs
from pamrs import _core

ROOT = Path(__file__).parents[2]


def text(name):
    return (ROOT / name).read_text(encoding="utf-8")


def test_the_version_is_written_in_one_place():
    version = tomllib.loads(text("Cargo.toml"))["workspace"]["package"]["version"]
    assert pamrs.__version__ == _core.__version__ == version
    assert re.search(r"^## (\S+),", text("CHANGELOG.md"), re.M)[1] == version
    assert tomllib.loads(text("pyproject.toml"))["project"]["dynamic"] == ["version"]
    for crate in ("pam-core", "pam-py"):
        package = tomllib.loads(text(f"crates/{crate}/Cargo.toml"))["package"]
        assert package["version"] == {"workspace": True}
    assert not re.search(r"^version:", text("CITATION.cff"), re.M)


def test_address_and_licence_are_the_same_everywhere():
    project = tomllib.loads(text("pyproject.toml"))["project"]
    citation = dict(re.findall(r"^([\w-]+): \"?([^\"\n]+)", text("CITATION.cff"), re.M))
    assert citation["repository-code"] == project["urls"]["Repository"]
    assert citation["license"] == project["license"]
    assert all(url.startswith(project["urls"]["Repository"]) for url in project["urls"].values())


def test_the_page_on_versions_is_short_and_names_the_schemas():
    page = text("docs/versions.md")
    assert len(page.split()) <= 250
    named = set(re.findall(r"`(pamrs\.\w+/\d+)`", page))
    package = "".join(p.read_text("utf-8") for p in (ROOT / "python/pamrs").rglob("*.py"))
    found = set(re.findall(r"\bpamrs\.(?:rig|case|force_map|diagnosis)/\d+", package))
    assert named == found - {"pamrs.diagnosis/1"}


def test_ci_runs_what_is_there():
    jobs = text(".github/workflows/tests.yml")
    verbs = set(re.findall(r"^([a-z-]+):", text("Makefile"), re.M))
    assert set(re.findall(r"run: make ([a-z-]+)", jobs)) == {"wheel-test", "docs"} <= verbs
    both = jobs + text(".github/workflows/wheels.yml")
    files = set(re.findall(r"run: (?:python )?(\S+/\S+)", both))
    assert files == {".ci/run", ".ci/wheel.py", "tests/wheel.py"}
    assert all((ROOT / name).exists() for name in files)
