"""The package with one effect more: run by test_toy.py, with a package whose core has it.

``python toy_case.py FOLDER`` simulates `toy_joint_spring` in both forms, lets the trial conceal its
own form of it in a case below FOLDER, diagnoses that case, writes the report beside it and prints
what was found as one line of JSON.
"""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, Self

import numpy as np

import pamrs
import trial.effects
from pamrs.simulation import core_rig
from trial.concealed import Spec, generate, store
from trial.effects.base import Effect, Env, Port, Setting, Start, State, uniform
from trial.excitation import select
from trial.rigfile import default_rig

EFFECT = "toy_joint_spring"


@dataclass(frozen=True)
class ToySpring(Effect):
    """Spring at the joint, met softly at an angle, of which a share relaxes in time.

    ``tau = -k (d - share z)``, ``z' = (d - z)/T``, ``d = (x + sqrt(x^2 + w^2))/2`` for `x` beyond
    `angle` [rad]; `stiffness` k [N m/rad], `soft` w [rad], `time` T [s].
    """

    id: ClassVar[str] = EFFECT
    block: ClassVar[str] = "joint"
    graded: ClassVar[tuple[str, ...]] = ("stiffness",)
    stiffness: float
    angle: float
    soft: float
    share: float
    time: float

    @classmethod
    def draw(cls, rng: np.random.Generator, setting: Setting) -> Self:
        angle = math.radians(uniform(rng, 40.0, 50.0))
        return cls(
            uniform(rng, 20.0, 40.0), angle, 0.02, uniform(rng, 0.75, 0.85), uniform(rng, 0.6, 1.2)
        )

    def deflection(self, angle: float) -> float:
        x = angle - self.angle
        return 0.5 * (x + math.sqrt(x * x + self.soft * self.soft))

    def start(self, at: Start) -> State:
        return [self.deflection(at.angle)]

    def sizes(self) -> State:
        return [0.1]

    def torque(self, env: Env, first: int) -> Port:
        def push(angle: float, rate: float, pg: float, y: State, d: State) -> float:
            now = self.deflection(angle)
            d[first] = (now - y[first]) / self.time
            return -self.stiffness * (now - self.share * y[first])

        return push


def simulated() -> dict[str, float]:
    """How far each form moves the shoulder [rad]; a restart and a rig file change nothing."""
    plain = pamrs.rigs.shoulder()
    command = 5.0 + 1.5 * np.sin(0.02 * np.arange(400))
    moved = {}
    for form in ("linear", "cubic"):
        rig = plain.with_effect(EFFECT, {"stiffness": 60.0, "angle": 0.4}, form=form)
        path = pamrs.simulate(rig, command, sample_time=0.01)["joint_angle"]
        moved[form] = float(
            np.abs(path - pamrs.simulate(plain, command, sample_time=0.01)["joint_angle"]).max()
        )
        again = pamrs.rig.parse_rig(rig.to_toml_text())
        assert np.array_equal(pamrs.simulate(again, command, sample_time=0.01)["joint_angle"], path)
        whole, first, second = (pamrs.Simulator(rig, sample_time=0.01) for _ in range(3))
        first.run(command[:150])
        second.restore(first.state)
        rest = second.run(command[150:])["joint_angle"]
        assert np.array_equal(rest, whole.run(command)["joint_angle"][150:])
    off = plain.with_effect(EFFECT, pamrs.effects.EFFECTS[EFFECT].neutral())
    two = pamrs.simulate(off, command, sample_time=0.01)
    signals = {"valve_command": command}
    # by the equations that a rig with effects has
    one, _ = core_rig(plain).simulate(command.size, signals, 0.01, 1e-3, {}, stepwise=True)
    assert all(np.array_equal(one[channel], two[channel]) for channel in one)
    return moved


def as_json(value: Any) -> Any:
    """What JSON has no word for: entries of a result, numbers of NumPy."""
    return dict(value) if isinstance(value, Mapping) else float(value)


def main(folder: Path) -> None:
    """Simulate, conceal, diagnose, report."""
    moved = simulated()
    trial.effects.TYPES[EFFECT] = ToySpring
    spec = Spec("toy", EFFECT, 7, tuple(select(4)), 20.0, strength=0.3812)  # ten noises are left
    case = generate(spec, default_rig())
    store(case, folder)
    found = pamrs.diagnose(folder / "toy")
    page = folder / "report.html"
    found.report(page)
    told = {
        "package": pamrs.__file__,
        "moved": moved,
        "verdict": found.verdict,
        "effects": [effect["id"] for effect in found.effects],
        "probabilities": found.probabilities,
        "parameters": found.effects[0]["parameters"] if found.effects else {},
        "truth": json.loads(case.key)["effect_parameters"],
        "probability": found.effects[0]["probability"] if found.effects else 0.0,
        "gap_closed": found.fit["gap_closed"],
        "where": found.where.get("block"),
        "named_by_page": pamrs.effects.EFFECTS[EFFECT].name in page.read_text(encoding="utf-8"),
        "model": found.model,
    }
    print(json.dumps(told, default=as_json))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
