"""A tendon or a frame that gives: the muscle pulls as it does at its own length, its gas has the
volume of that, and the chain cut at measured channels says the same.
"""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import pamrs
from pamrs.diagnosis.prepare import available_blocks, prepare, residual
from pamrs.diagnosis.settings import DiagnosisSettings
from pamrs.simulation import core_rig
from tests.diagnosis.noisy import SHOULDER, driven

MUSCLE = pamrs.library.pam_a_1in()


@settings(max_examples=20, deadline=None)
@given(
    compliance=st.one_of(st.just(0.0), st.floats(-7.0, -3.7).map(lambda power: 10.0**power)),
    half_force=st.one_of(st.none(), st.floats(50.0, 2e3)),
    gauge=st.floats(5e4, 6e5),
    contraction=st.floats(0.0, 0.15),
)
def test_the_muscle_pulls_as_it_does_at_its_own_length(
    compliance: float, half_force: float | None, gauge: float, contraction: float
) -> None:
    """On a frame at rest the pull solves `F = F_muscle(p, e + s(F)/L)`."""
    form = "linear" if half_force is None else "toe"
    values = {"compliance": compliance} | ({} if half_force is None else {"half_force": half_force})
    rig = pamrs.rigs.bench(MUSCLE).with_effect("tendon_give", values, form=form)
    rest = MUSCLE.parameters["rest_length"]
    held = np.full(40, rest * (1.0 - contraction))
    run = pamrs.simulate(rig, length=held, pressure=np.full(40, gauge), sample_time=0.01)
    pull = run["muscle_force"]
    np.testing.assert_allclose(pull, pull[0], rtol=1e-9, atol=1e-6)
    stretch = compliance * pull[0] / (1.0 + (pull[0] / half_force if half_force else 0.0))
    own = run["contraction_ratio"][0]
    assert own == pytest.approx(contraction + stretch / rest, abs=1e-9)
    alone = max(float(MUSCLE.force(gauge, own)), 0.0)  # a slack muscle does not push
    assert pull[0] == pytest.approx(alone, rel=1e-4, abs=0.5)


@pytest.mark.parametrize("name", ["pam_a_1in", "ch2_075in"])
def test_it_rests_and_moves_however_soft_it_is(name: str) -> None:
    """At rest nothing moves, also with friction and creep of the muscle; steps that the rig takes
    for stable are: ten times shorter ones say the same.
    """
    muscle = getattr(pamrs.library, name)()
    creep = {"stiffness": 1e3, "time_constant": 2.0}
    low, high = muscle.contraction_range
    time = np.arange(0.0, 2.0, 0.01)
    held = muscle.parameters["rest_length"] * (1.0 - low - 0.2 * (high - low))
    wave = held * (1.0 - 0.02 * np.sin(2.0 * np.pi * time))
    for compliance in (1e-6, 2e-5, 2e-4):
        rig = pamrs.rigs.bench(muscle).with_effect("muscle_creep", creep)
        rig = rig.with_effect("tendon_give", {"compliance": compliance})
        rest = pamrs.simulate(
            rig, length=np.full(50, held), sample_time=0.01, initial={"muscle_pressure": 3e5}
        )
        np.testing.assert_allclose(rest["muscle_force"], rest["muscle_force"][0], rtol=1e-6)
        usual, finer = (
            pamrs.simulate(
                rig, length=wave, sample_time=0.01, initial={"muscle_pressure": 3e5}, **own
            )
            for own in ({"step": 0.01}, {"step": 1e-4})
        )
        span = np.ptp(finer["muscle_force"])
        np.testing.assert_allclose(
            usual["muscle_force"], finer["muscle_force"], rtol=0.0, atol=0.01 * span
        )


def test_what_is_cut_says_what_was_simulated() -> None:
    """Chamber and arm of a shoulder, each by its measured neighbours, are followed to the noise by
    the rig that gives, and not by the stiff one.
    """
    stiff = pamrs.rigs.shoulder()
    rig = stiff.with_effect("tendon_give", {"compliance": 1e-5})
    command = 5.0 + 0.3 * np.sin(2.0 * np.pi * 0.5 * np.arange(0.0, 6.0, 0.005))
    recording = driven(rig, "sine", "fit", 0.005, {"valve_command": command}, SHOULDER, [11])
    blocks = {b.name: b for b in available_blocks(stiff, tuple(recording.channels))}
    prepared = prepare(recording, stiff, DiagnosisSettings())
    for name in ("chamber", "arm"):
        sizes = []
        for model in (rig, stiff):
            left = residual(blocks[name], core_rig(model), prepared, [])
            sizes.append(float(np.std(left.value[left.rows])) / left.noise)
        assert sizes[0] < 1.2
        assert sizes[1] > 2.0
