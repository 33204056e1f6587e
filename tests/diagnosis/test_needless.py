"""Terms that are not needed are taken out again; a file that states its error has no faint
signatures inside it.
"""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import pytest

from pamrs.diagnosis.evidence import Attempts, Candidate, Weighing
from pamrs.diagnosis.fit import fit, starts_of
from pamrs.diagnosis.noise import NoiseLevel
from pamrs.diagnosis.screen import Screen, Tangent
from pamrs.diagnosis.search._below_noise import _STATED_SHARE, _gain_by_chance
from pamrs.diagnosis.search._sets import Search, without_needless
from pamrs.diagnosis.search._wrong_parameters import FURTHER_SHARE, _needless
from tests.diagnosis.held import RIG, SETTINGS, attempts
from tests.diagnosis.terms import terms


def test_an_effect_that_does_nothing_is_taken_out_from_where_the_set_stands() -> None:
    leaky = RIG.with_effect("leak_muscle", {"conductance": 3e-11})
    trial = attempts(leaky, (7e5, 5e5), 150.0)
    starts = [starts_of(effect, sealed=True)[0] for effect in terms("leak_muscle", "heat_transfer")]
    start = fit(trial.inner, RIG, (), {}, trial.white)
    both = trial.fit_effects(starts, start, trial.white)
    assert both is not None
    alone = trial.fit_effects(starts[:1], start, trial.white)
    assert alone is not None
    told: list[str] = []
    # a fit of the leak that ended in a hollow is replaced; that of heat, which leaves much, is not
    hollow = replace(alone, fit=start, effects=terms("leak_muscle"))
    screened = cast("Screen", None)
    search = Search(trial, screened, both, Weighing(0.985, 150.0, SETTINGS), told.append)
    found = without_needless(search, [hollow, both], [both])
    (leak,) = (c for c in found if c.terms == terms("leak_muscle"))
    assert leak.misfit < 1.2 * both.misfit < 0.2 * hollow.misfit
    assert leak.fit.values["leak_muscle.conductance"] == pytest.approx(3e-11, rel=0.05)
    assert told[-1] == "trying leak_muscle from leak_muscle+heat_transfer"
    # where the smaller set is known to leave as little nothing is tried
    told.clear()
    without_needless(search, [leak, both], [both])
    assert not any(text.startswith("trying leak_muscle from") for text in told)


def test_a_parameter_beside_another_has_to_take_a_share_of_its_own() -> None:
    def left(misfit: float) -> Candidate:
        return cast("Candidate", SimpleNamespace(misfit=misfit))

    trial = cast("Attempts", SimpleNamespace(settings=SETTINGS))
    share = FURTHER_SHARE
    short = {("a",): left(100.0), ("b",): left(300.0), ("a", "b"): left(101.0 * (1.0 - share))}
    assert _needless(("a", "b"), short, trial)
    assert not _needless(("a", "b"), short | {("a", "b"): left(99.0 * (1.0 - share))}, trial)
    assert not _needless(("a",), short, trial)
    assert not _needless(("b", "c"), short | {("b", "c"): left(100.0)}, trial)


def test_a_signature_has_a_share_of_the_stated_error_by_chance() -> None:
    levels = {
        ("supply", "one"): NoiseLevel(1.0, 1.0, 0.0, 0.75),
        ("chamber", "one"): NoiseLevel(1.0, 1.0),
    }
    trial = cast("Attempts", SimpleNamespace(noise_level=levels, settings=SETTINGS))
    tangent = cast("Tangent", SimpleNamespace(power_left=400.0))
    share = _STATED_SHARE
    assert _gain_by_chance(trial, tangent) == pytest.approx(share * 0.75 * 400.0)
    quiet = cast("Attempts", SimpleNamespace(noise_level={}, settings=SETTINGS))
    assert _gain_by_chance(quiet, tangent) == 0.0
