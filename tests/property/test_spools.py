"""Valves whose spools are not at once where their commands say, and a regulator with a dead band:
the core against the reference.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, example, given, settings
from hypothesis import strategies as st

import pamrs
from tests.property.networks import GAS, Blocks, rig_of, valve
from tests.runs import Run, misses

#: Of a channel's range, at steps of 10 us: what a spool strikes its stop within is a kink.
SMOOTH, STOPPED = 1e-6, 1e-5
ROWS, SAMPLE_TIME = 31, 0.01

#: A failing example is not shrunk: the reference is too slow for that.
SLOW: dict[str, Any] = {
    "deadline": None,
    "phases": [Phase.explicit, Phase.reuse, Phase.generate],
    "suppress_health_check": [HealthCheck.too_slow],
}

AREA = 1.5e-6
CHAMBER = {"dead_volume": 2e-4, "initial_pressure": 2e5}
CHAMBER |= {"alpha_in": 1.3, "alpha_out": 1.1, "alpha": 1.2}
SUPPLY = {"kind": "constant", "initial_pressure": 6e5}
#: A valve of an area that opens in proportion.
PLAIN = valve(AREA) | {"opening": [0.0, 1.0], "fraction": [0.0, 1.0]}


def run_of(blocks: Blocks, commands: dict[str, np.ndarray], sample_time: float) -> Run:
    """A chamber behind some valves."""
    rig = rig_of({"gas": GAS, "supply": SUPPLY, "chamber": CHAMBER, **blocks})
    rows = next(iter(commands.values())).size
    return Run(rig, sample_time, rows, {}, commands)


def worst(run: Run, step: float | None) -> float:
    """Largest error of a run as a share of its channel's range."""
    return max(misses(run.core(step), run.reference(1e-11)).values())


_MOMENTS = [
    *(0.0, 0.1, 7.742318351248825, 8.029412436018957, 5.4580066892495, 0.0, 0.0),
    *(0.41863896429556574, 2.6758183616824853, 9.702853544179105, 0.0, 6.103515625e-05, 0.0),
    *(2.4252403593297993, 0.0, 9.489666317548707, 1.008740173435554, 0.7494366879156257),
    *(8.275084640919006, 6.075248454588506, 1.8326, 9.402829314380572, 5.960464477539063e-08),
    *(9.133879388345585, 0.0, 7.941511378150339, 0.0, 6.911606177497943, 1.5, 0.0),
    7.246481123374719,
]


@settings(max_examples=2, **SLOW)
@given(
    st.floats(8.0, 60.0),
    st.sampled_from([0.08, 0.3, 0.7, 1.0, 1.6]),
    st.lists(st.floats(0.0, 10.0), min_size=ROWS, max_size=ROWS),
)
# the command turns it back just as it reaches its stop
@example(28.63654590234348, 0.7, [2.8117035, 0.4291361, 3.995758, 0.0, 0.0, 5.9965711, *[3.0] * 25])
# it opens for a moment, which a long step of the reference does not see
@example(8.63380676785694, 0.7, _MOMENTS)
def test_a_spool_of_second_order(frequency: float, damping: float, volts: list[float]) -> None:
    """It overshoots, strikes its stops and leaves them, under steps of the command."""
    spool = {"spool": "second_order", "natural_frequency": frequency, "damping_ratio": damping}
    run = run_of({"valve": PLAIN | spool}, {"valve_command": np.array(volts)}, SAMPLE_TIME)
    assert worst(run, 1e-5) < STOPPED


def switching(**own: Any) -> dict[str, Any]:
    """A valve that switches, whose command is 0 V to 24 V."""
    return PLAIN | {"spool": "switching", "null_voltage": 0.0, "half_range": 24.0, **own}


PAIRS = [
    ("fill", "closed"),
    ("fill", "vent"),
    ("vent", "closed"),
    ("vent", "fill"),
    ("closed", "fill"),
    ("closed", "vent"),
    ("either", "closed"),
]


@pytest.mark.parametrize(("here", "there"), PAIRS)
@settings(max_examples=2, **SLOW)
@given(
    st.tuples(st.floats(1e-3, 9e-3), st.floats(5e-4, 6e-3)),
    st.sampled_from([0.0, 40.0, 57.3, 210.0]),
    st.sampled_from([0.0, 0.3, 0.77]),
    st.lists(st.floats(-24.0, 24.0).map(lambda u: round(u, 2)), min_size=ROWS, max_size=ROWS),
)
def test_valves_that_switch(
    here: str,
    there: str,
    delays: tuple[float, float],
    carrier: float,
    phase: float,
    volts: list[float],
) -> None:
    """Delays, pulses that are too short and gaps that are, with and without a carrier."""
    own = {"with_current": here, "without_current": there, "carrier_frequency": carrier}
    own |= {"opening_delay": delays[0], "closing_delay": delays[1]}
    own |= {"carrier_phase": phase if carrier else 0.0}
    run = run_of({"valve": switching(**own)}, {"valve_command": np.array(volts)}, SAMPLE_TIME)
    assert worst(run, 2e-5) < SMOOTH


