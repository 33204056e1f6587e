"""A tube that holds gas and carries waves: laws, the reference, what is refused."""

from __future__ import annotations

import math

import numpy as np
import pytest

import pamrs
from pamrs.control.linear import linearise
from pamrs.errors import PamrsError
from pamrs.rig import parse_rig
from tests.runs import Run, misses

AMBIENT = 101325.0
RT = 287.05 * 293.15
SOUND = math.sqrt(1.4 * RT)
HEAD = """schema = "pamrs.rig/1"
name = "hose"
[gas]
"""


def chamber(name: str, litres: float, bar: float = 3.0) -> str:
    """An isothermal chamber."""
    return (
        f"[chamber.{name}]\n"
        f'dead_volume = {{ value = {litres}, unit = "l" }}\n'
        f'initial_pressure = {{ value = {bar}, unit = "bar" }}\n'
        'alpha_in = { value = 1, unit = "1" }\nalpha_out = { value = 1, unit = "1" }\n'
        'alpha = { value = 1, unit = "1" }\n'
    )


def hose(length: float, segments: int, ends: str = 'from = "a"\nto = "b"', more: str = "") -> str:
    """A tube of four millimetres."""
    return (
        f"[line]\n{ends}\n{more}\n"
        f'length = {{ value = {length}, unit = "m" }}\n'
        f'diameter = {{ value = 4, unit = "mm" }}\nsegments = {segments}\n'
    )


def closed(length: float, segments: int, more: str = "") -> pamrs.Rig:
    """A large volume, a tube, and next to nothing at its other end."""
    text = HEAD + chamber("a", 1e4) + chamber("b", 1e-6) + hose(length, segments, more=more)
    return parse_rig(text)


def arrival(rig: pamrs.Rig) -> float:
    """When the far end has risen half as far as it will after a small step [s]."""
    start = {"muscle_pressure.a": 3.01e5}
    run = pamrs.simulate(rig, sample_time=1e-4, duration=0.05, initial=start)
    far = run["muscle_pressure.b"]
    k = int(np.argmax(far > 3.01e5))  # it is reflected there, and rises by twice the step
    return float(run.time[k - 1] + 1e-4 * (3.01e5 - far[k - 1]) / (far[k] - far[k - 1]))


@pytest.mark.parametrize(
    ("more", "speed"), [("", SOUND), ("alpha = { value = 1, unit = '1' }", math.sqrt(RT))]
)
def test_the_other_end_waits_for_length_over_speed_of_sound(more: str, speed: float) -> None:
    exact = 8.0 / speed
    errors = [abs(arrival(closed(8.0, n, more)) / exact - 1.0) for n in (4, 8, 16, 32, 64)]
    assert all(finer < coarse for coarse, finer in zip(errors, errors[1:], strict=False)), errors
    assert errors[2] < 0.06
    assert errors[4] < 0.025


def test_nothing_is_heard_before() -> None:
    run = pamrs.simulate(pamrs.rigs.named("long_tube"), sample_time=1e-3, duration=0.1)
    left, right = run["muscle_pressure.left"], run["muscle_pressure.right"]
    delay = 8.0 / SOUND
    early = run.time < 0.6 * delay
    assert np.ptp(left[early]) > 5e3
    assert right[early].max() < 1.0
    half = run.time[np.argmax(right > 5e3)]
    assert 0.9 * delay < half < 1.5 * delay
    at_once = pamrs.rigs.named("long_tube").with_parameters({"line.segments": 0})
    run = pamrs.simulate(at_once, sample_time=1e-3, duration=0.1)
    assert run["muscle_pressure.right"][3] > 1e3


def test_mass_is_conserved_and_the_balance_closes() -> None:
    isothermal = "alpha = { value = 1, unit = '1' }"
    text = HEAD + chamber("a", 0.1, 5.0) + chamber("b", 0.3, 0.0) + hose(8.0, 12, more=isothermal)
    run = pamrs.simulate(parse_rig(text), sample_time=0.002, duration=6.0)
    inside = sum(run.under("segment_mass").values())
    total = run["air_mass.a"] + run["air_mass.b"] + inside
    np.testing.assert_allclose(total, total[0], rtol=1e-12)
    moved = np.ptp(run["air_mass.a"])
    assert abs(run.balance.residual) < 1e-9 * moved
    assert abs(run.balance.created) < 1e-9 * moved
    assert run["muscle_pressure.a"][-1] == pytest.approx(run["muscle_pressure.b"][-1], abs=1.0)


