"""Closures: a mismatch without a name is modelled, predicts recordings that were held out, and
nothing is made of nothing.
"""

from __future__ import annotations

import numpy as np
import pytest

import pamrs
from pamrs import _core
from pamrs.diagnosis.explain import forms_of
from pamrs.diagnosis.explain._forms import form_sentence
from pamrs.diagnosis.fit import Fit, Key, Problem, fit, fits, residuals
from pamrs.diagnosis.fit._fitting import FIT_BIN_TIME
from pamrs.diagnosis.noise import NoiseLevel, excess, noise_levels, usual_inflation
from pamrs.diagnosis.prepare import Block
from pamrs.diagnosis.search import find_closure
from pamrs.diagnosis.search._closure import _MOST_TERMS
from pamrs.effects import CATALOGUE, CLOSURE_TERMS, EFFECTS, MEMORY_OF, Term
from pamrs.errors import DiagnosisError, RigError
from pamrs.recordings import Recording
from pamrs.simulation import core_rig
from tests.diagnosis.asked import EXACT, SETTINGS, diagnosed, problem_of
from tests.diagnosis.held import RIG as SEALED
from tests.diagnosis.noisy import SHOULDER, driven

CLOSURES = [effect for effect in EFFECTS.values() if not effect.catalogue]

DT, ROWS = 0.005, 1600
NOISE = {"valve_command": 0.0, **SHOULDER}
NOMINAL = pamrs.rigs.shoulder()


def described(found: Fit, problem: Problem, baseline: Fit) -> str:
    """A fitted closure in words."""
    return "\n".join(map(form_sentence, forms_of(found, problem, baseline)))


def command(kind: str) -> np.ndarray:
    """Valve commands; the steps are held out."""
    t = DT * np.arange(ROWS)
    return {
        "slow": 5.03 + 0.30 * np.sin(0.9 * t) + 0.08 * np.sin(5.0 * t),
        "fast": 5.03 + 0.25 * np.sin(1.7 * t + 0.4) + 0.20 * np.sin(4.1 * t),
        "mixed": 5.02 + 0.22 * np.sin(0.6 * t) + 0.20 * np.sin(2.7 * t + 1.0),
        "steps": 5.03 + 0.30 * np.sign(np.sin(1.3 * t)) + 0.10 * np.sign(np.sin(3.1 * t)),
    }[kind]


def recorded(truth: pamrs.Rig, kind: str, seed: int) -> Recording:
    given, start = {"valve_command": command(kind)}, {"muscle_pressure": 2e5, "joint_angle": 0.9}
    return driven(truth, kind, "fit", DT, given, NOISE, [seed], initial=start)


class Case:
    """Three recordings of a truth with the nominal model fitted to them, and one of another
    excitation.
    """

    def __init__(self, truth: pamrs.Rig, names: tuple[str, ...]) -> None:
        self.problem, self.held = (
            problem_of(NOMINAL, [recorded(truth, kind, k) for k, kind in enumerate(kinds)], *names)
            for kinds in (("slow", "fast", "mixed"), ("steps",))
        )
        self.blocks = self.problem.blocks
        white = dict.fromkeys(names, 1.0)
        first = fit(self.problem, NOMINAL, (), {}, white)
        self.inflation = {
            b.name: usual_inflation(b, self.problem.recordings, first.residuals, FIT_BIN_TIME)
            for b in self.blocks
        }
        self.baseline = fit(self.problem, NOMINAL, (), {}, self.inflation, warm=first)
        self.evaluations = 0

    def found(self, monkeypatch: pytest.MonkeyPatch, blocks: list[Block]) -> Fit | None:
        def counted(*arguments: object, **more: object) -> object:
            self.evaluations += 1
            return residuals(*arguments, **more)  # type: ignore[arg-type]

        monkeypatch.setattr("pamrs.diagnosis.search._closure.residuals", counted)
        monkeypatch.setattr("pamrs.diagnosis.fit._fitting.residuals", counted)
        return find_closure(
            self.problem, NOMINAL, self.baseline, self.inflation, blocks, lambda _: None
        )

    def gap_closed(self, model: Fit, block: str) -> float:
        """Share of the excess beyond noise that a model removes on the held-out recording."""
        noise_level: dict[Key, NoiseLevel] = noise_levels(
            self.held, self.held.core.respecified(model.rig.to_json())
        )
        own = next(b for b in self.blocks if b.name == block)
        found = [residuals(self.held, m.rig) for m in (self.baseline, model)]
        ratios = [
            excess(own, self.held.recordings, r, noise_level, SETTINGS).ratio - 1.0 for r in found
        ]
        return 1.0 - float(np.sqrt(max(0.0, ratios[1]) / ratios[0]))


def test_closures_are_no_names_and_their_dictionaries_are_those_of_the_core() -> None:
    assert not {c.id for c in CLOSURES} & set(CATALOGUE)
    assert {c.id for c in CLOSURES} | set(CATALOGUE) == set(EFFECTS)
    for closure in CLOSURES:
        coefficients = [p.name for p in closure.parameters if p.neutral == 0.0]
        assert coefficients == [term.name for term in CLOSURE_TERMS[closure.id]]
        kinds = {term.kind for term in CLOSURE_TERMS[closure.id]}
        assert {p.name for p in closure.parameters if p.neutral is None} == {
            MEMORY_OF[k] for k in kinds & set(MEMORY_OF)
        }
        assert kinds <= {"static", "even", "odd", *MEMORY_OF}
        assert fits(NOMINAL, closure.id)