def test_full_periods_of_a_carrier_are_one_pulse() -> None:
    """A valve that needs more than a period of its carrier opens where the duty stays full."""
    own = {"with_current": "fill", "without_current": "closed", "carrier_frequency": 210.0}
    own |= {"opening_delay": 6.2e-3, "closing_delay": 5e-4, "carrier_phase": 0.77}
    volts = np.where(np.arange(31) == 25, 24.0, 0.0)
    run = run_of({"valve": switching(**own)}, {"valve_command": volts}, SAMPLE_TIME)
    assert worst(run, 2e-5) < SMOOTH


def pulsed_pair(**own: Any) -> Run:
    """Two 2/2 valves at one chamber, one fills and one vents, their duties given as volts."""
    common = {"carrier_frequency": 80.0, "opening_delay": 2.1e-3, "closing_delay": 1.3e-3, **own}
    time = SAMPLE_TIME * np.arange(61)
    wave = 24.0 * 0.45 * np.sin(2.0 * np.pi * 3.0 * time)
    return run_of(
        {
            "valve.into": switching(with_current="fill", **common),
            "valve.out": switching(with_current="vent", **common),
        },
        {"valve_command.into": 10.0 + wave, "valve_command.out": 8.0 - wave},
        SAMPLE_TIME,
    )


def test_steps_end_where_a_valve_switches() -> None:
    """So the error is that of Runge and Kutta, however long the steps are: a step that straddled
    would miss by its whole length.
    """
    run = pulsed_pair()
    want = run.reference(1e-12)
    for step in (1e-2, 5e-3, 2e-3, 1e-3, 1e-4):
        assert max(misses(run.core(step), want).values()) < 1e-8, step


def test_below_its_dead_region_a_duty_opens_nothing() -> None:
    """A pulse of d/f that is no longer than the opening delay; beyond it the mean flow grows by the
    duty, less (closing - opening) f: choked, the pressure rises in proportion.
    """
    carrier, opening, closing = 50.0, 4e-3, 1e-3
    own = {"carrier_frequency": carrier, "opening_delay": opening, "closing_delay": closing}

    def rise(duty: float) -> float:
        volts = np.full(101, 24.0 * duty)
        run = run_of(
            {"valve": switching(**own), "chamber": CHAMBER | {"dead_volume": 2e-2}},
            {"valve_command": volts},
            SAMPLE_TIME,
        )
        pressure = run.core()["muscle_pressure"]
        return float(pressure[-1] - pressure[20])  # of forty periods

    full = rise(1.0)
    assert rise(0.19) == 0.0
    for duty in (0.25, 0.5, 0.9):
        assert rise(duty) == pytest.approx(full * (duty - (opening - closing) * carrier), rel=1e-9)
    assert rise(0.96) == pytest.approx(full, rel=1e-12)


def test_a_fast_spool_is_an_ideal_one_and_an_ideal_one_is_what_it_was() -> None:
    volts = 5.0 + 2.0 * np.sin(0.2 * np.arange(ROWS))
    plain = run_of({"valve": PLAIN}, {"valve_command": volts}, SAMPLE_TIME)
    named = run_of({"valve": PLAIN | {"spool": "ideal"}}, {"valve_command": volts}, SAMPLE_TIME)
    assert plain.plant.to_json() == named.plant.to_json()
    assert "spool" not in plain.plant.to_json()
    fast = {"spool": "second_order", "natural_frequency": 2e4, "damping_ratio": 1.0}
    quick = run_of({"valve": PLAIN | fast}, {"valve_command": volts}, SAMPLE_TIME).core(1e-4)
    want = plain.core(1e-4)["muscle_pressure"]
    np.testing.assert_allclose(quick["muscle_pressure"], want, atol=3e-4 * np.ptp(want))


@settings(max_examples=8, **SLOW)
@given(
    st.floats(1e3, 8e4),
    st.floats(0.0, 3e6),
    st.lists(st.floats(1e5, 6e5), min_size=8, max_size=8),
)
def test_a_regulator_with_a_dead_band(band: float, droop: float, levels: list[float]) -> None:
    supply = {"kind": "regulator", "initial_pressure": 3e5, "time_constant": 0.05}
    supply |= {"droop": droop, "dead_band": band}
    line = {"kind": "orifice", "from": "supply", "to": "chamber", "discharge_area": 2e-6}
    command = np.repeat(np.array(levels), 5)
    blocks = {"gas": GAS, "supply": supply, "chamber": CHAMBER, "line": line}
    run = Run(rig_of(blocks), 0.02, command.size, {}, {"supply_command": command})
    assert max(misses(run.core(2e-5), run.reference(1e-11)).values()) < 1e-4


def test_a_dead_band_is_the_effect_of_that_name() -> None:
    rig = pamrs.rigs.named("regulated_joint")
    command = 2e5 + 5e4 * np.sin(0.1 * np.arange(101))
    stated = rig.with_parameters({"supply.dead_band": 2e4})
    named = rig.with_effect("supply_regulator_deadband", {"dead_band": 2e4})
    one, other, without = (
        pamrs.simulate(r, supply_command=command, sample_time=0.01)["supply_pressure"]
        for r in (stated, named, rig)
    )
    np.testing.assert_allclose(one, other, rtol=1e-12)
    assert float(np.abs(one - without).max()) > 1e4