BALANCED = (
    '[chamber.b]\ndead_volume = { value = 0.2, unit = "l" }\ngas = "energy_balance"\n'
    'initial_pressure = { value = 1, unit = "bar" }\n'
)


@pytest.mark.parametrize("segments", [1, 6])
def test_what_alpha_makes_up_is_said_and_by_what(segments: int) -> None:
    """All along the tube, its inlet included: ``alpha R T`` for each kilogram in the place of ``R
    T``.
    """
    text = HEAD + FED["a valve"].replace("segments = 6", f"segments = {segments}") + BALANCED
    run = pamrs.simulate(parse_rig(text), 9.0, sample_time=0.002, duration=0.1)
    inside = [*run.under("line_mass").values(), *run.under("segment_mass").values()]
    gained = sum(float(mass[-1] - mass[0]) for mass in inside)
    assert gained > 2e-5
    assert run.balance.created == pytest.approx(0.4 * gained, rel=1e-9)
    assert run.balance.laws == ("line",)
    assert "line.alpha, the speed of sound" in str(run.balance)
    assert "energy_balance" not in str(run.balance)


def test_a_tube_between_chambers_makes_up_what_its_segments_do() -> None:
    text = HEAD + chamber("a", 0.1, 5.0) + chamber("b", 0.3, 0.0) + hose(8.0, 12)
    run = pamrs.simulate(parse_rig(text), sample_time=0.002, duration=0.2)
    gained = sum(float(mass[-1] - mass[0]) for mass in run.under("segment_mass").values())
    assert run.balance.created == pytest.approx(0.4 * gained, rel=1e-9)
    assert run.balance.laws == ("line",)
    both = pamrs.simulate(pamrs.rigs.named("long_tube"), sample_time=0.002, duration=0.2).balance
    assert both.laws == ("chamber.left", "chamber.right", "line")
    assert 'gas = "energy_balance" of a chamber is; and by line.alpha' in str(both)


def test_a_new_rig_has_an_energy_balance_in_its_chambers_and_its_own_alpha_along_the_tube() -> None:
    rig = parse_rig(pamrs.rigs.template("long_tube"))
    assert {table["gas"] for table in rig.tables("chamber").values()} == {"energy_balance"}
    assert rig.parameter("line.alpha").tol == 0.02
    isothermal = rig.with_parameters({"line.alpha": 1.0})
    run = pamrs.simulate(isothermal, sample_time=0.002, duration=0.5)
    moved = np.ptp(run["air_mass.left"])
    assert abs(run.balance.residual) < 1e-9 * moved
    assert abs(run.balance.created) < 1e-9 * moved


@pytest.mark.parametrize("bar", [0.2, 2.0, 7.0])
def test_a_steady_flow_is_that_of_a_tube_without_waves(bar: float) -> None:
    def flow(segments: int) -> float:
        ends = 'from = "a"\nto = "ambient"'
        rig = parse_rig(HEAD + chamber("a", 1e5, bar) + hose(8.0, segments, ends))
        run = pamrs.simulate(rig, sample_time=0.01, duration=2.0)
        vented = run["mass_vented"]
        return float(vented[-1] - vented[100]) / (run.time[-1] - run.time[100])

    usual = flow(0)
    assert [flow(n) / usual for n in (1, 8)] == pytest.approx([1.0, 1.0], abs=0.01)