def test_a_hidden_torque_is_modelled_and_predicts_what_was_held_out(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    hidden = {"pressure_creep": -4.0, "sine_4": 2.5, "memory_time": 0.7}
    case = Case(NOMINAL.with_effect("closure_torque", hidden), ("arm",))
    found = case.found(monkeypatch, case.blocks)
    assert found is not None
    assert case.evaluations <= 18
    assert found.values["closure_torque.sine_4"] == pytest.approx(2.5, rel=0.1)
    assert 2 <= sum(name.startswith("closure_torque.") for name in found.values) <= _MOST_TERMS + 2
    assert case.gap_closed(found, "arm") > 0.85
    text = described(found, case.problem, case.baseline)
    assert "a torque is missing" in text
    assert "sin(4 a)" in text
    assert "rate dependent" in text
    assert "(a - a_T)" in text
    # the model is a rig like every other
    again = pamrs.rig.parse_rig(found.rig.to_toml_text())
    one, two = (pamrs.simulate(rig, command("steps"), sample_time=DT) for rig in (found.rig, again))
    np.testing.assert_allclose(one["joint_angle"], two["joint_angle"], rtol=0.0, atol=1e-12)


def test_hysteresis_of_another_form_is_a_memory_of_the_way(monkeypatch: pytest.MonkeyPatch) -> None:
    hidden = {"friction_constant": 0.0, "friction_pressure": 6e-5, "presliding": 2e-3}
    case = Case(NOMINAL.with_effect("muscle_hysteresis", hidden), ("arm",))
    found = case.found(monkeypatch, case.blocks)
    assert found is not None
    assert case.gap_closed(found, "arm") > 0.3  # the parameters take their part of a friction
    assert "rate independent" in described(found, case.problem, case.baseline)


def test_a_hidden_flow_is_modelled(monkeypatch: pytest.MonkeyPatch) -> None:
    case = Case(NOMINAL.with_effect("leak_muscle", {"conductance": 3e-10}), ("supply", "chamber"))
    found = case.found(monkeypatch, [b for b in case.blocks if b.name == "chamber"])
    assert found is not None
    assert found.values["closure_flow.pressure"] < 0.0
    assert case.gap_closed(found, "chamber") > 0.85
    assert "a flow into the chamber is missing" in described(found, case.problem, case.baseline)


@pytest.mark.parametrize("names", [("arm",), ("supply", "chamber")])
def test_a_null_keeps_no_excess_and_next_to_no_terms(
    names: tuple[str, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    case = Case(NOMINAL, names)
    noise_level = noise_levels(
        case.problem, case.problem.core.respecified(case.baseline.rig.to_json())
    )
    found = [
        excess(b, case.problem.recordings, case.baseline.residuals, noise_level, SETTINGS)
        for b in case.blocks
    ]
    assert all(kept.ratio < 1.2 for kept in found)
    # a form that is asked for all the same mends what the smoothing of the drives does at
    # reversals: hundredths of the arm's torque
    found = case.found(monkeypatch, case.blocks)
    if found is not None:
        assert set(found.effects) == {Term("closure_torque")}
        torque = [abs(v) for n, v in found.values.items() if n.startswith("closure_torque.")]
        assert sum(torque) < 0.25
    assert case.evaluations <= 18


def test_a_named_leak_with_another_law_is_named_with_a_form_of_what_its_equation_lacks() -> None:
    hidden = {"constant": 4e-6}  # a pump besides the leak
    plant = SEALED.with_effect("leak_muscle", {"conductance": 1e-10})
    plant = plant.with_effect("closure_flow", hidden)

    def hold(role: str, k: int) -> Recording:
        begin = {"muscle_pressure": (6e5, 4e5, 2.5e5, 5e5)[k]}
        noise = {"muscle_pressure": 150.0}
        return driven(plant, f"hold{k}", role, 0.1, {}, noise, [7, k], duration=40.0, initial=begin)

    found = diagnosed(SEALED, hold, ("fit", "fit", "fit", "held_out"), EXACT)
    answer, (leak,) = found.answer, found.effects
    assert (answer.named, answer.settled, answer.missed) == (["leak_muscle"], True, [])
    assert "a flow into the chamber is missing" in leak.correction
    assert "What the named equations lack, as a form, which" in found.text
    assert leak.correction in found.text
    conductance = leak.parameters["conductance"]
    assert conductance.interval is not None
    assert conductance.interval[0] < 1e-10 < conductance.interval[1]  # the form moved it
    error = found.fit.held_out["muscle_pressure"]
    assert error.after < 3.0 * error.noise < 0.01 * error.refit
    shares = {term.kind: term.share for term in found.budget}
    assert shares["effect"] > 0.99  # the form corrects the name, and takes what the name leaves
    assert 0.0 < shares["form"] < 0.01
    assert {e["id"] for e in found.rig.effects} == {"leak_muscle", "closure_flow"}


def test_what_does_not_fit_together_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    case = Case(NOMINAL, ("arm",))
    with pytest.raises(DiagnosisError, match="blocks"):
        find_closure(case.problem, NOMINAL, case.baseline, case.inflation, [], lambda _: None)
    with pytest.raises(DiagnosisError, match="closure_torque"):
        described(case.baseline, case.problem, case.baseline)
    prepared = case.problem.recordings[0]
    given = ("arm", prepared.commands, DT, DT, [0], prepared.signals, prepared.n)
    with pytest.raises(RigError, match="no sum of terms"):
        core_rig(NOMINAL).closure_terms(*given)
    terms = _core.Rig(NOMINAL.with_effect("closure_torque").to_json()).closure_terms(*given)
    assert terms.shape == (ROWS, len(CLOSURE_TERMS["closure_torque"]))
    np.testing.assert_array_equal(terms[:, 0], 1.0)
    angle = prepared.signals["joint_angle"][0]
    assert np.abs(terms[:, 1] - angle).max() < 0.2
