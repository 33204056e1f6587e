"""Pages of the reference that are made from the package."""

from __future__ import annotations

import dataclasses
import re
from pathlib import Path

import pytest
import typer

import pamrs
from pamrs.channels import CHANNELS
from pamrs.cli import app
from pamrs.rig.schema import BLOCKS, PORTS
from pamrs.units import DIMENSIONS
from tests.loaded import load_module

PAGES = load_module(Path(__file__).parents[2] / "docs/_site/made_reference.py")


MADE = {name: "\n".join(make()) for name, make in PAGES.MADE.items()}


def test_the_tables_in_the_sources_are_the_made_ones() -> None:
    """`make reference` writes them."""
    pages = dict(PAGES.made_pages())
    assert [page for page, text in pages.items() if page.read_text(encoding="utf-8") != text] == []
    marked = "".join(pages.values())
    assert all(f"<!-- {name} -->" in marked for name in MADE)


@pytest.mark.parametrize("name", MADE)
def test_every_table_has_whole_rows(name: str) -> None:
    tables = re.findall(r"(?:^\|.*\n)+", MADE[name] + "\n", re.M)
    assert tables
    for table in tables:
        widths = {len(re.findall(r"(?<!\\)\|", line)) for line in table.splitlines()}
        assert len(widths) == 1, table


def test_every_command_is_there_with_its_options() -> None:
    page = MADE["made-commands"]
    for word, command in typer.main.get_command(app).commands.items():  # type: ignore[attr-defined]
        assert f"## `pamrs {word}" in page
        for param in command.params:
            assert all(option in page for option in param.opts)


def test_every_key_channel_unit_and_setting_is_there() -> None:
    for block, keys in BLOCKS.items():
        part = MADE["made-rig-keys"].split(f"## `[{block}]`")[1].split("\n## ")[0]
        names = [*(".".join(key.where) for key in keys), *(p.name for p in PORTS.get(block, ()))]
        assert not [name for name in names if f"`{name}`" not in part]
    assert not [name for name in CHANNELS if f"`{name}`" not in MADE["made-channels"]]
    assert not [name for name in DIMENSIONS if name not in MADE["made-units"]]
    settings = [field.name for field in dataclasses.fields(pamrs.DiagnosisSettings)]
    assert not [name for name in settings if f"`{name}`" not in MADE["made-settings"]]
    assert "`recording`" in MADE["made-case-keys"]
    assert "`next_experiment`" in MADE["made-result-keys"]
