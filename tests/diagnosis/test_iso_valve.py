"""A valve with conductances: what of it is wrong is named, on the path on which it is."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import pamrs
from pamrs.errors import RigError
from pamrs.recordings import Recording
from pamrs.rig import parse_rig
from tests.diagnosis.noisy import noisy
from tests.tables import text_of

NOISE = {"supply_pressure": 400.0, "muscle_pressure": 400.0}
TEXT = text_of(__file__, "iso")


def recorded(rig: pamrs.Rig, role: str, seed: int) -> Recording:
    """Ten seconds at 200 Hz of a chamber that is filled and vented in steps."""
    rng = np.random.default_rng(seed)
    time = np.arange(0.0, 10.0, 0.005)
    steps = 5.0 + rng.uniform(0.5, 4.0, 20) * np.tile([1.0, -1.0], 10)
    command = steps[(time / 0.5).astype(int)]
    run = pamrs.simulate(rig, valve_command=command, sample_time=0.005)
    channels = {"valve_command": command}
    channels |= {name: run[name] for name in NOISE}
    return noisy(f"r{seed}", role, 0.005, channels, NOISE, [1, seed])


def diagnosed(**true: float) -> pamrs.Diagnosis:
    nominal = parse_rig(TEXT)
    factors = {f"valve.{name}": factor for name, factor in true.items()}
    rig = nominal.with_parameters(
        {name: nominal.parameter(name).value * factor for name, factor in factors.items()}
    )
    roles = ("fit", "fit", "held_out")
    recordings = [recorded(rig, role, seed) for seed, role in enumerate(roles)]
    return pamrs.diagnose(pamrs.Case("case", nominal, recordings, Path()))


def test_a_healthy_valve_misses_nothing() -> None:
    assert diagnosed().verdict == "none"


@pytest.mark.slow
def test_a_wrong_vent_is_named() -> None:
    found = diagnosed(vent_conductance=1.5)
    assert found.verdict == "parameters"
    (wrong,) = found.wrong_parameters
    assert wrong["name"] == "valve.vent_conductance"
    assert wrong["value"] == pytest.approx(1.5 * wrong["nominal"], rel=0.03)


def test_a_file_reads_back_and_mixed_keys_are_named() -> None:
    rig = parse_rig(TEXT)
    assert parse_rig(rig.to_toml_text()).model == rig.model
    assert rig.parameter("valve.fill_conductance").value == pytest.approx(2e-9)
    with pytest.raises(RigError, match=r"valve\.fill_conductance is not allowed with 'orifice'"):
        parse_rig(TEXT.replace('flow                = "iso_6358"', ""))
    with pytest.raises(RigError, match=r"valve\.fill_critical_ratio = 0\.95"):
        parse_rig(TEXT.replace("value = 0.30", "value = 0.95"))
