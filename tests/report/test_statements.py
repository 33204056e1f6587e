"""No two statements of a result contradict each other, wherever a reader finds them."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings

from pamrs.diagnosis.result import Diagnosis
from tests.diagnosis import synthetic
from tests.report.drawn import findings
from tests.report.statements import contradictions, read

RESULTS = os.environ.get("PAMRS_RESULTS", "")
"""Folder with results of a trial, whose files are looked at as well."""
FILES = [
    f
    for f in (sorted(Path(RESULTS).rglob("*.json")) if RESULTS else ())
    if '"pamrs.diagnosis/' in f.read_text(encoding="utf-8")[:200]
]


@pytest.mark.parametrize("make", [synthetic.diagnosis, synthetic.sealed_chamber, synthetic.nothing])
def test_made_up_results_do_not_contradict_themselves(make) -> None:
    assert contradictions(make()) == []


@settings(max_examples=120, deadline=None, suppress_health_check=list(HealthCheck))
@given(found=findings())
def test_results_of_any_findings_do_not_contradict_themselves(found: Diagnosis) -> None:
    assert contradictions(found) == []


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.relative_to(RESULTS).as_posix())
def test_results_of_a_trial_do_not_contradict_themselves(file: Path) -> None:
    assert contradictions(read(file)) == []