def test_it_rings_at_a_quarter_wave() -> None:
    """Of a tube that ends at next to nothing: the slowest pair of eigenvalues."""
    n, length = 24, 2.0
    text = pamrs.rigs.shoulder().to_toml_text() + hose(length, n, 'from = "chamber"\nto = "end"')
    muscle, end = "[chamber.muscle]\n", chamber("end", 1e-6, 0.0)
    text = text.replace("[chamber]\n", muscle).replace('from = "chamber"', 'from = "muscle"')
    text = text.replace("[valve]\n", '[valve]\nto = "muscle"\n').replace(
        "[muscle]\n", '[muscle]\nchamber = "muscle"\n'
    )
    rig = parse_rig(f"{text}\n{end}")
    start = {"muscle_pressure.muscle": 2e5, "muscle_pressure.end": 2e5}
    model = linearise(rig, math.radians(45.0), chamber="muscle", initial=start)
    values = np.linalg.eigvals(model.a)
    rings = np.sort(np.abs(values.imag[np.abs(values.imag) > 50.0])) / (2.0 * math.pi)
    assert rings[0] == pytest.approx(SOUND / (4.0 * length), rel=0.05)  # the muscle gives way
    assert rings[2] / rings[0] == pytest.approx(3.0, rel=0.05)
    assert (values.real[np.abs(values.imag) > 50.0] < 0.0).all()


FED = {
    "a valve": (
        '[supply]\nkind = "constant"\ninitial_pressure = { value = 6, unit = "bar" }\n'
        '[valve]\ndischarge_area_max = { value = 2, unit = "mm2" }\n'
        'null_voltage = { value = 5, unit = "V" }\nhalf_range = { value = 5, unit = "V" }\n'
        "area_fraction = { opening = [0, 1], fraction = [0, 1] }\n"
        + hose(4.0, 6, 'to = "b"', "inlet_volume = { value = 2, unit = 'cm3' }")
    ),
    "a regulator": (
        '[supply]\nkind = "regulator"\ninitial_pressure = { value = 1, unit = "bar" }\n'
        + hose(4.0, 6, 'from = "supply"\nto = "b"')
    ),
    "a chamber": chamber("a", 0.2, 2.5) + hose(4.0, 1) + "",
}


#: Pressures between the segments and flows through them: no rest, and one against the arrow.
FLOWING = {
    "a valve": {
        "line_pressure": 2.5e5,
        **{f"segment_pressure.{k}": 2.5e5 - 2e4 * k for k in range(1, 6)},
        **{f"segment_flow.{k}": 1e-3 - 1e-4 * k for k in range(1, 7)},
    },
    "a regulator": {
        **{f"segment_pressure.{k}": 1e5 + 3e3 * k for k in range(1, 6)},
        **{f"segment_flow.{k}": -2e-4 for k in range(1, 7)},
    },
    "a chamber": {"segment_flow.1": 8e-4},
}


@pytest.mark.parametrize("flowing", [False, True])
@pytest.mark.parametrize("fed", FED)
def test_every_channel_is_that_of_the_reference(fed: str, flowing: bool) -> None:
    rig = parse_rig(HEAD + FED[fed] + chamber("b", 0.2, 1.0))
    start = FLOWING[fed] if flowing else {}
    wave = np.sin(0.3 * np.arange(41))
    commands = {
        "a valve": {"valve_command": 5.0 + 2.0 * wave},
        "a regulator": {"supply_command": 1e5 + 5e4 * wave},
    }
    run = Run(rig, 0.005, 41, start, commands.get(fed, {}))
    found = misses(run.core(2e-5), run.reference(1e-11))
    assert max(found.values()) < 2e-6, found


def test_a_run_goes_on_bit_for_bit() -> None:
    rig = pamrs.rigs.named("long_tube")
    whole = pamrs.Simulator(rig, sample_time=0.002)
    for _ in range(13):
        whole.step()
    half = pamrs.Simulator(rig, sample_time=0.002)
    half.restore(whole.state)
    for _ in range(20):
        assert whole.step() == half.step()


