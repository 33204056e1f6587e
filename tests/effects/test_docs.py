"""The committed pages of the catalogue are what the table generates now, and every effect has a
picture.
"""

from __future__ import annotations

import struct
from pathlib import Path

import pytest

from fingerprints.pages import pages
from fingerprints.sheet import Sheet
from fingerprints.table import EXPERIMENTS
from pamrs.effects.text import catalogue

DOCS = Path(__file__).parents[2] / "docs" / "effects"
IDS = [info.id for infos in catalogue().values() for info in infos]


def test_every_effect_has_an_experiment_in_the_order_of_the_catalogue():
    assert list(EXPERIMENTS) == IDS
    for effect, experiment in EXPERIMENTS.items():
        assert experiment.effect == effect
        assert len(f"{effect}: {experiment.look}") <= 110  # the width of the picture


def test_there_are_pages_and_pictures_of_the_catalogue_and_no_others():
    names = {path.name for path in DOCS.iterdir()}
    assert names == {
        "README.md",
        *(f"{effect}.{suffix}" for effect in IDS for suffix in ("md", "png")),
    }


@pytest.mark.parametrize("name", pages())
def test_a_page_is_what_the_table_says_now(name):
    assert (DOCS / name).read_text(encoding="utf-8") == pages()[name], "run: make effects"


@pytest.mark.parametrize("effect", IDS)
def test_its_picture_is_small_and_of_one_size(effect):
    content = (DOCS / f"{effect}.png").read_bytes()
    assert content.startswith(b"\x89PNG")
    assert struct.unpack(">II", content[16:24]) == (1100, 620)
    assert len(content) < 80_000


@pytest.mark.parametrize("effect", IDS)
def test_its_experiment_stands_on_a_packaged_rig(effect):
    without, with_ = Sheet(EXPERIMENTS[effect]).rigs
    assert without.effects == []
    assert with_.effects[0]["id"] == effect
