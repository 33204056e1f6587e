"""Spools of valves: sample by sample, many at once, restarted; their sensitivities; their keys."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest

import pamrs
from pamrs.channels import dotted
from pamrs.control import AirModel
from pamrs.control.linear import linearise
from pamrs.errors import RigError
from pamrs.rig import parse_rig
from pamrs.simulation import core_rig
from tests.simulation.refusals import refused
from tests.tables import text_of

DOCS = Path(__file__).parents[2] / "docs" / "rigs" / "valves.md"


def documented(title: str) -> str:
    """The rig of a heading of docs/rigs/valves.md: its only block with a name."""
    part = DOCS.read_text().split(f"## {title}\n")[1].split("\n## ")[0]
    blocks = re.findall(r"```toml\n(.*?)```", part, re.DOTALL)
    (text,) = [block for block in blocks if block.startswith("schema")]
    return text


PAIR = documented("Pulsed valves")
SPRUNG = text_of(__file__, "sprung")


def waves(rows: int, sample_time: float) -> dict[str, np.ndarray]:
    """Duties of the pair, as volts."""
    wave = 9.0 * np.sin(2.0 * np.pi * 3.0 * sample_time * np.arange(rows))
    return {"fill": 11.0 + wave, "vent": 8.0 - wave}


def steps(rows: int) -> np.ndarray:
    """Commands of the sprung valve that let it strike its stops."""
    return 5.0 + np.repeat(np.random.default_rng(3).uniform(-5.0, 5.0, rows // 4 + 1), 4)[:rows]


RUNS = [
    (parse_rig(SPRUNG), {"": steps(61)}, 0.005),
    (parse_rig(PAIR), waves(61, 0.00711), 0.00711),
]


EACH = pytest.mark.parametrize(("rig", "volts", "sample_time"), RUNS, ids=["sprung", "pulsed"])


@EACH
def test_a_run_restarts_bit_for_bit(
    rig: pamrs.Rig, volts: dict[str, np.ndarray], sample_time: float
) -> None:
    whole = pamrs.simulate(rig, volts, sample_time=sample_time)["muscle_pressure"]
    first = pamrs.Simulator(rig, sample_time=sample_time)
    found = [first.observe()["muscle_pressure"]]

    def command(k: int) -> dict[str, float] | float:
        return float(volts[""][k]) if "" in volts else {n: float(v[k]) for n, v in volts.items()}

    for k in range(23):
        found.append(first.step(command(k))["muscle_pressure"])
    second = pamrs.Simulator(rig, sample_time=sample_time)
    second.restore(first.state)
    for k in range(23, 60):
        found.append(second.step(command(k))["muscle_pressure"])
    np.testing.assert_array_equal(found, whole)
    assert float(np.ptp(whole)) > 3e4


@EACH
def test_sensitivities_of_the_cut_chain_are_those_of_differences(
    rig: pamrs.Rig, volts: dict[str, np.ndarray], sample_time: float
) -> None:
    keys = ("natural_frequency", "damping_ratio", "opening_delay", "closing_delay")
    keys = (*keys, "null_voltage", "carrier_phase", "carrier_frequency")
    names = [n for n in rig.parameters if n.startswith("valve.") and n.split(".")[-1] in keys]
    run = pamrs.simulate(rig, volts, sample_time=sample_time)
    n, pressure = run.time.size, run["muscle_pressure"]
    measured = {"muscle_pressure": (np.array(pressure), np.gradient(pressure, sample_time))}
    commands = {dotted("valve_command", name): values for name, values in volts.items()}

    def predict(changes: dict[str, float], wanted: list[str]) -> tuple[np.ndarray, np.ndarray]:
        core = core_rig(rig.with_parameters(changes))
        found: tuple[np.ndarray, np.ndarray] = core.predict(
            "chamber", commands, sample_time, sample_time / 70, [0, 30], wanted, measured, n
        )
        return found

    _, jacobian = predict({}, names)
    value, _ = predict({}, [])
    np.testing.assert_array_equal(value, predict({}, names)[0])
    for k, name in enumerate(names):
        at = rig.parameter(name).value
        h = 1e-6 * (at or 1.0)
        more, less = (predict({name: at + s * h}, [])[0] for s in (1.0, -1.0))
        wanted = (more - less) / (2.0 * h)
        size = float(np.abs(wanted).max())
        assert size > 0.0, name
        np.testing.assert_allclose(jacobian[:, k], wanted, rtol=0.0, atol=2e-5 * size, err_msg=name)


def test_a_file_reads_back_and_what_cannot_be_is_named() -> None:
    for text in (PAIR, SPRUNG):
        rig = parse_rig(text)
        assert parse_rig(rig.to_toml_text()).model == rig.model
        assert parse_rig(rig.to_toml_text(comments=False)).model == rig.model
    core = json.loads(parse_rig(SPRUNG).to_json())["valves"][0]
    spool = (core["spool"], core["natural_frequency"], core["damping_ratio"])
    assert spool == ("second_order", 40.0, 0.4)
    head, tail = SPRUNG.split("spool  ")[0], "\n[chamber]" + SPRUNG.split("[chamber]")[1]
    shut, either = (head + f'spool = "switching"\n{keys}{tail}' for keys in SWITCHING)
    refused(
        (
            r"valve\.natural_frequency is not allowed with 'ideal'",
            lambda: parse_rig(SPRUNG.replace('spool              = "second_order"', "")),
        ),
        (r"damping_ratio = 0 ", lambda: parse_rig(SPRUNG.replace("value = 0.4", "value = 0.0"))),
        (
            r"valve\.spool = 'quick' is not allowed: one of 'ideal'",
            lambda: parse_rig(SPRUNG.replace("second_order", "quick")),
        ),
        (
            r"valve\.natural_frequency is missing",
            lambda: parse_rig(SPRUNG.replace("natural_frequency  =", "# ")),
        ),
        (r"without_current = 'closed'.*another than 'closed'", lambda: parse_rig(shut)),
        (r"without_current = 'vent'.*'either', 'closed' is needed", lambda: parse_rig(either)),
        by=RigError,
    )


#: With both currents alike, and with what only a way that closes may have.
SWITCHING = ('with_current = "closed"', 'with_current = "either"\nwithout_current = "vent"')


def test_what_inverts_a_valve_or_linearises_it_refuses_one_that_switches() -> None:
    rig = pamrs.rigs.shoulder()
    text = rig.to_toml_text(comments=False).replace('spool = "ideal"', 'spool = "switching"')
    switching = parse_rig(text)
    banded = pamrs.rigs.named("regulated_joint").with_parameters({"supply.dead_band": 2e4})
    told = r"valve\.spool = 'switching' is not allowed"
    dead = r"supply\.dead_band = 20000\.0 is not allowed"
    refused(
        (told, lambda: AirModel(switching)),
        (told, lambda: linearise(switching, 0.7, held=())),
        (dead, lambda: linearise(banded, 0.7, held=())),
    )


def test_a_linear_model_has_the_spool_as_two_states() -> None:
    rig = pamrs.rigs.shoulder()
    own = 'spool = "second_order"\nnatural_frequency = { value = 60, unit = "Hz" }'
    text = rig.to_toml_text(comments=False).replace('spool = "ideal"', own)
    model = linearise(parse_rig(text), 0.7, held=())
    names = [name for name in model.states if name.startswith("spool")]
    assert names == ["spool.position", "spool.rate"]
    poles = np.linalg.eigvals(model.a)
    natural = 2.0 * np.pi * 60.0
    wanted = natural * complex(-0.7, np.sqrt(1.0 - 0.49))
    assert float(np.abs(poles - wanted).min()) < 1e-6 * natural


def coil(**own: float) -> pamrs.Rig:
    """The valve that fills, without a carrier."""
    rig = parse_rig(PAIR)
    plain = {"valve.fill.carrier_frequency": 0.0, "valve.vent.carrier_frequency": 0.0}
    return rig.with_parameters(plain | {f"valve.fill.{key}": value for key, value in own.items()})


def test_a_late_command_is_a_longer_delay_on_both_ways() -> None:
    """An edge of the command lies inside a step there, and has a slope."""
    late = coil().with_effect("input_path_lag", {"delay": 4.1e-3}, form="dead_time", at="fill")
    keys = ("opening_delay", "closing_delay")
    longer = coil(**{k: coil().parameter(f"valve.fill.{k}").value + 4.1e-3 for k in keys})
    volts = {"fill": np.repeat([0.0, 24.0] * 8, 4), "vent": np.zeros(64)}
    one, other = (pamrs.simulate(rig, volts, sample_time=0.01) for rig in (late, longer))
    np.testing.assert_allclose(one["muscle_pressure"], other["muscle_pressure"], rtol=1e-12)
    measured = {"muscle_pressure": (other["muscle_pressure"], np.zeros(64))}
    commands = {f"valve_command.{name}": values for name, values in volts.items()}

    def slopes(rig: pamrs.Rig, names: list[str]) -> np.ndarray:
        _, jacobian = core_rig(rig).predict(
            "chamber", commands, 0.01, 1e-3, [0], names, measured, 64
        )
        found: np.ndarray = jacobian[:, : len(names)].sum(axis=1)
        return found

    by_delay = slopes(late, ["input_path_lag.delay"])
    by_both = slopes(longer, ["valve.fill.opening_delay", "valve.fill.closing_delay"])
    size = float(np.abs(by_both).max())
    assert size > 1e4
    np.testing.assert_allclose(by_delay, by_both, rtol=0.0, atol=1e-9 * size)
