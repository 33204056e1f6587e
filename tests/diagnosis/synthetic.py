"""A made-up diagnosis for the tests of results and reports."""

from __future__ import annotations

from typing import Any

import numpy as np

from pamrs.diagnosis.result import Diagnosis, Trace
from pamrs.findings import (
    BlockResidual,
    ChannelError,
    Condition,
    ConditionMap,
    EffectFound,
    EffectParameterFound,
    FitErrors,
    NextExperiment,
    ParameterFound,
    Tested,
    Where,
)


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


def diagnosis(**changes: Any) -> Diagnosis:
    x, y = np.linspace(100.0, 500.0, 13), np.linspace(-60.0, 60.0, 11)
    centre_x, centre_y = np.meshgrid((x[1:] + x[:-1]) / 2, (y[1:] + y[:-1]) / 2)
    z = 6.0 * np.tanh(centre_y / 30.0) * (centre_x / 500.0)
    z[0, :3] = np.nan
    content: dict[str, Any] = {
        "case": "shoulder_a",
        "verdict": "effects",
        "where": {
            "block": "chamber",
            "channel": "muscle_pressure",
            "recording": "sine_sweep",
            "intervals": [[0.0, 2.4], [9.0, 11.2], [18.0, 20.3]],
            "conditions": [
                Condition(
                    "filled",
                    0.81,
                    0.2,
                    3.1,
                    "the pressure has just risen: 81 % of the excess lies within 2.5 s of a fill",
                ),
                Condition("muscle pressure", 0.6, 0.3, 2.0, "muscle pressure 310 to 490 kPa"),
            ],
            "text": "The excess is in the chamber: after each fill the pressure sags by 8 kPa.",
        },
        "effects": [
            {
                "id": "heat_transfer",
                "probability": 0.9991,
                "parameters": {
                    "heat_transfer_coefficient": {
                        "value": 41.3,
                        "std": 2.2,
                        "unit": "W/(m2 K)",
                        "interval": [37.0, 45.9],
                        "identifiable": True,
                    },
                    "wall_conductance": {
                        "value": 1.3e-9,
                        "std": 4.0e-9,
                        "unit": "W/K",
                        "identifiable": False,
                    },
                },
            }
        ],
        "ambiguity": [],
        "probabilities": {
            "heat_transfer": 0.962,
            "leak_muscle": 0.021,
            "heat_transfer+leak_muscle": 0.012,
            "unlisted": 0.004,
            "parameters": 0.001,
            "none": 0.0,
        },
        "parameters": {
            "chamber.dead_volume": {
                "nominal": 6.4e-5,
                "value": 6.61e-5,
                "std": 4e-7,
                "unit": "m3",
                "moved_sigmas": 0.7,
                "identifiable": True,
            },
            "valve.discharge_area_max": {
                "nominal": 1.1e-6,
                "value": 9.6e-7,
                "std": 2e-8,
                "unit": "m2",
                "moved_sigmas": -3.4,
                "identifiable": True,
            },
            "arm.payload": {
                "nominal": 2.0,
                "value": 2.1,
                "std": float("nan"),
                "unit": "kg",
                "moved_sigmas": float("nan"),
                "identifiable": False,
            },
        },
        "fit": {
            "channels": {"muscle_pressure": fit_entry(3e5), "joint_angle": fit_entry(0.6)},
            "held_out": {"muscle_pressure": fit_entry(3e5), "joint_angle": fit_entry(0.6)},
            "gap_closed": 0.97,
        },
        "next_experiment": {
            "text": "Fill to 5 bar, shut the valve and record the pressure for 60 s.",
            "excitation": {"kind": "sealed hold", "pressure": 5e5, "duration": 60.0},
            "expected_information_bits": 2.4,
        },
        "warnings": ["frozen joint_angle in step_up, 3.1 to 3.4 s: masked"],
        "seconds": 31.4,
        ("text"): (
            "After each fill the gas cools and the pressure sags.\n\nA leak goes on; this stops."
        ),
        "tested": [
            {"id": "heat_transfer", "blocks": ["chamber"], "predicted_gain": 0.96, "left": 0.003},
            {
                "id": "valve_hysteresis",
                "blocks": ["chamber"],
                "predicted_gain": 0.011,
                "left": None,
            },
        ],
        "rig": ModelText(),
        "traces": [
            trace(name, role, channel, unit, scale, seed=i)
            for i, (name, role) in enumerate(
                [("step_up", "fit"), ("sine_sweep", "held_out"), ("random", "held_out")]
            )
            for channel, unit, scale in (
                ("joint_angle", "rad", 0.6),
                ("muscle_pressure", "Pa", 3e5),
            )
        ],
        "residuals": {
            name: {
                "rms": rms,
                "noise": 1.0,
                "excess": rms - 1.0,
                "p_value": 0.5,
                "channel": "muscle_pressure",
            }
            for name, rms in (("valve", 1.2), ("chamber", 6.3), ("muscle", 0.98), ("arm", 1.4))
        },
        "condition_map": {
            "x_label": "muscle pressure [kPa]",
            "y_label": "pressure rate [kPa/s]",
            "x_edges": x,
            "y_edges": y,
            "z": z,
            "z_after": 0.1 * z,
            "block": "chamber",
        },
        "timings": {"locate": 4.2, "refit": 12.0, "name": 15.2},
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
    shown = content["condition_map"]
    return {
        "where": Where(**content["where"]),
        "effects": [EffectFound(**effect) for effect in effects],
        "parameters": each(ParameterFound, content["parameters"]),
        "fit": FitErrors(**errors, gap_closed=content["fit"].get("gap_closed")),
        "next_experiment": NextExperiment(**content["next_experiment"]),
        "tested": [Tested(**row) for row in content["tested"]],
        "residuals": each(BlockResidual, content["residuals"]),
        "condition_map": None if shown is None else ConditionMap(**shown),
    }


def sealed_chamber() -> Diagnosis:
    """Only a pressure, one recording, no map, no held-out data."""
    return diagnosis(
        case="sealed_hold",
        traces=[trace("hold", "fit", "muscle_pressure", "Pa", 3e5, n=900)],
        fit={"channels": {"muscle_pressure": fit_entry(3e5)}, "held_out": {}, "gap_closed": None},
        condition_map=None,
        residuals={
            "chamber": {
                "rms": 900.0,
                "noise": 100.0,
                "excess": 800.0,
                "p_value": 1e-9,
                "channel": "muscle_pressure",
            }
        },
        timings={},
    )


def nothing() -> Diagnosis:
    """Verdict `none`, as empty as it gets."""
    base = trace("step_up", "fit", "muscle_pressure", "Pa", 3e5, n=900)
    same = Trace(
        "step_up",
        "fit",
        "muscle_pressure",
        "Pa",
        base.time,
        base.measured,
        base.before,
        base.refit,
        base.refit,
    )
    return diagnosis(
        verdict="none",
        where={},
        effects=[],
        probabilities={"none": 0.9999},
        parameters={},
        next_experiment={},
        warnings=[],
        residuals={},
        condition_map=None,
        traces=[same],
        text="",
        rig=None,
        fit={
            "channels": {
                "muscle_pressure": {
                    "noise": 1.0,
                    "before": 1.0,
                    "refit": float("nan"),
                    "after": float("nan"),
                }
            }
        },
    )
