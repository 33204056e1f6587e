"""What is proposed for a log, and the units that physics contradicts."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import pamrs
from pamrs.errors import ParameterError, RecordingError
from pamrs.recordings import LogProposal, propose, suspicions
from pamrs.recordings.logs import split_heading, understood_unit
from tests.recordings.written import (
    DT,
    SHOULDER,
    UNITS,
    N,
    case_of,
    npz,
    signals,
    write_table,
    written,
)
from tests.tables import rows_of

TIME = np.arange(4000) * 5e-3
LIFT = np.sin(np.pi * TIME / TIME[-1]) ** 2


def of_one(file: Path, rig: pamrs.Rig | None = SHOULDER, **options: Any) -> LogProposal:
    """What is proposed for a log alone."""
    (item,) = propose([file], rig, **options).logs
    return item


def channels_in(item: LogProposal) -> dict[str, str]:
    return {match.channel: match.series.name for match in item.matches}


def test_rates_units_and_ranges_are_listed(tmp_path: Path) -> None:
    file, _, _ = written(tmp_path, "mf4")
    listed = {each.name: each for each in of_one(file, None).listed}
    assert set(listed) == set(UNITS)
    p1 = listed["p1"]
    assert (p1.count, p1.unit, p1.channel) == (N, "bar", "muscle_pressure")
    assert p1.rate == pytest.approx(1.0 / DT)
    assert (p1.low, p1.high) == (signals()["p1"].min(), signals()["p1"].max())


def test_named_blocks_several_clocks_events_and_parts(tmp_path: Path) -> None:
    rig = pamrs.rigs.antagonistic_joint()
    data = signals()
    file = npz(
        tmp_path,
        t=np.concatenate([data["t"] + 20.0 * k for k in range(3)]),
        **{"p_flexor [bar]": np.tile(data["p1"], 3)},
        **{"p_extensor [bar]": np.tile(4.0 - data["p1"], 3)},
        **{"hinge_angle [deg]": np.tile(data["angle"], 3)},
    )
    proposal = propose([file], rig)
    (item,) = proposal.logs
    assert channels_in(item) == {
        "muscle_pressure.flexor": "p_flexor",
        "muscle_pressure.extensor": "p_extensor",
        "joint_angle.elbow": "hinge_angle",
    }
    assert (item.split, len(item.pieces)) == ({"gap": 8.0}, 3)
    assert any("not found in this log: valve_command.flexor" in text for text in item.remarks)
    case = case_of(tmp_path, proposal, rig)
    assert [each.name for each in case.fit] == ["run_1", "run_2"]
    assert [each.name for each in case.held_out] == ["run_3"]


def test_several_logs_hold_out_the_last(tmp_path: Path) -> None:
    homes = [tmp_path / str(index) for index in range(2)]
    for home in homes:
        home.mkdir()
    files = [written(home, "tdms", signals(k))[0] for k, home in enumerate(homes)]
    text = propose(files, SHOULDER).case_toml(tmp_path)
    assert text.count("[[recording]]") == 2
    assert text.index('role = "fit"') < text.index('role = "held_out"')
    assert 'file = "1/run.tdms"' in text


def test_events_are_held_and_clocks_in_milliseconds_are_seen(tmp_path: Path) -> None:
    series = {"daq time": TIME * 1e3, "muscle pressure (kPa)": 300.0 * LIFT}
    series["time valve [s]"] = np.array([0.0, 3.0, 4.0, 11.0, 19.0])
    series["valve [V]"] = np.array([5.0, 6.0, 4.0, 5.5, 5.0])
    item = of_one(npz(tmp_path, **series))
    matches = {match.channel: match for match in item.matches}
    assert matches["valve_command"].hold
    assert matches["valve_command"].time["column"] == "time valve"
    assert matches["muscle_pressure"].time == {"column": "daq time", "unit": "ms"}
    assert not matches["muscle_pressure"].hold
    assert not any("sampled at" in text for text in item.remarks)


def test_different_rates_are_told(tmp_path: Path) -> None:
    slow = np.arange(1000) * 0.02
    series = {"t p1": TIME, "p1 [bar]": LIFT, "t angle": slow, "angle [deg]": 20.0 + slow}
    proposal = propose([npz(tmp_path, **series)])
    told = "sampled at 50 to 200 Hz: all are laid on the 200 Hz of muscle_pressure"
    assert told in proposal.logs[0].remarks[0]
    assert case_of(tmp_path, proposal).recordings[0].sample_time == 5e-3


def test_a_sensor_in_volts_is_told(tmp_path: Path) -> None:
    raw = {"muscle_pressure_raw [V]": LIFT, "angle [deg]": LIFT}
    item = of_one(npz(tmp_path, t=TIME, **raw), None)
    assert any("is in V: give from and to" in text for text in item.remarks)
    assert list(channels_in(item)) == ["joint_angle"]


def test_without_clock_or_channel(tmp_path: Path) -> None:
    file = npz(tmp_path, p1=LIFT, q=LIFT)
    assert any("p1 has no clock" in text for text in of_one(file, None).remarks)
    text = propose([file], sample_time=0.005).case_toml(tmp_path)
    assert "sample_time = 0.005" in text
    with pytest.raises(ParameterError, match="sample_time = 0"):
        propose([file], sample_time=0.0)
    with pytest.raises(RecordingError, match="no channel was recognised"):
        propose([npz(tmp_path, zzz=LIFT)]).case_toml(tmp_path)


@pytest.mark.parametrize(("heading", "name", "unit"), rows_of(__file__, "headings"))
def test_headings(heading: str, name: str, unit: str) -> None:
    assert split_heading(heading) == (name, unit)


@pytest.mark.parametrize(
    ("text", "unit", "absolute"),
    [
        ("bar", "bar", None), ("PSI", "psi", None), ("[V]", "V", None), ("Seconds", "s", None),
        ("°C", "degC", None), ("N.m", "N m", None), ("KPA", "kPa", None), ("bara", "bar", True),
        ("psia", "psi", True), ("MPa", "MPa", None), ("mm", "mm", None), ("(bar(a))", "bar", True),
        ("PSI(A)", "psi", True), ("kPa abs.", "kPa", True), ("BARG", "bar", False),
        ("kg/cm²", "kgf/cm2", None), ("mm Hg", "mmHg", None), ("mH₂O", "mH2O", None),
        ("atü", "at", False), ("mA", "mA", None), ("N·m", "N·m", None), ("nm", "Nm", None),
    ],
)  # fmt: skip
def test_units_as_logs_write_them(text: str, unit: str, absolute: bool | None) -> None:
    assert understood_unit(text) == (unit, absolute, None)


@pytest.mark.parametrize(
    "text", ["4..20 mA = 0..6 bar(a)", "0..6 bar abs = 4..20 mA", "4 – 20 mA -> 0 – 6 bar(a)"]
)
def test_a_calibration_is_read_where_a_unit_stands(text: str) -> None:
    assert understood_unit(text) == ("bar", True, ((4.0, 20.0), (0.0, 6.0)))


@pytest.mark.parametrize("text", ["", "-", "%", "1", "counts", "foo", "a", "bar" * 40])
def test_what_is_no_unit(text: str) -> None:
    assert understood_unit(text) is None


# --------------------------------------------------------------------- suspicions

BAR, PSI = 1e5, 6894.757
SUPPLY = np.linspace(13.6, 12.9, len(TIME))
VENTED = np.maximum(4.0 * LIFT - 0.4, 0.0)
REST = np.maximum(LIFT, 0.1)
SUSPECT: list[tuple[str, str, Any, str, str]] = [
    ("supply_pressure", "bar", SUPPLY * 14.5 * BAR, "psi", "13.8 bar of the supply of the rig"),
    ("supply_pressure", "psi", SUPPLY * PSI, "bar", "read as bar it reaches 13.6 bar"),
    ("supply_pressure", "Pa", SUPPLY * 100.0, "kPa", ""),
    (
        "muscle_pressure",
        "bar",
        VENTED * 14.5 * BAR,
        "psi",
        "read as psi it reaches 52.2 psi (3.599 bar)",
    ),
    ("muscle_pressure", "bar", (VENTED + 1.013) * BAR, "absolute", "the ambient pressure"),
    ("muscle_pressure", "bar", (VENTED - 1.013) * BAR, "gauge", "a vacuum"),
    ("temperature", "K", 21.0 + LIFT, "degC", "said to be in K"),
    ("temperature", "degC", 294.0 + LIFT + 273.15, "K", "read as K"),
    ("joint_angle", "rad", 20.0 + 60.0 * LIFT, "deg", "goes from 20 to 80 deg"),
    ("joint_angle", "deg", np.radians(0.35 + 1.0 * LIFT), "rad", "the rig file allows 15 to 120"),
]


@pytest.mark.parametrize(("channel", "said", "values", "likely", "words"), SUSPECT)
def test_units_that_physics_contradicts(
    channel: str, said: str, values: Any, likely: str, words: str
) -> None:
    channels = {"supply_pressure": SUPPLY * BAR, channel: values}
    units = {"supply_pressure": "bar", channel: said}
    (found,) = suspicions(channels, units, SHOULDER)
    assert (found.channel, found.likely) == (channel, likely)
    assert words in found.text


IN_PSI = pamrs.rig.parse_rig(
    SHOULDER.to_toml_text(comments=False).replace(
        'initial_pressure = { value = 1380000.0, unit = "Pa"',
        'initial_pressure = { value = 200.0, unit = "psi"',
    )
)


@pytest.mark.parametrize(
    ("channel", "said", "values", "words"),
    [
        (
            "muscle_pressure",
            "bar",
            VENTED * 14.5 * BAR,
            "would reach 52.2 bar (757 psi), against 13.79 bar (200 psi) of the supply of the rig "
            "file; read as psi it reaches 52.2 psi",
        ),
        ("supply_pressure", "kPa", SUPPLY * 100.0, "would reach 1.36 kPa (0.1972 psi), against"),
        ("muscle_pressure", "mbar", VENTED * BAR + 101325.0, "never falls below 1013 mbar and"),
        ("temperature", "K", 21.0 + LIFT, "would be 21.5 K; read as degC it is 21.5 degC"),
    ],
)
def test_the_evidence_is_in_the_units_of_the_log_and_of_the_rig_file(
    channel: str, said: str, values: Any, words: str
) -> None:
    (found,) = suspicions({channel: values}, {channel: said}, IN_PSI)
    assert words in found.text


@pytest.mark.parametrize(("said", "factor", "likely"), [("m", 1e3, "mm"), ("mm", 1e-3, "m")])
def test_lengths(said: str, factor: float, likely: str) -> None:
    rig = pamrs.rigs.hanging_mass()
    table = rig.tables("load")[""]
    low, high = table["min_length"], table["max_length"]
    length = low + (high - low) * (0.2 + 0.6 * LIFT)
    assert suspicions({"length": length}, {"length": said}, rig) == []
    (found,) = suspicions({"length": length * factor}, {"length": said}, rig)
    assert found.likely == likely


def test_sound_recordings_are_not_suspected() -> None:
    rig = SHOULDER
    channels = {
        "supply_pressure": SUPPLY * BAR,
        "muscle_pressure": VENTED * BAR,
        "joint_angle": np.radians(20.0 + 60.0 * LIFT),
        "temperature": 293.0 + LIFT,
        "valve_command": 5.0 + LIFT,
    }
    units = dict(zip(channels, ("bar", "bar", "deg", "K", "V"), strict=True))
    assert suspicions(channels, units, rig) == []
    assert suspicions(channels, units) == []
    empty = {name: np.full(50, np.nan) for name in channels}
    assert suspicions(empty, units, rig) == []
    held = {"muscle_pressure": np.maximum(3.0 * LIFT, 1.3) * BAR + np.linspace(0, 3e4, len(TIME))}
    assert suspicions(held, {"muscle_pressure": "bar"}, rig) == []


@pytest.mark.parametrize("lasting", [6.0, 12.0, 25.0])
def test_a_curve_that_only_passes_the_ambient_pressure_is_not_called_absolute(
    lasting: float,
) -> None:
    rig = pamrs.rigs.named("blow_down_tank")
    end = 101325.0 + 5e3
    for falling in (
        end + 5e5 * (np.exp(-TIME / lasting) - np.exp(-TIME[-1] / lasting)),
        end + 5e5 * (1.0 - TIME / TIME[-1]),
        end + 2e5 * np.sin(np.pi * TIME / 5.0) ** 2,
    ):
        assert suspicions({"muscle_pressure": falling}, {"muscle_pressure": "bar"}, rig) == []
    rested = 101325.0 + 5e5 * np.exp(-TIME)
    (found,) = suspicions({"muscle_pressure": rested}, {"muscle_pressure": "bar"}, rig)
    assert (found.likely, 'unit = "bar(a)" makes them gauge' in found.text) == ("absolute", True)


def test_a_pressure_that_another_one_agrees_with_is_not_suspected() -> None:
    """Whatever the rig file says that the tank once had."""
    low = SHOULDER.with_parameters({"supply.initial_pressure": 1e5})
    muscle = np.maximum(6.2 * LIFT - 0.2, 0.0) * BAR
    channels = {"muscle_pressure": muscle, "supply_pressure": np.full(len(TIME), 6.2 * BAR)}
    assert suspicions(channels, {"muscle_pressure": "bar", "supply_pressure": "kPa"}, low) == []
    alone = {"muscle_pressure": muscle}
    assert [s.likely for s in suspicions(alone, {"muscle_pressure": "bar"}, low)] == ["psi"]
    high = {"muscle_pressure": 10.0 * muscle, "supply_command": 10.0 * muscle}
    units = {"muscle_pressure": "bar", "supply_command": "MPa"}
    assert suspicions(high, units) == []
    assert [s.likely for s in suspicions(high, units | {"supply_command": "bar"})] == ["psi"]
    tank = pamrs.rigs.named("blow_down_tank").with_parameters({"chamber.initial_pressure": 60e5})
    assert suspicions({"muscle_pressure": 10.0 * muscle}, {"muscle_pressure": "bar"}, tank) == []


def test_a_regulator_goes_as_far_as_it_is_set() -> None:
    """What the rig file begins with says nothing of it."""
    rig = pamrs.rigs.named("regulated_joint").with_parameters({"supply.initial_pressure": 1e5})
    pressure = (0.2 + 0.8 * LIFT) * 4e5
    channels = {"supply_command": pressure, "muscle_pressure": pressure}
    units = {"supply_command": "bar", "muscle_pressure": "bar"}
    assert suspicions(channels, units, rig) == []
    assert suspicions({"muscle_pressure": pressure}, units, rig) == []
    both = channels | {"supply_pressure": pressure}
    assert suspicions(both, units | {"supply_pressure": "bar"}, rig) == []
    (found,) = suspicions(channels | {"muscle_pressure": 14.5 * pressure}, units, rig)
    assert found.likely == "psi"
    assert "of the largest command of the regulator" in found.text


def test_suspicions_stand_in_the_case(tmp_path: Path) -> None:
    file = npz(tmp_path, t=TIME, **{"p_muscle [bar]": VENTED * 14.5})
    proposal = propose([file], SHOULDER)
    assert "read as psi" in proposal.case_toml(tmp_path)


PROGRAMS = rows_of(__file__, "programs")


@pytest.mark.parametrize("program", PROGRAMS)
def test_tables_as_programs_write_them(tmp_path: Path, program: str) -> None:
    head, mark, decimal = PROGRAMS[program]
    rows = [
        mark.join(f"{value:.4f}" for value in row).replace(".", decimal)
        for row in zip(TIME[:200], 3.0 * LIFT[:200], 20.0 + 60.0 * LIFT[:200], strict=True)
    ]
    (tmp_path / "run.txt").write_text(head + "\n".join(rows) + "\n", encoding="cp1252")
    (only,) = case_of(tmp_path, propose([tmp_path / "run.txt"], SHOULDER)).recordings
    assert only.sample_time == 5e-3
    assert set(only.channels) == {"muscle_pressure", "joint_angle"}
    pressure = only.channels["muscle_pressure"]
    np.testing.assert_allclose(pressure, 3e5 * LIFT[:200], atol=6.0)


def test_a_load_frames_load_cell_is_its_force(tmp_path: Path) -> None:
    """Its diagnosis is of the force alone."""
    k = np.arange(50.0)
    columns = {"time [s]": k / 100, "p [bar]": 2 + 0.01 * k, "load_cell [N]": 50 + k}
    table = write_table(tmp_path / "frame.csv", columns | {"position [mm]": 270 - 0.1 * k})
    found = propose([table], pamrs.rigs.named("bench")).case_toml(tmp_path)
    assert 'force = { column = "load_cell", unit = "N" }' in found


def proposed(tmp_path: Path, names: list[str], rig: pamrs.Rig | None) -> tuple[dict[str, str], str]:
    """Which series of a log are proposed as what, and what is remarked; all are near 21."""
    values = {name: 21.0 + 0.1 * k + LIFT for k, name in enumerate(names)}
    item = of_one(npz(tmp_path, t=TIME, **{"muscle_pressure [bar]": VENTED}, **values), rig)
    found = {name: channel for channel, name in channels_in(item).items()}
    return found, "; ".join(item.remarks)


@pytest.mark.parametrize("rig", [None, SHOULDER])
@pytest.mark.parametrize(
    "names",
    [
        ["temp_muscle", "temp_oil"],
        ["temp_muscle [degC]", "temp_oil [degC]"],
        ["T1 [degC]"],
        ["ambient_pressure"],
        ["room"],
    ],
)
def test_no_room_is_guessed(tmp_path: Path, names: list[str], rig: pamrs.Rig | None) -> None:
    """A diagnosis would set the gas of the rig by it."""
    found, told = proposed(tmp_path, names, rig)
    assert "ambient_temperature" not in found.values()
    assert "ambient_temperature" not in told


@pytest.mark.parametrize("rig", [None, SHOULDER])
@pytest.mark.parametrize(
    "name",
    ["ambient_temperature", "Room temperature [degC]", "T_Umgebung [degC]", "tamb", "Temp Raum"],
)
def test_a_room_that_is_named_is_proposed(tmp_path: Path, name: str, rig: pamrs.Rig | None) -> None:
    found, told = proposed(tmp_path, ["temp_gas [degC]", "temp_oil [degC]", name], rig)
    assert found[split_heading(name)[0]] == "ambient_temperature"
    assert "temp_oil" not in found
    if rig is None:
        assert found["temp_gas"] == "temperature"
    else:  # its gas has no temperature of its own
        assert "temp_gas" not in found
        assert "not found in this log: valve_command" in told


@pytest.mark.parametrize(
    ("supply", "muscle", "suspected"),
    [
        (6.0, 11.0, {"muscle_pressure"}),  # within what the rig file has of its tank, not of this
        (6.0, 5.5, set()),
        (13.5, 11.0, set()),
        (0.4, 11.0, set()),  # a gauge that is not connected tells nothing
        (87.0, 70.0, {"supply_pressure", "muscle_pressure"}),  # both in psi
    ],
)
def test_a_muscle_above_its_recorded_supply_is_suspected(
    supply: float, muscle: float, suspected: set[str]
) -> None:
    """Whatever the rig file says that the tank once had."""
    rig = SHOULDER.with_parameters({"supply.initial_pressure": 13.8e5})
    if supply > 20.0:
        rig = rig.with_parameters({"supply.initial_pressure": 6e5})
    channels = {
        "supply_pressure": np.full(len(TIME), supply * BAR),
        "muscle_pressure": np.maximum(1.1 * LIFT - 0.1, 0.0) * muscle * BAR,
    }
    found = suspicions(channels, dict.fromkeys(channels, "bar"), rig)
    likely = {one.channel for one in found if one.likely == "psi"}
    assert likely == suspected
    for one in found:
        if one.channel == "muscle_pressure" and one.likely == "psi":
            assert "bar of the recorded supply" in one.text or supply > 20.0


def test_channels_that_are_missing_are_explained(tmp_path: Path) -> None:
    file = npz(tmp_path, t=TIME, **{"p_muscle [bar]": VENTED})

    def missing(rig: pamrs.Rig) -> str:
        remarks = of_one(file, rig).remarks
        return next(text for text in remarks if text.startswith("not found in this log: "))

    told = missing(SHOULDER)
    assert "valve_command (voltage of the valve)" in told
    assert "joint_torque (torque of the muscles at the joint, by a torque sensor; not need" in told
    told = missing(pamrs.rigs.bench())
    assert "force (pull of the muscles, by a load cell), " in told  # which a frame needs
    assert told.endswith("by a meter in front of it; not needed, tells blocks apart)")


def test_columns_that_are_no_channel_are_said(tmp_path: Path) -> None:
    data = signals()
    series = {"Ventil [V]": np.full(N, 5.0), "Vordruck [bar]": 7.0 - 0.1 * data["t"]}
    series |= {"Druck [bar]": data["p1"], "Winkel [deg]": data["angle"]}
    series |= {"Motorstrom [A]": np.sin(data["t"]), "seq": np.arange(N)}
    item = of_one(npz(tmp_path, t=data["t"], **series))
    found = channels_in(item)
    assert found["supply_pressure"] == "Vordruck"
    assert found["muscle_pressure"] == "Druck"
    (told,) = [text for text in item.remarks if text.startswith("not used: ")]
    assert "seq" not in told


def test_a_preposition_is_no_supply(tmp_path: Path) -> None:
    data = signals()
    item = of_one(npz(tmp_path, t=data["t"], **{"Druck vor Kolben [bar]": data["p1"]}))
    assert [match.channel for match in item.matches] == ["muscle_pressure"]
