"""Laws of a rig file as hypotheses: gas, valve flow and muscle force."""

from __future__ import annotations

import numpy as np
import pytest

import pamrs
from pamrs.recordings import Recording
from pamrs.rig import Rig, other_choices
from tests.diagnosis.asked import diagnosed

BENCH = pamrs.rigs.bench()


def test_every_packaged_rig_has_its_other_laws() -> None:
    for name in pamrs.rigs.__all__:
        rig = getattr(pamrs.rigs, name)()
        for choice in other_choices(rig):
            kind, key = choice.name.split(".")
            tables = choice.rig.tables(kind).values()
            assert {table[key] for table in tables} == {choice.other}
            assert {table[key] for table in rig.tables(kind).values()} == {choice.stated}
            assert choice.rig.parameters.keys() & rig.parameters.keys()


def with_gas(rig: Rig, law: str) -> Rig:
    own = (c.rig for c in other_choices(rig, ("chamber",)) if c.other == law)
    return next(own, rig)


@pytest.mark.parametrize("law", ["energy_balance", "coefficients"])
def test_the_other_gas_law_is_named(law: str) -> None:
    """A chamber follows one law of its gas, and the rig file has the other."""
    true = with_gas(BENCH, law)
    stated = next(c.rig for c in other_choices(true, ("chamber",)))
    rng = np.random.default_rng(5)

    def made(role: str, k: int) -> Recording:
        return recorded(true, role, k, rng)

    found = diagnosed(stated, made)
    assert [(own.name, own.other) for own in found.laws] == [("chamber.gas", law)], found.summary()
    assert found.answer.named == []
    assert found.verdict == "parameters"
    assert f"chamber.gas = {law}" in found.headline
