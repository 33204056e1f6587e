"""Blocks that are judged by themselves where no name explains all of a group."""

from __future__ import annotations

from dataclasses import replace

import pytest

import pamrs
from pamrs.diagnosis import DiagnosisSettings
from pamrs.diagnosis.evidence import BlockGroup, FittedHypothesis, Prior, judge, posterior
from pamrs.diagnosis.fit import Fit, Problem
from pamrs.diagnosis.noise import Excess
from pamrs.diagnosis.prepare import available_blocks
from pamrs.diagnosis.search import Attempts
from pamrs.diagnosis.search._examine import _split_by_names
from pamrs.effects import UNLISTED, Hypothesis
from pamrs.findings import case_verdict
from pamrs.simulation import core_rig
from tests.diagnosis.likelihoods import made_up
from tests.diagnosis.terms import terms

SETTINGS = DiagnosisSettings()

RIG = pamrs.rigs.shoulder()
CHANNELS = ("supply_pressure", "muscle_pressure", "valve_command", "joint_angle")
BLOCKS = [b for b in available_blocks(RIG, CHANNELS) if b.kind != "arm"]
PRIOR = Prior(0.985, 30.0, SETTINGS)
PROBLEM = Problem(BLOCKS, [], core_rig(RIG), SETTINGS)
TRIAL = Attempts(PROBLEM, PROBLEM, RIG, {}, {}, BLOCKS)


def candidate(key: str, supply: float, chamber: float, **values: float) -> FittedHypothesis:
    """A made-up hypothesis that leaves these excess variances."""
    model = RIG
    for term in Hypothesis.parse(key).terms:
        model = model.with_effect(term.id) if term.is_effect else model
    left = {
        name: Excess(1.0 + ratio, ratio**0.5, 0.0, 1.0, 1.0, 1.1, 0.02)
        for name, ratio in (("supply", supply), ("chamber", chamber))
    }
    known = {
        "std": dict.fromkeys(values, 1e-12),
        "moved": {name: 8.0 for name in values if name == key},
        "scales": {name: 0.1 * abs(value) for name, value in values.items()},
    }
    return made_up(model, key, left, values, **known)


def group(*found: FittedHypothesis) -> BlockGroup:
    start = candidate("", 2.5, 64.0)
    every = [start, *found]
    probabilities = posterior(every, BLOCKS, PRIOR)
    chamber = next(b for b in BLOCKS if b.name == "chamber")
    return BlockGroup(
        BLOCKS, start.fit_excess, start.fit_excess, every, probabilities, chamber, {}, BLOCKS
    )


def leak(supply: float, chamber: float) -> FittedHypothesis:
    return candidate("supply_leak", supply, chamber, **{"supply_leak.conductance": 1e-11})


def test_a_leak_of_the_tank_is_named_beside_a_chamber_without_a_name() -> None:
    whole = group(
        leak(0.02, 64.0),
        candidate("valve_hysteresis", 2.4, 58.0, **{"valve_hysteresis.half_width": 0.01}),
    )
    assert whole.probabilities[UNLISTED] > 0.8
    tank, chamber = _split_by_names(whole, TRIAL, PRIOR)
    assert [[b.name for b in part.blocks] for part in (tank, chamber)] == [["supply"], ["chamber"]]
    judged = judge([tank, chamber], SETTINGS)
    assert [(j.verdict, j.named) for j in judged] == [
        ("effects", terms("supply_leak")),
        ("unlisted", ()),
    ]
    assert case_verdict(j.verdict for j in judged) == "effects"
    # one fit for both, so that the model has the tank's parameters beside the leak
    assert chamber.candidates[0].fit is tank.candidates[1].fit


def test_a_valve_that_explains_the_tank_alone_is_no_name() -> None:
    # it acts in both blocks, and leaves one of them as it was
    whole = group(
        candidate("valve_hysteresis", 0.02, 60.0, **{"valve_hysteresis.half_width": 0.01})
    )
    assert _split_by_names(whole, TRIAL, PRIOR) == []


def test_each_block_may_have_a_name_of_its_own(monkeypatch: pytest.MonkeyPatch) -> None:
    volume = candidate("supply.volume", 0.0, 64.0, **{"supply.volume": 0.02})
    heat = candidate("heat_transfer", 2.5, 0.6, **{"heat_transfer.heat_transfer_coefficient": 20.0})
    asked: list[list[str]] = []

    def united(self: Attempts, candidates: list[FittedHypothesis]) -> Fit:
        asked.append(sorted(str(c.hypothesis) for c in candidates))
        return replace(candidates[0].fit, effects=terms("heat_transfer"))

    monkeypatch.setattr(Attempts, "fit_united", united)
    parts = _split_by_names(group(volume, heat), TRIAL, PRIOR)
    assert asked == [["heat_transfer", "supply.volume"]]
    judged = judge(parts, SETTINGS)
    assert {str(t) for j in judged for t in j.added} == {"supply.volume", "heat_transfer"}
    assert sorted(b.name for p in parts for b in p.blocks) == ["chamber", "supply"]
