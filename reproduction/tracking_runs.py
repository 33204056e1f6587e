"""Which loops chapter 5 needs; each is run once and kept."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from pamrs.control import Cascade, HysteresisCompensation, Neural
from pamrs.recordings import Case, Recording
from pamrs.rig import Rig
from pamrs.simulation import Simulator
from reproduction.tracking import (
    PAYLOADS,
    PERIOD,
    Track,
    arm_model,
    controller,
    follow,
    lift,
    plant,
)
from reproduction.waves import waves

if TYPE_CHECKING:
    from pamrs.diagnosis.result import Diagnosis


Parameters = tuple[tuple[str, float], ...]

#: The payload of the tables where the dissertation names none [lb].
MIDDLE: Final = 25.0
#: Friction of the braid: torque at 60 deg and 50 psi then differs by 7 % between contraction and
#: extension, at 90 deg by 10 % (Fig. 5.2 has such a loop; how large it is cannot be read from the
#: text).
HYSTERESIS: Final[Parameters] = (
    ("friction_constant", 15.0),
    ("friction_pressure", 8e-5),
    ("presliding", 1e-3),
)
#: What the plant may have that no controller knows of, one at a time.
EFFECTS: Final[Mapping[str, Parameters]] = {
    "muscle_hysteresis": HYSTERESIS,
    "joint_coulomb_stribeck": (("stiction", 5.0),),
    "muscle_creep": (("stiffness", 2000.0),),
    "input_path_lag": (("time_constant", 0.01), ("delay", 0.01)),
    "pressure_lag": (("time_constant", 0.02),),
    "valve_dead_zone": (("half_width", 0.03),),
}
#: Plants of the comparison: payload [lb] and effect.
CASES: Final[tuple[tuple[float, str], ...]] = (
    *((p, "") for p in PAYLOADS),
    *((MIDDLE, effect) for effect in EFFECTS),
)
#: Factors on the estimates of I, b and m g r (5.4.1).
WRONG: Final = (1.0, 0.1, 10.0)
#: Table 5.2 as printed, taken as SI with radians, and this package's gains.
TRIALS: Final[Mapping[str, tuple[float, float, float]]] = {
    "Trial 1": (10.0, 10.0, 0.01),
    "Trial 2": (100.0, 100.0, 0.001),
    "Trial 3": (100.0, 100.0, 0.0001),
    "ten times ours for m g r": (0.3, 1.0, 3000.0),
    "ours": (0.3, 1.0, 300.0),
}
#: What the networks know at first, and the payload [lb].
STARTS: Final = (("zero", 0.0), ("zero", 15.0), ("zero", 25.0), ("zero", 50.0))
LATER: Final = (("model", 50.0), ("15 lb", 50.0), ("Gaylord", 0.0))


def _rig(case: tuple[float, str]) -> Rig:
    return plant(case[0], case[1], EFFECTS.get(case[1], ()))


@dataclass(frozen=True)
class Plan:
    """The experiments, by how long they are [s]; every one is kept once it has run.

    Attributes
    ----------
    record : float
        Of the compound trajectory.
    training : float
        Before the comparison.
    cases : tuple of (float, str)
        Plants of the comparison: payload [lb] and effect.
    """

    record: float = 100.0
    training: float = 1000.0
    cases: tuple[tuple[float, str], ...] = CASES

    @cache  # noqa: B019 - the two plans live as long as the module
    def estimates(self) -> Track:
        """Sliding with right and wrong estimates: a row for each factor of each payload."""
        every = [(payload, factor) for payload in PAYLOADS for factor in WRONG]
        arm = arm_model(
            [payload for payload, _ in every], np.array([factor for _, factor in every])
        )
        plants = [plant(payload) for payload, _ in every]
        return follow("sliding", plants, arm, waves(self.record))

    @cache  # noqa: B019
    def switching(self, values: tuple[float, ...], payload: float = MIDDLE) -> Track:
        """Sliding with estimates times 10 and 0.1: a row for each switching gain [Pa] of each
        factor, boundary layer as it was.
        """
        every = [(factor, value) for factor in (10.0, 0.1) for value in values]
        arm = arm_model([payload] * len(every), np.array([factor for factor, _ in every]))
        gains = np.array([value for _, value in every])
        return follow(
            "sliding",
            [plant(payload)] * len(every),
            arm,
            waves(min(self.record, 50.0)),
            switching=gains,
        )

    @cache  # noqa: B019
    def adaptation(self) -> Track:
        """Adaptive sliding with every set of :data:`TRIALS`, from the right estimates on, which are
        not bounded.
        """
        n, columns = len(TRIALS), zip(*TRIALS.values(), strict=True)
        gains = tuple(np.array(column) for column in columns)
        arm = arm_model([MIDDLE] * n)
        return follow(
            "adaptive sliding",
            [plant(MIDDLE)] * n,
            arm,
            waves(self.record),
            gains=gains,
            bounds=None,
            note_every=self.record / 200.0,
        )

    @cache  # noqa: B019
    def learning(self) -> Track:
        """Networks from zero, a row for each of :data:`STARTS`."""
        payloads = [payload for _, payload in STARTS]
        every = self.record / 5.0
        return follow(
            "neural",
            [plant(p) for p in payloads],
            arm_model(payloads),
            waves(self.record),
            note_every=every,
        )

    @cache  # noqa: B019
    def prepared(self) -> Track:
        """Networks that know something: the simplified model at 50 lb, what 15 lb taught, Gaylord's
        estimate without payload.
        """
        taught = self.learning().learnt
        first = {name: [] for name in taught}  # type: dict[str, list[Any]]
        for start, payload in LATER:
            if start == "15 lb":
                weights = {name: values[1] for name, values in taught.items()}
            else:
                arm = arm_model([payload], guessed=start == "Gaylord")
                outer = controller("neural", arm, start="model").outer
                assert isinstance(outer, Neural)
                weights = outer.weights
            for name in first:
                first[name].append(weights[name])
        payloads = [payload for _, payload in LATER]
        learnt = {name: np.array(rows) for name, rows in first.items()}
        return follow(
            "neural",
            [plant(p) for p in payloads],
            arm_model(payloads),
            waves(self.record),
            learnt=learnt,
            note_every=self.record / 5.0,
        )

    @cache  # noqa: B019
    def trained(self, kind: str) -> Track | None:
        """The training of an adaptive controller on every case; None for the others."""
        if kind not in ("adaptive sliding", "neural"):
            return None
        return follow(
            kind,
            [_rig(case) for case in self.cases],
            arm_model([p for p, _ in self.cases]),
            waves(self.training),
        )

    @cache  # noqa: B019
    def compared(self, kind: str, trajectory: str) -> Track:
        """A controller after training on ``"compound"`` or ``"lift"``, a row for each case."""
        before = self.trained(kind)
        path = waves(self.record) if trajectory == "compound" else lift()
        plants, arm = [_rig(case) for case in self.cases], arm_model([p for p, _ in self.cases])
        return follow(kind, plants, arm, path, learnt=None if before is None else before.learnt)

    @cache  # noqa: B019
    def compensated(self, known: bool) -> Track:
        """Sliding with 25 lb on a plant with hysteresis, without and with its compensation."""
        rig = plant(MIDDLE, "muscle_hysteresis", HYSTERESIS)

        def wrap(cascade: Cascade) -> Any:
            return HysteresisCompensation(cascade, self.model()) if known else cascade

        return follow(
            "sliding", [rig], arm_model([MIDDLE]), waves(min(self.record, 60.0)), wrap=wrap
        )

    def model(self) -> Rig:
        """The rig that the diagnosis found, or, where it was not asked for, the true one."""
        found = self.__dict__.get("_found")
        return plant(MIDDLE, "muscle_hysteresis", HYSTERESIS) if found is None else found.rig

    def diagnosis(self) -> Diagnosis:
        """The plant with hysteresis recorded under the PID, and the rig without it diagnosed."""
        found: Diagnosis | None = self.__dict__.get("_found")
        if found is None:
            from pamrs.diagnosis import diagnose

            recordings = [
                _recording(role, seed, begin) for seed, (role, begin) in enumerate(_RECORDED)
            ]
            found = diagnose(Case("shoulder_under_pid", plant(MIDDLE), recordings, Path(".")))
            self.__dict__["_found"] = found
        return found


_RECORDED: Final = (("fit", 10.0), ("fit", 37.0), ("held_out", 71.0))
_NOISE: Final = {"supply_pressure": 400.0, "muscle_pressure": 400.0, "joint_angle": 3e-4}


def _recording(role: str, seed: int, begin: float, seconds: float = 16.0) -> Recording:
    """Seconds of the compound trajectory under the cascaded PID, with the sensors' noise."""
    rig = plant(MIDDLE, "muscle_hysteresis", HYSTERESIS)
    pid, path = controller("cascaded PID", arm_model([MIDDLE])), waves()
    simulator = Simulator(rig, sample_time=PERIOD)

    def answer(sample: dict[str, float]) -> float:
        one = {name: float(value) for name, value in sample.items()}
        return float(
            np.asarray(pid.update(one["time"], one, path(begin - 4.0 + one["time"]))).reshape(-1)[0]
        )

    run = simulator.control(answer, 4.0 + seconds)
    inside = slice(round(4.0 / PERIOD), round((4.0 + seconds) / PERIOD))
    rng = np.random.default_rng(seed)
    time: Any = PERIOD * np.arange(inside.stop - inside.start)
    names = (*_NOISE, "valve_command")
    channels = {
        name: np.asarray(run[name])[inside]
        + rng.normal(0.0, 1.0, time.size) * _NOISE.get(name, 0.0)
        for name in names
    }
    mask = {name: np.ones(time.size, dtype=bool) for name in names}
    return Recording(
        f"{role}_{begin:g}s", role, time, PERIOD, channels, mask, [], dict.fromkeys(names, "SI")
    )


FULL: Final = Plan()
#: For tests: everything runs, nothing is learnt.
SHORT: Final = Plan(record=20.0, training=30.0, cases=((MIDDLE, ""), (MIDDLE, "muscle_hysteresis")))
