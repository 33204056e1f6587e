"""A made-up diagnosis for the tests of results and reports."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from pamrs.diagnosis.result import Diagnosis, Trace
from pamrs.findings import (
    BlockResidual,
    ChannelError,
    Condition,
    EffectFound,
    EffectParameterFound,
    FitErrors,
    NextExperiment,
    ParameterFound,
    Tested,
    Where,
)
from tests.tables import rows_of


class ModelText:
    def to_toml_text(self) -> str:
        return 'name = "sealed <chamber>"\n\n[[effects]]\nid = "heat_transfer"\n'


def trace(
    recording: str,
    role: str,
    channel: str,
    unit: str,
    scale: float,
    *,
    n: int = 6000,
    seed: int = 1,
) -> Trace:
    rng = np.random.default_rng(seed)
    time = np.arange(n) * 0.005
    truth = scale * (
        1.0 + 0.4 * np.sin(0.7 * time) * np.exp(-time / 40) + 0.1 * np.sign(np.sin(0.35 * time))
    )
    missing = scale * 0.08 * np.exp(-(time % 9.0) / 2.5)
    measured = truth + scale * 0.004 * rng.standard_normal(n)
    measured[1000:1100] = np.nan
    return Trace(
        recording,
        role,
        channel,
        unit,
        time,
        measured,
        before=truth + 1.3 * missing,
        refit=truth + missing - missing.mean(),
        after=truth + 0.02 * missing,
    )


def fit_entry(scale: float) -> dict[str, float]:
    return {
        "noise": 0.004 * scale,
        "before": 0.045 * scale,
        "refit": 0.024 * scale,
        "after": 0.0042 * scale,
    }


def residual(rms: float, noise: float, p_value: float) -> dict[str, Any]:
    sizes = {"rms": rms, "noise": noise, "excess": rms - noise, "p_value": p_value}
    return {**sizes, "channel": "muscle_pressure"}


def diagnosis(**changes: Any) -> Diagnosis:
    content: dict[str, Any] = rows_of(__file__, "diagnosis")
    content["where"]["conditions"] = [Condition(*own) for own in content["where"]["conditions"]]
    own = {"muscle_pressure": fit_entry(3e5), "joint_angle": fit_entry(0.6)}
    content["fit"] |= {"channels": own, "held_out": own}
    sizes = {"valve": 1.2, "chamber": 6.3, "muscle": 0.98, "arm": 1.4}
    roles = {"step_up": "fit", "sine_sweep": "held_out", "random": "held_out"}
    channels = (("joint_angle", "rad", 0.6), ("muscle_pressure", "Pa", 3e5))
    content |= {
        "rig": ModelText(),
        "traces": [
            trace(name, role, *channel, seed=i)
            for i, (name, role) in enumerate(roles.items())
            for channel in channels
        ],
        "residuals": {name: residual(rms, 1.0, 0.5) for name, rms in sizes.items()},
    }
    content.update(changes)
    return Diagnosis(**content | entries(content))


def entries(content: dict[str, Any]) -> dict[str, Any]:
    """The parts of a result that were written as dictionaries, as entries."""

    def each(cls: Any, values: dict[str, Any]) -> dict[str, Any]:
        return {name: cls(**value) for name, value in values.items()}

    effects = [
        e | {"parameters": each(EffectParameterFound, e["parameters"])} for e in content["effects"]
    ]
    errors = {
        part: each(ChannelError, content["fit"].get(part, {})) for part in ("channels", "held_out")
    }
    return {
        "where": Where(**content["where"]),
        "effects": [EffectFound(**effect) for effect in effects],
        "parameters": each(ParameterFound, content["parameters"]),
        "fit": FitErrors(**errors, gap_closed=content["fit"].get("gap_closed")),
        "next_experiment": NextExperiment(**content["next_experiment"]),
        "tested": [Tested(**{"left": None, **row}) for row in content["tested"]],
        "residuals": each(BlockResidual, content["residuals"]),
    }


def sealed_chamber() -> Diagnosis:
    """Only a pressure, one recording, no held-out data."""
    return diagnosis(
        case="sealed_hold",
        traces=[trace("hold", "fit", "muscle_pressure", "Pa", 3e5, n=900)],
        fit={"channels": {"muscle_pressure": fit_entry(3e5)}, "held_out": {}, "gap_closed": None},
        residuals={"chamber": residual(900.0, 100.0, 1e-9)},
        timings={},
    )


def nothing() -> Diagnosis:
    """Verdict `none`, as empty as it gets."""
    base = trace("step_up", "fit", "muscle_pressure", "Pa", 3e5, n=900)
    nan = float("nan")
    errors = {"noise": 1.0, "before": 1.0, "refit": nan, "after": nan}
    empty: dict[str, Any] = {
        **dict.fromkeys(("where", "parameters", "next_experiment", "residuals"), {}),
        **dict.fromkeys(("effects", "warnings"), []),
    }
    return diagnosis(
        verdict="none",
        probabilities={"none": 0.9999},
        traces=[replace(base, after=base.refit)],
        text="",
        rig=None,
        fit={"channels": {"muscle_pressure": errors}},
        **empty,
    )
