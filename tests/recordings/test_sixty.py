"""Every log of the table is read right, or what is left to the user is told."""

from pathlib import Path

import pytest

from tests.recordings.sixty import CLOCKS, DIALECTS, NAMES, UNITS, Row, rows, tried


@pytest.mark.parametrize("row", list(rows()), ids=lambda row: row.name)
def test_a_log_is_right_or_told(row: Row, tmp_path: Path) -> None:
    came, said = tried(row, tmp_path)
    assert came == ("right" if row.unit.read else "told"), said


def test_the_table_has_every_dialect_unit_clock_and_name() -> None:
    every = list(rows())
    assert len(every) == 60
    assert {row.dialect.name for row in every} == {each.name for each in DIALECTS}
    assert {row.clock.name for row in every} == {each.name for each in CLOCKS}
    assert {row.unit for row in every} == set(UNITS)
    assert {row.names for row in every} == set(NAMES)
    assert len({(row.unit, row.names) for row in every}) > 50