def test_states_along_it_have_names() -> None:
    rig = closed(2.0, 3)
    names = pamrs.simulation.initial_names(rig)
    assert [name for name in names if name.startswith("segment")] == [
        "segment_pressure.1",
        "segment_pressure.2",
        "segment_flow.1",
        "segment_flow.2",
        "segment_flow.3",
    ]
    run = pamrs.simulate(
        rig, sample_time=1e-3, duration=0.0, initial={name: 1e-4 for name in names[-3:]}
    )
    assert run["segment_flow.2"][0] == 1e-4
    for wrong, told in (
        ({"segment_pressure.3": 1e5}, "segment_pressure.2"),
        ({"segment_flow": 1e5}, "segment_flow.3"),
        ({"segment_flow.1": 100.0}, "segment_flow.1"),
    ):
        with pytest.raises(PamrsError, match=told.replace(".", r"\.")):
            pamrs.simulate(rig, sample_time=1e-3, duration=0.01, initial=wrong)
    plain = pamrs.rigs.named("tube")
    with pytest.raises(PamrsError, match="no tube"):
        pamrs.simulate(plain, sample_time=1e-3, duration=0.1, initial={"segment_flow.1": 0.0})


@pytest.mark.parametrize(
    ("segments", "told"),
    [
        ("2.5", "whole number"),
        ("-1", "segments"),
        ("1000", "segments"),
        ('{ value = 4, unit = "m" }', "segments"),
    ],
)
def test_segments_are_a_small_whole_number(segments: str, told: str) -> None:
    text = HEAD + chamber("a", 1.0) + chamber("b", 1.0) + hose(2.0, 4)
    with pytest.raises(PamrsError, match=told):
        parse_rig(text.replace("segments = 4", f"segments = {segments}"))


def test_an_orifice_has_none() -> None:
    text = HEAD + chamber("a", 1.0) + chamber("b", 1.0)
    text += '[line]\nkind = "orifice"\nfrom = "a"\nto = "b"\nsegments = 4\n'
    text += 'discharge_area = { value = 1, unit = "mm2" }\n'
    with pytest.raises(PamrsError, match="segments"):
        parse_rig(text)


@pytest.mark.parametrize(
    "segments", ["", "segments = 0\n", 'segments = { value = 0, unit = "1" }\n']
)
def test_alpha_is_that_of_segments(segments: str) -> None:
    """Without them it would do nothing, and a tolerance of it would be fitted in vain."""
    text = HEAD + chamber("a", 1.0) + chamber("b", 1.0) + hose(2.0, 4)
    alpha = 'alpha = { value = 1.2, unit = "1", tol = 0.1 }\n'
    with_none = text.replace("segments = 4\n", segments)
    with pytest.raises(PamrsError, match=r"line\.alpha is not allowed without segments"):
        parse_rig(with_none + alpha)
    plain = parse_rig(with_none)
    assert "line.alpha" not in plain.parameters
    with pytest.raises(PamrsError, match=r"no parameter 'line\.alpha'"):
        plain.with_parameters({"line.alpha": 1.2})
    assert parse_rig(text + alpha).parameter("line.alpha").tol == 0.1


def test_alpha_comes_and_goes_with_segments() -> None:
    rig = pamrs.rigs.named("long_tube")
    none = rig.with_parameters({"line.segments": 0})
    assert "line.alpha" not in none.parameters
    assert "alpha    =" not in none.to_toml_text()
    assert parse_rig(none.to_toml_text()).model == none.model
    again = none.with_parameters({"line.alpha": 1.2, "line.segments": 8})
    assert again.parameter("line.alpha").value == 1.2
    assert again.parameter("line.alpha").tol == 0.0
    assert none.with_parameters({"line.segments": 8}).parameter("line.alpha").value == 1.4
    assert rig.with_parameters({"line.segments": 8}).parameter("line.alpha").tol == 0.02


@pytest.mark.parametrize(("known", "told"), [("tol = 1", "tol"), ("unknown = true", "unknown")])
def test_a_count_has_no_tolerance(known: str, told: str) -> None:
    text = HEAD + chamber("a", 1.0) + chamber("b", 1.0) + hose(2.0, 4)
    value = f'segments = {{ value = 4, unit = "1", {known} }}'
    with pytest.raises(PamrsError, match=rf"line\.segments\.{told} is not allowed"):
        parse_rig(text.replace("segments = 4", value))


def test_a_tube_without_segments_is_told_nothing_of_them() -> None:
    """Its description for the core, and all that is kept by it, are what they were."""
    assert "segments" not in pamrs.rigs.named("tube").to_json()
    assert '"segments": 16' in pamrs.rigs.named("long_tube").to_json()
