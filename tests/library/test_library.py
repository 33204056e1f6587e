"""The library of published muscles: their numbers, each with an origin."""

from __future__ import annotations

import numpy as np
import pytest

import pamrs
import pamrs.library as library
from pamrs.errors import ParameterError
from tests.scripts import script


@pytest.mark.parametrize("name", library.names())
def test_every_number_has_an_origin(name):
    item = library.entry(name)
    assert set(item.parameters) <= set(item.origins)
    assert "max_pressure" in item.origins
    assert ("mass" in item.origins) == (item.mass is not None)
    words = ("published", "deduced", "identified", "assumed", "prior", "the shoulder rig's")
    assert all(text.startswith(words) for text in item.origins.values())
    assert getattr(library, name)() is item.muscle


def test_shoulder_muscle_is_the_rigs():
    rig = pamrs.rigs.shoulder().muscle
    e = np.linspace(0.0, 0.3, 13)
    np.testing.assert_allclose(library.pam_a_1in().force(4e5, e), rig.force(4e5, e), rtol=1e-12)


def test_one_beats_two_by_the_offsets_alone():
    muscle = library.pam_a_1in()
    e = np.linspace(0.01, 0.3, 30)
    for pressure in (2e5, 4e5):
        gain = muscle.force(2 * pressure, e) - 2 * muscle.force(pressure, e)
        expected = -muscle.elastic_basis(e)[:, :2] @ np.array([1.15e6, -0.15e6])
        np.testing.assert_allclose(gain, expected, rtol=1e-9)
        assert np.all(gain > 0.0)


def test_friction_line_of_chapter_2():
    muscle = library.ch2_075in()
    for pressure, expected in ((1e5, 0.1455), (4e5, 0.102), (2e6, 0.01)):
        back, forth = (float(muscle.force(pressure, 0.0, direction=way)) for way in (1, -1))
        assert (back - forth) / (back + forth) == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("name", library.names())
def test_the_bench_of_a_muscle_has_that_muscle(tmp_path, name):
    muscle, path = library.entry(name).muscle, tmp_path / "bench.toml"
    pamrs.rigs.bench(muscle, name).to_toml(path)
    rig = pamrs.load_rig(path)
    assert (rig.name, rig.muscle.parameters) == (name, muscle.parameters)
    volume = 0.1 * float(muscle.air_volume(0.0))
    assert rig.parameter("chamber.dead_volume").value == pytest.approx(volume)


def test_bad_names():
    with pytest.raises(ParameterError, match="did you mean 'pam_a_1in'"):
        library.entry("pam_a_1inch")


def test_import_is_light():
    heavy = "{'scipy', 'matplotlib', 'pandas', 'jinja2', 'typer'}"
    code = "import sys, pamrs.library, pamrs.design.sizing"
    assert script(f"{code}; print(*({heavy} & set(sys.modules)))") == []
