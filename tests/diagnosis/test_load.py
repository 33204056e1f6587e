"""A muscle that lifts a hanging mass is diagnosed as an arm is: its length is the channel, its load
the block.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import pamrs
from pamrs.diagnosis.fit import fits, look_for_events, residuals
from pamrs.diagnosis.next_experiment import propose
from pamrs.diagnosis.prepare import implausible, prepare
from pamrs.effects import Term
from pamrs.errors import SimulationError
from pamrs.experiments import library
from pamrs.recordings import Recording
from pamrs.rig import parse_rig
from pamrs.simulation import core_rig
from tests.diagnosis.asked import ROLES, SETTINGS, blocks_of, problem_of
from tests.diagnosis.noisy import driven, without

RIG = pamrs.rigs.hanging_mass()
NOISE = {"valve_command": 0.0, "supply_pressure": 300.0, "muscle_pressure": 300.0, "length": 3e-5}
DT = 0.005


def recording(
    rig: pamrs.Rig, name: str, role: str, seed: int, seconds: float = 10.0, pressure: float = 2.5e5
) -> Recording:
    """Lifts and lowerings at two speeds, steps where it is held out; from a pressure [Pa], and from
    none at all by a lift.
    """
    rest = round(4.0 / DT)  # it settles before it is recorded
    time = np.arange(0.0, seconds, DT)
    wave = {
        "slow": 0.05 * np.sin(1.1 * time) + 0.03 * np.sin(4.0 * time),
        "fast": 0.05 * np.sin(2.3 * time + 0.4) + 0.04 * np.sin(5.1 * time),
        "steps": 0.06 * np.sign(np.sin(1.5 * time)),
    }[name]
    lift = (time < 0.4) & (pressure == 0.0)
    command = np.concatenate([np.full(rest, 5.0), np.where(lift, 5.3, 5.02 + wave)])
    given, start = {"valve_command": command}, {"muscle_pressure": pressure}
    return driven(rig, name, role, DT, given, NOISE, [seed], first=rest, initial=start)


def case(rig: pamrs.Rig, pressure: float = 2.5e5) -> pamrs.Case:
    names = enumerate(("slow", "fast", "steps"))
    found = [recording(rig, name, ROLES[k], k, pressure=pressure) for k, name in names]
    return pamrs.Case("lift", RIG, found, Path())


def test_the_load_is_a_block_and_its_sensitivities_are_those_of_differences() -> None:
    blocks = blocks_of(RIG, NOISE)
    assert blocks["load"].kind == "arm"
    assert "length" in blocks["chamber"].drives
    problem = problem_of(RIG, [recording(RIG, "slow", "fit", 0, 6.0)], "load")
    names = [
        "load.mass",
        "load.viscous",
        "load.coulomb",
        "muscle.modulus_scale",
        "sensors.pressure_zero",
        "sensors.length_zero",
    ]
    found = residuals(problem, RIG, names)["load", "slow"]
    assert float(np.sqrt(np.mean(found.value**2))) < 2.0 * found.noise
    prepared, known = problem.recordings[0], RIG.parameters
    given = ("load", prepared.commands, DT, DT / 2, prepared.starts(2.5, ("muscle_pressure",)))
    _, jacobian = core_rig(RIG).predict(*given, names, prepared.signals, prepared.n)
    for k, name in enumerate(names):
        step = 1e-3 * known[name].tol
        up, down = (
            core_rig(RIG.with_parameters({name: known[name].value + s * step})).predict(
                *given, [], prepared.signals, prepared.n
            )[0]
            for s in (1.0, -1.0)
        )
        slope = (up - down) / (2.0 * step)
        assert np.abs(slope - jacobian[:, k]).max() < 1e-3 * np.abs(slope).max(), name


@pytest.mark.slow
@pytest.mark.parametrize(
    "true",
    [{"load.mass": 40.08, "muscle.modulus_scale": 1.04}, {"muscle.rest_length": 0.277}],
)
def test_a_true_model_of_a_load_misses_nothing(true: dict[str, float]) -> None:
    found = pamrs.diagnose(case(RIG.with_parameters(true)))
    assert found.verdict in ("none", "parameters")
    if "muscle.rest_length" in true:  # a longer muscle reads as another zero, near enough
        zero, rest = (
            found.parameters[name]["value"] - RIG.parameters[name].value
            for name in ("sensors.length_zero", "muscle.rest_length")
        )
        assert zero + rest == pytest.approx(1e-3, abs=2e-4)


def test_a_muscle_that_begins_longer_than_at_rest_misses_nothing() -> None:
    # its volume has a kink at the rest length, through which each recording lifts it
    true = RIG.with_parameters({"sensors.length_zero": -5e-4, "chamber.alpha": 1.17})
    lifted = case(true, pressure=0.0)
    length = lifted.recordings[0].channels["length"]
    assert length[0] > 0.2763
    assert length[-1] < 0.276
    found = pamrs.diagnose(lifted)
    assert found.verdict in ("none", "parameters")
    assert found.parameters["sensors.length_zero"]["value"] == pytest.approx(-5e-4, abs=5e-5)


def test_the_zero_of_the_length_is_what_is_read_beside_the_true_one() -> None:
    off = RIG.with_parameters({"sensors.length_zero": 0.002})
    one, other = (pamrs.simulate(rig, np.full(60, 5.05), sample_time=DT) for rig in (RIG, off))
    assert other["length"] - one["length"] == pytest.approx(0.002)
    assert other["muscle_pressure"] == pytest.approx(one["muscle_pressure"])
    zero = 'length_zero = { value = 1, unit = "mm" }'
    text = re.sub(r"\[sensors\]", rf"[sensors]\n{zero}", pamrs.rigs.sealed_chamber().to_toml_text())
    words = r'length_zero is not allowed: a \[load\] with kind = "mass"'
    with pytest.raises(pamrs.RigError, match=words):
        parse_rig(text)


def test_a_length_that_cannot_be_is_refused() -> None:
    def told(change: Callable[[np.ndarray], np.ndarray]) -> str:
        sound = recording(RIG, "slow", "fit", 0, 4.0)
        channels = sound.channels | {"length": change(sound.channels["length"])}
        return "; ".join(implausible(replace(sound, channels=channels), RIG, SETTINGS))

    assert told(lambda x: x) == ""
    assert "length has the one value" in told(lambda x: np.full_like(x, 0.25))
    assert "length is outside its load's range" in told(lambda x: 1e-3 * x)
    assert "length moves with" in told(
        lambda x: 0.24 + 100.0 * (x - x.mean()) * np.sign(np.sin(1e4 * np.arange(x.size)))
    )
    slow = replace(recording(RIG, "slow", "fit", 0, 4.0), sample_time=0.4)
    assert "too slow for a load" in "; ".join(implausible(slow, RIG, SETTINGS))


def test_a_load_behind_a_valve_that_was_not_recorded_is_driven_by_its_pressure() -> None:
    whole = recording(RIG, "slow", "fit", 0, 4.0)
    bare = without(whole, "valve_command", "supply_pressure")
    assert list(blocks_of(RIG, bare.channels)) == ["load"]
    assert prepare(bare, RIG, SETTINGS).n == whole.time.size


def test_a_mass_that_changes_is_looked_for_and_found() -> None:
    assert RIG.muscle is not None
    assert fits(RIG, "payload_change")
    assert not fits(pamrs.rigs.bench(RIG.muscle), "payload_change")
    change = {"mass_change": -2.0, "time": 7.0}  # of which 4 s are not recorded
    changed = RIG.with_effect("payload_change", change)
    problem = problem_of(RIG, [recording(changed, "slow", "fit", 0, 6.0)], "load")
    own, white = residuals(problem, RIG), {"load": 1.0}
    found = look_for_events(Term("payload_change"), problem, RIG, own, white)
    assert found is not None
    (values,) = found.values.values()
    assert values["mass_change"] == pytest.approx(-2.0, rel=0.2)


def test_the_next_experiment_with_a_load_is_simulated() -> None:
    experiments = library(RIG, SETTINGS, only={"staircase", "other_payload"})
    assert [e.name for e in experiments] == ["staircase", "other_payload"]
    assert experiments[1].changes == {"load.mass": pytest.approx(20.0)}
    creeping = RIG.with_effect("muscle_creep")
    rivals = [("none", RIG, 0.5), ("muscle_creep", creeping, 0.5)]
    told = propose(RIG, rivals, experiments=experiments[:1])
    assert told["expected_information_bits"] > 0.3
    assert told["curves"] is not None


@pytest.mark.slow
def test_an_effect_on_a_load_is_named() -> None:
    friction = {"friction_constant": 4.0, "friction_pressure": 4e-5, "presliding": 2e-3}
    found = pamrs.diagnose(case(RIG.with_effect("muscle_hysteresis", friction)))
    assert found.effects[0]["id"] == "muscle_hysteresis"
    assert found.effects[0]["probability"] > 0.7
    assert found.fit["gap_closed"] > 0.8
    assert "length" in found.fit["held_out"]
    assert "load block" in found.summary()


def test_a_frame_holds_the_length_and_has_no_block_of_its_own() -> None:
    assert RIG.muscle is not None
    bench = pamrs.rigs.bench(RIG.muscle)
    assert "load" not in blocks_of(bench, ("muscle_pressure", "length"))
    signals = {
        n: (np.full(64, v), np.zeros(64)) for n, v in (("muscle_pressure", 2e5), ("length", 0.25))
    }
    with pytest.raises((SimulationError, ValueError), match="frame"):
        core_rig(bench).predict("load", {}, DT, DT, [0], [], signals, 64)
