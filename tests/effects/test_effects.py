"""Effects through Python: rig files, simulation, restart, places and what is refused; their laws
are tested in the core.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

import pamrs
from pamrs import _core
from pamrs.control.linear import linearise
from pamrs.diagnosis.fit import same_data_in, starts_of
from pamrs.effects import CATALOGUE, EFFECTS, EffectInfo, Form, Term
from pamrs.errors import ParameterError, RigError
from pamrs.rig import parse_rig
from pamrs.rig.schema import ACTS
from pamrs.simulation import core_rig
from pamrs.units import parse_unit

START = {"muscle_pressure": 2e5, "joint_angle": 0.9}
COMMAND = 5.2 + 0.5 * np.sin(0.2 * np.arange(60)) + 0.2 * (np.arange(60) // 15 % 2)


def regulated() -> pamrs.Rig:
    """The shoulder behind a regulator."""
    text = pamrs.rigs.shoulder().to_toml_text(comments=False)
    head, _, rest = text.partition("[supply]")
    _, _, rest = rest.partition("\n\n")
    supply = (
        'kind = "regulator"\ninitial_pressure = { value = 6e5, unit = "Pa" }\n'
        'time_constant = { value = 0.1, unit = "s" }\n'
    )
    return parse_rig(f"{head}[supply]\n{supply}\n{rest}")


def with_outlet() -> pamrs.Rig:
    """The shoulder with an outlet without a valve."""
    outlet = '[line]\nkind = "orifice"\nfrom = "chamber"\nto = "ambient"\n'
    area = 'discharge_area = { value = 0.5, unit = "mm2" }\n'
    return parse_rig(f"{pamrs.rigs.shoulder().to_toml_text(comments=False)}\n{outlet}{area}")


def rig_for(effect: str) -> pamrs.Rig:
    if effect == "line_flow_law":
        return with_outlet()
    return regulated() if effect.startswith("supply_regulator") else pamrs.rigs.shoulder()


def run(rig: pamrs.Rig) -> pamrs.Simulation:
    return pamrs.simulate(rig, COMMAND, sample_time=0.01, initial=START)


def by_blocks(rig: pamrs.Rig) -> dict[str, np.ndarray]:
    """The same by the equations that rigs with effects have, to the last bit."""
    signals = {"valve_command": COMMAND}
    channels, _ = core_rig(rig).simulate(COMMAND.size, signals, 0.01, 1e-3, START, stepwise=True)
    return channels


@pytest.mark.parametrize("supply", ["tank", "regulator"])
def test_all_at_once_run_and_restart_bit_for_bit(supply: str) -> None:
    rig = with_outlet() if supply == "tank" else regulated()
    for effect in (e for e in EFFECTS if e != "exhaust_back_pressure"):  # a valve has it or a hose
        if effect.startswith("supply_regulator") == (supply == "regulator"):
            rig = rig.with_effect(effect)
    whole, first = (pamrs.Simulator(rig, sample_time=0.01, initial=START) for _ in range(2))
    expected = whole.run(COMMAND)
    first.run(COMMAND[:17])
    second = pamrs.Simulator(rig, sample_time=0.01, initial=START)
    second.restore(first.state)
    for channel, values in second.run(COMMAND[17:]).items():
        np.testing.assert_array_equal(values, expected[channel][17:], err_msg=channel)


def equal(one: Mapping[str, np.ndarray], two: Mapping[str, np.ndarray]) -> None:
    """Every channel to the last bit."""
    for channel in one:
        np.testing.assert_array_equal(one[channel], two[channel], err_msg=channel)


FORMS = [(effect, form) for effect in sorted(EFFECTS) for form in EFFECTS[effect].forms]


@pytest.mark.parametrize(
    ("effect", "form"), FORMS, ids=[f"{effect}-{form.name}" for effect, form in FORMS]
)
def test_a_form_survives_its_file_and_off_it_changes_nothing(effect: str, form: Form) -> None:
    plain, first = rig_for(effect), form.parameters[0]
    known = {first.name: 0.1 * first.upper}
    rig = plain.with_effect(effect, {first.name: first.upper}, std=known, form=form.name)
    assert rig.effects[0]["parameters"][first.name] == first.upper
    again = parse_rig(rig.to_toml_text())
    assert (again.effects, again.effect_std) == (rig.effects, {effect: pytest.approx(known)})
    assert json.loads(rig.to_json())["effects"] == [{**rig.effects[0], "at": ""}]
    assert rig.without_effect(effect).effects == []
    usual = plain.with_effect(effect, form=form.name)
    there = run(usual)
    equal(there, run(parse_rig(usual.to_toml_text())))
    assert all(np.isfinite(there[channel]).all() for channel in there)
    neutral = {p.name: p.neutral for p in form.parameters if p.neutral is not None}
    assert bool(neutral) == (effect != "heat_transfer")  # the only one without
    if neutral:
        equal(by_blocks(plain), run(plain.with_effect(effect, neutral, form=form.name)))


@pytest.mark.parametrize("info", EFFECTS.values(), ids=list(EFFECTS))
def test_a_fit_can_read_the_table(info: EffectInfo) -> None:
    names = {p.name.rstrip("_23") for p in info.parameters}
    assert 1 <= len(names) <= (5 if info.catalogue else 24)
    assert all((info.name, info.fingerprint, info.separates, info.reference))
    known = {p.name: p for form in info.forms for p in form.parameters}
    for form in info.forms:
        assert form.equation
        for p in form.parameters:
            assert p.lower <= p.default <= p.upper
            assert p.starts
            assert [p.lower, *p.starts, p.upper] == sorted([p.lower, *p.starts, p.upper])
            assert p.neutral is None or p.lower <= p.neutral <= p.upper
            assert parse_unit(p.unit).scale == 1.0
            assert p.meaning
    for form in info.forms[1:]:
        # what is usual of it may be another: a push is harder than what pulls all the time
        for p in form.parameters:
            assert replace(p, prior=None) == replace(known[p.name], prior=None)
        sizes = {p.name for p in form.parameters if p.role_in(sealed=False) == "size"}
        assert sizes & {p.name for p in info.parameters} or "share" in sizes


@pytest.mark.parametrize("effect", sorted(EFFECTS))
def test_the_core_takes_every_bound_of_the_table(effect: str) -> None:
    for form, parameter in ((f.name, p) for f in EFFECTS[effect].forms for p in f.parameters):
        for value in (parameter.lower, parameter.upper):
            rig = rig_for(effect).with_effect(effect, {parameter.name: value}, form=form)
            if (parameter.name, value) == ("mass_change", parameter.lower):
                with pytest.raises(ParameterError, match="no more can be taken away"):
                    _core.Rig(rig.to_json())
                continue
            refused = ""
            try:
                _core.Rig(rig.to_json())
            except RigError as error:
                refused = str(error)
            # what would need a step of less than a tenth of a microsecond is refused by that name
            assert not refused or "s would be needed" in refused


@pytest.mark.parametrize("effect", EFFECTS)
def test_the_diagnosis_knows_where_an_effect_acts_and_where_to_begin(effect: str) -> None:
    assert EFFECTS[effect].acts_in or ACTS[EFFECTS[effect].block]
    for sealed in (True, False):
        starts = starts_of(Term(effect), sealed=sealed)
        usual, lasting = EFFECTS[effect].forms[:1], EFFECTS[effect].lasting
        assert {start.form or usual[0].name for start in starts} == {
            form.name for form in lasting or usual
        }
        for start in starts:
            parameters = EFFECTS[effect].form(start.form).parameters
            restricting = {f"{effect}.{p.name}" for p in parameters if p.restricts}
            assert {*start.free, *start.fixed} == {f"{effect}.{p.name}" for p in parameters}
            assert all(value != 0.0 for name, value in start.free.items() if name in start.sizes)
            half = start.scaled(0.5)
            assert all(
                half.free[name]
                == pytest.approx(start.free[name] * (2.0**0.5 if name in restricting else 0.5))
                for name in start.sizes
            )


def test_unknown_places_and_parameters_are_named() -> None:
    rig = pamrs.rigs.shoulder()
    with pytest.raises(ParameterError, match="'widht'"):
        rig.with_effect("valve_dead_zone", {"widht": 0.01})
    with pytest.raises(ParameterError, match="half_width = 2"):
        rig.with_effect("valve_dead_zone", {"half_width": 2.0})
    with pytest.raises(ParameterError, match="names no valve"):
        rig.with_effect("valve_dead_zone", at="left")
    with pytest.raises(ParameterError, match="whole rig"):
        rig.with_effect("base_flexibility", at="left")
    with pytest.raises(ParameterError, match="valve"):
        pamrs.rigs.sealed_chamber().with_effect("valve_dead_zone")
    entry = (
        '\n[[effects]]\nid = "muscle_creep"\n'
        'parameters = { stiffnes = { value = 1.0, unit = "N/m" } }\n'
    )
    with pytest.raises(RigError, match="stiffnes"):
        parse_rig(rig.to_toml_text() + entry)
    entry = '\n[[effects]]\nid = "clock_skew"\nat = "left"\n'
    with pytest.raises(RigError, match="whole rig"):
        parse_rig(rig.to_toml_text() + entry)


def test_a_lagging_sensor_is_inverted_where_it_drives() -> None:
    rig = pamrs.rigs.shoulder().with_effect("pressure_lag", {"time_constant": 0.02})
    truth = by_blocks(pamrs.rigs.shoulder())
    lagging = pamrs.simulate(rig, COMMAND, sample_time=0.01, initial=START)
    np.testing.assert_array_equal(lagging["joint_angle"], truth["joint_angle"])
    behind = lagging["muscle_pressure"] + 0.02 * np.gradient(lagging["muscle_pressure"], 0.01)
    inner = slice(3, -3)
    assert np.abs(behind - truth["muscle_pressure"])[inner].max() < 0.2 * np.ptp(
        truth["muscle_pressure"]
    )
    assert np.abs(lagging["muscle_pressure"] - truth["muscle_pressure"]).max() > 1e3


def test_a_transducer_at_the_valve_reads_what_the_air_leaves_in_the_tube() -> None:
    tube = {"conductance": 2e-9}
    bare, muscle, valve = (
        run(rig)
        for rig in (
            pamrs.rigs.shoulder(),
            pamrs.rigs.shoulder().with_effect("tube_flow_restriction", tube),
            pamrs.rigs.shoulder().with_effect("tube_flow_restriction", tube | {"tap": 1.0}),
        )
    )
    assert not np.allclose(bare["joint_angle"], muscle["joint_angle"], rtol=1e-6)
    assert np.array_equal(muscle["joint_angle"], valve["joint_angle"]), (
        "the transducer moves nothing"
    )
    lead = valve["muscle_pressure"] - muscle["muscle_pressure"]
    before = np.concatenate([[5.0], COMMAND[:-1]])[
        : lead.size
    ]  # a sample is read under the command before it
    assert np.all(lead[before > 5.0] >= 0.0)
    assert np.all(lead[before < 5.0] <= 0.0)
    assert np.all(lead[before == 5.0] == 0.0), "shut: the muscle's own"
    assert np.abs(lead).max() > 1e3
    with pytest.raises(ParameterError, match=r"tap = 2"):
        pamrs.rigs.shoulder().with_effect("tube_flow_restriction", {"tap": 2.0})


def test_a_dead_time_of_whole_samples_is_the_command_that_much_later() -> None:
    plain = pamrs.rigs.shoulder()
    late = plain.with_effect("input_path_lag", {"delay": 0.03}, form="dead_time")
    shifted = np.concatenate([np.full(3, COMMAND[0]), COMMAND[:-3]])
    one, two = (
        pamrs.simulate(rig, command, sample_time=0.01, initial=START)
        for rig, command in ((late, COMMAND), (plain, shifted))
    )
    for channel in ("muscle_pressure", "supply_pressure", "joint_angle"):
        scale = float(np.ptp(two[channel]))
        np.testing.assert_allclose(one[channel], two[channel], atol=1e-9 * scale)


def test_a_dead_time_within_a_sample_lies_between_its_neighbours() -> None:
    """The step in which the command changes sees the mean of both: second order in the step."""
    plain = pamrs.rigs.shoulder()

    def pressure(seconds: float) -> np.ndarray:
        rig = plain.with_effect("input_path_lag", {"delay": seconds}, form="dead_time")
        return pamrs.simulate(rig, COMMAND, sample_time=0.01, initial=START)["muscle_pressure"]

    none, half, whole = pressure(0.0), pressure(0.005), pressure(0.01)
    moved = np.abs(whole - none) > 0.2 * np.abs(whole - none).max()
    share = (half - none)[moved] / (whole - none)[moved]
    assert moved.sum() > 10
    assert np.all((share > 0.2) & (share < 0.8))


def test_a_linear_model_refuses_a_dead_time_of_the_valve() -> None:
    rig = pamrs.rigs.shoulder().with_effect("input_path_lag", {"delay": 0.03}, form="dead_time")
    with pytest.raises(ParameterError, match=r"delay = 0\.03 is not allowed"):
        linearise(rig, 0.7)


def test_a_step_that_leaves_the_range_behind_a_hose_is_an_error_and_no_panic():
    """Within one step a pressure can be no number; flows in series must not stop at that."""
    rig = pamrs.rigs.shoulder().with_effect("tube_flow_restriction", {"conductance": 1e-8})
    start = {"joint_rate": 3e3, "muscle_pressure": 3e5}
    with pytest.raises(pamrs.SimulationError):
        pamrs.simulate(rig, np.full(20, 8.0), sample_time=0.005, initial=start)


def test_a_late_clock_is_the_dead_time_of_what_the_commands_go_to() -> None:
    other = {
        name: same_data_in(getattr(pamrs.rigs, name)(), Term("clock_skew"))
        for name in ("shoulder", "regulated_joint", "sealed_chamber")
    }
    assert other["sealed_chamber"] is None
    assert [getattr(other[name], "effect", "") for name in ("shoulder", "regulated_joint")] == [
        "input_path_lag",
        "supply_regulator_delay",
    ]


@pytest.mark.parametrize("effect", CATALOGUE.values(), ids=list(CATALOGUE))
def test_every_effect_says_what_to_do_on_the_bench(effect):
    assert effect.shares
    assert not effect.shares.endswith(".")
    assert effect.bench.endswith((".", "?"))
    assert len(effect.bench.split()) <= 30
    forms = {form.name: {p.name for p in form.parameters} for form in effect.forms}
    every = set().union(*forms.values())
    for own in effect.bench_units:
        assert own.parameter in (forms[own.form] if own.form else every)
        assert own.factor > 0.0
        assert bool(own.mixed_by) == bool(own.mixed)
        assert not own.mixed_by or own.mixed_by in every
    assert effect.on_bench("no such parameter") is None
