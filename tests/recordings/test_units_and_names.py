"""Small logs with the units and names of laboratories: each is read right, or what is left to the
user is told. Nothing is guessed in the place of a unit that is written.
"""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import pamrs
from pamrs.diagnosis.prepare import noted_units
from pamrs.errors import RecordingError
from pamrs.recordings import (
    Case,
    LogProposal,
    Proposal,
    Recording,
    load_case,
    load_recording,
    propose,
)
from pamrs.recordings.logs import read_log
from pamrs.rig import load_rig
from tests.recordings.written import SHOULDER, case_of, write_json_messages, write_table
from tests.tables import rows_of

Array = NDArray[np.float64]
FAULTS = Path(__file__).parents[1] / "faults"
REGULATED = FAULTS / "03_command_taken_as_gauge" / "rig.toml"
TIME = np.arange(120) * 0.02
GAUGE = 1e5 * (0.4 + 2.4 * np.sin(1.3 * TIME) ** 2)  # Pa
ANGLE = 30.0 + 20.0 * np.sin(1.3 * TIME) ** 2
STANDARD = 101325.0


def log(tmp_path: Path, columns: dict[str, Array]) -> Path:
    return write_table(tmp_path / "run.csv", {"time [s]": TIME, **columns})


def of_unit(tmp_path: Path, heading: str, values: Array) -> tuple[Proposal, LogProposal]:
    """What is proposed for a log of a shoulder with this pressure."""
    columns = {"valve [V]": 5.0 + np.sin(TIME), heading: values, "angle [deg]": ANGLE}
    proposal = propose([log(tmp_path, columns)], SHOULDER)
    return proposal, proposal.logs[0]


def pressure(tmp_path: Path, proposal: Proposal) -> tuple[Array, Recording]:
    return pressure_of(case_of(tmp_path, proposal))


def pressure_of(case: Case) -> tuple[Array, Recording]:
    (only,) = case.recordings
    return only.channels["muscle_pressure"], only


PSI, WATER, MERCURY, AT = 6894.757293, 9806.65, 133.322387415, 98066.5
GAUGES = [
    ("p_muscle [bar(g)]", 1e5), ("p_muscle [barg]", 1e5), ("p_muscle [BAR]", 1e5),
    ("p_muscle [Torr]", STANDARD / 760), ("p_muscle [mmHg]", MERCURY),
    ("p_muscle [mm Hg]", MERCURY), ("p_muscle [inH2O]", 0.0254 * WATER),
    ("p_muscle [mH2O]", WATER), ("p_muscle [cmH2O]", WATER / 100),
    ("p_muscle [mWS]", WATER), ("p_muscle [at]", AT), ("p_muscle [atü]", AT),
    ("p_muscle [kgf/cm2]", AT), ("p_muscle [kg/cm²]", AT), ("p_muscle [psig]", PSI),
    ("p_muscle [PSI (g)]", PSI), ("p_muscle [kPa(g)]", 1e3), ("p_muscle [hPa]", 1e2),
    ("p_muscle [N/mm2]", 1e6), ("p_muscle [atm]", STANDARD),
    ("p_muscle {bar}", 1e5), ("p_muscle_(kPa)", 1e3), ("p_muscle <psi>", PSI),
    ("p_muscle / bar", 1e5), ("p_muscle in psi", PSI), ("p_muscle_kPa", 1e3),
    ("p_muscle mbar", 1e2), ("p_muscle/kPa", 1e3),
    ("P_MUSCLE_PSI", PSI), ("P_MUSCLE_KPA", 1e3), ("p_muscle/kPa(g)", 1e3),
]  # fmt: skip
ABSOLUTE = [
    ("p_muscle [bar(a)]", 1e5), ("p_muscle (bar(a))", 1e5), ("p_muscle [bara]", 1e5),
    ("p_muscle [psi(a)]", PSI), ("p_muscle [PSIA]", PSI), ("p_muscle [kPa abs]", 1e3),
    ("p_muscle [hPa(a)]", 1e2), ("p_muscle [mmHg abs.]", MERCURY), ("p_muscle_bar_abs", 1e5),
    ("p_muscle_abs [bar]", 1e5), ("p_muscle bar(a)", 1e5), ("p_muscle (bar, abs)", 1e5),
    ("p_muscle/kPa(a)", 1e3), ("P_MUSCLE_PSIA", PSI),
]  # fmt: skip


@pytest.mark.parametrize(("heading", "factor"), GAUGES)
def test_units_of_gauges_are_read(tmp_path: Path, heading: str, factor: float) -> None:
    proposal, item = of_unit(tmp_path, heading, GAUGE / factor)
    found, only = pressure(tmp_path, proposal)
    np.testing.assert_allclose(found, GAUGE, rtol=1e-5)
    assert only.notes == {}
    assert not any("no unit" in text or "absolute" in text for text in item.remarks)


@pytest.mark.parametrize(("heading", "factor"), ABSOLUTE)
def test_absolute_pressures_become_gauge_pressures(
    tmp_path: Path, heading: str, factor: float
) -> None:
    proposal, item = of_unit(tmp_path, heading, (GAUGE + STANDARD) / factor)
    found, only = pressure(tmp_path, proposal)
    np.testing.assert_allclose(found, GAUGE, atol=2.0)
    (told,) = [text for text in item.remarks if "absolute" in text]
    assert f"the ambient pressure of the rig file, {STANDARD / factor:.4g} " in told
    assert told.endswith("is subtracted")
    assert "was recorded as an absolute pressure" in only.notes["muscle_pressure"]


LEFT = rows_of(__file__, "left")


@pytest.mark.parametrize(("heading", "told"), LEFT)
def test_what_is_no_unit_of_pressure_is_left_and_told(
    tmp_path: Path, heading: str, told: str
) -> None:
    proposal, item = of_unit(tmp_path, heading, 4.0 + GAUGE / 1e5)
    assert {match.channel for match in item.matches} == {"valve_command", "joint_angle"}
    (text,) = [text for text in item.remarks if "p_muscle" in text or "Muscle_P" in text]
    assert told in text
    assert "assumed" not in text
    toml = proposal.case_toml(tmp_path)
    assert f"# {text}:\n# muscle_pressure = {{ column = " in toml  # a line to fill in
    assert ("from = [4.0, 20.0]" in toml) == ("mA" in told)


@pytest.mark.parametrize("unit", ["bar(a)", "(bar(a))", "[bar abs]"])
def test_a_row_of_units_below_the_headings(tmp_path: Path, unit: str) -> None:
    file = log(tmp_path, {"p_muscle": (GAUGE + STANDARD) / 1e5, "angle": ANGLE, "x": ANGLE})
    head, _, rest = file.read_text(encoding="utf-8").partition("\n")
    for odd in ("mm", "%", "zz"):  # one that is not known does not make them headings
        lines = [head.replace("time [s]", "time"), f"s;{unit};deg;{odd}", rest]
        file.write_text("\n".join(lines), encoding="utf-8")
        proposal = propose([file], SHOULDER)
        np.testing.assert_allclose(pressure(tmp_path, proposal)[0], GAUGE, atol=2.0)
        assert [each.unit for each in proposal.logs[0].listed][2] == "deg"


def test_a_calibration_in_the_heading_is_taken(tmp_path: Path) -> None:
    for heading in ("p_muscle [4..20 mA = 0..6 bar]", "p_muscle (0..6 bar = 4..20 mA)"):
        proposal, _ = of_unit(tmp_path, heading, 4.0 + 16.0 * GAUGE / 6e5)
        np.testing.assert_allclose(pressure(tmp_path, proposal)[0], GAUGE, rtol=1e-5)


def test_a_unit_is_assumed_only_where_there_is_none_and_stays_marked(tmp_path: Path) -> None:
    proposal, item = of_unit(tmp_path, "p_muscle", GAUGE / 1e5)
    (told,) = [text for text in item.remarks if "assumed" in text]
    assert told.startswith("p_muscle has no unit in the log: bar is assumed, its numbers are 0.4")
    assert 'assumed = "its numbers are 0.4' in proposal.case_toml(tmp_path)
    case = case_of(tmp_path, proposal)
    (again,) = noted_units(case)  # what a diagnosis puts among its warnings
    assert again.startswith("run: muscle_pressure is assumed to be in bar: its numbers are 0.4")


def test_pounds_and_inches_are_no_newtons_and_millimetres(tmp_path: Path) -> None:
    def proposed(heading: str, values: Array) -> LogProposal:
        columns = {"p [bar]": GAUGE / 1e5, heading: values}
        return propose([log(tmp_path, columns)], pamrs.rigs.named("bench")).logs[0]

    units = [
        {match.channel: match.unit for match in proposed(heading, values).matches}
        for heading, values in (("force_lbf", 50.0 + ANGLE), ("length_inch", 10.0 + ANGLE / 50.0))
    ]
    assert (units[0]["force"], units[1]["length"]) == ("lbf", "in")
    left = proposed("force_lb", 50.0 + ANGLE).left
    assert [(each.channel, each.unit) for each in left] == [("force", "lbf")]


def test_a_log_whose_only_unit_is_not_known_says_so(tmp_path: Path) -> None:
    proposal = propose([log(tmp_path, {"p_muscle [% FS]": GAUGE / 1e4})], SHOULDER)
    with pytest.raises(RecordingError, match="the unit '% FS' is not known"):
        proposal.case_toml(tmp_path)


def test_numbers_that_fit_no_unit_are_not_guessed(tmp_path: Path) -> None:
    _, item = of_unit(tmp_path, "p_muscle", GAUGE * 1e6)
    assert "muscle_pressure" not in {match.channel for match in item.matches}
    assert any("no likely pressure here" in text for text in item.remarks)


def test_another_pressure_of_the_log_says_the_unit(tmp_path: Path) -> None:
    columns = {"supply [psi]": 150.0 - TIME, "p_muscle": GAUGE / PSI, "angle [deg]": ANGLE}
    (item,) = propose([log(tmp_path, columns)], SHOULDER).logs
    assert {m.channel: m.unit for m in item.matches}["muscle_pressure"] == "psi"
    assert any("another pressure of the log is in psi" in text for text in item.remarks)


def test_the_recorded_ambient_pressure_is_subtracted(tmp_path: Path) -> None:
    columns = {
        "p_muscle [bar(a)]": (GAUGE + 9.3e4) / 1e5,
        "barometer [hPa]": 930.0 + 0.01 * np.sin(TIME),
        "angle [deg]": ANGLE,
    }
    proposal = propose([log(tmp_path, columns)], SHOULDER)
    told = [text for text in proposal.logs[0].remarks if "the recorded ambient pressure" in text]
    assert any("0.93 bar, is subtracted" in text for text in told)
    found, only = pressure(tmp_path, proposal)
    np.testing.assert_allclose(found, GAUGE, atol=2.0)
    said = "the recorded ambient pressure, where the rig file says 1.013 bar"
    assert said in only.notes["muscle_pressure"]
    (again,) = noted_units(load_case(tmp_path))
    assert again.startswith("run: muscle_pressure was recorded as an absolute pressure")


def test_the_ambient_pressure_of_the_rig_file_is_subtracted(tmp_path: Path) -> None:
    text = SHOULDER.to_toml_text().replace("value = 101325.0", "value = 93000.0")
    rig = pamrs.rig.parse_rig(text)
    columns = {"p_muscle [bar(a)]": (GAUGE + 9.3e4) / 1e5, "angle [deg]": ANGLE}
    case = case_of(tmp_path, propose([log(tmp_path, columns)], rig), rig)
    np.testing.assert_allclose(case.recordings[0].channels["muscle_pressure"], GAUGE, atol=2.0)


def test_headings_that_say_it_all_say_that_they_are_absolute(tmp_path: Path) -> None:
    """Of files that need no mapping."""
    file = log(tmp_path, {"muscle_pressure [bar(a)]": (GAUGE + STANDARD) / 1e5})
    only = load_recording(file, delimiter=";")
    np.testing.assert_allclose(only.channels["muscle_pressure"], GAUGE, atol=2.0)
    assert "the standard atmosphere, since nothing says another" in only.notes["muscle_pressure"]
    toml = 'schema = "pamrs.case/1"\n[[recording]]\nfile = "run.csv"\ndelimiter = ";"\n'
    (only,) = case_of(tmp_path, toml).recordings
    assert "the ambient pressure of the rig file" in only.notes["muscle_pressure"]
    file = log(tmp_path, {"muscle_pressure [Pa(a)]": GAUGE, "ambient_pressure [hPa]": 0.0 * TIME})
    with pytest.raises(
        RecordingError, match="column 'ambient_pressure': 0 hPa and.*200 to 1200 hPa"
    ):
        load_recording(file, delimiter=";")


def test_a_heading_writes_no_line_of_its_own_into_the_case(tmp_path: Path) -> None:
    name = '"p_muscle\nrig = ""evil.toml""\n\x7f [zz]"'
    file = log(tmp_path, {name: GAUGE / 1e5, "angle [deg]": ANGLE})
    for heading in (name, name.replace(" [zz]", "")):
        file.write_text(file.read_text(encoding="utf-8").replace(name, heading), encoding="utf-8")
        toml = propose([file], SHOULDER).case_toml(tmp_path)
        assert tomllib.loads(toml)["rig"] == "rig.toml"
        assert "\nrig = " not in toml.replace('\nrig = "rig.toml"', "")


# --------------------------------------------------------------------------- names

TANKED = {"valve_command", "supply_pressure", "muscle_pressure", "joint_angle"}
NAMES = rows_of(__file__, "names")


@pytest.mark.parametrize(("columns", "told"), NAMES)
def test_names_on_a_rig_with_a_valve(tmp_path: Path, columns: dict[str, str], told: str) -> None:
    angles = {name for name in columns if "°" in name or "deg" in name}
    values = {name: 20.0 + ANGLE if name in angles else 1.0 + GAUGE / 1e5 for name in columns}
    (item,) = propose([log(tmp_path, values)], SHOULDER).logs
    found = {each.name: each.channel for each in item.listed if each.name != "time"}
    wanted = {name.partition(" [")[0]: channel for name, channel in columns.items()}
    assert found == wanted
    assert told in "; ".join(item.remarks)


COMMANDS = [
    "cmd_supply", "p_set", "p_soll", "pressure command", "set pressure", "supply command",
    "setpoint", "Solldruck", "reference pressure", "desired pressure", "regulator cmd", "p_ref",
]  # fmt: skip
MEASURED = ["chamber pressure", "pressure", "Istdruck", "p_act", "p_meas", "Kammerdruck"]


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize("measured", MEASURED)
def test_a_regulator_without_a_valve(tmp_path: Path, command: str, measured: str) -> None:
    """The only pressure is that of the chamber, and a rig without an inlet has no line_pressure."""
    for unit in (" [bar]", ""):
        columns = {f"{command}{unit}": 0.1 + GAUGE / 1e6, f"{measured}{unit}": GAUGE / 1e6}
        (item,) = propose([log(tmp_path, columns)], load_rig(REGULATED)).logs
        found = {match.series.name: match.channel for match in item.matches}
        left = {each.series: each.channel for each in item.left}  # 0.28 may be bar or MPa
        assert found | left == {command: "supply_command", measured: "muscle_pressure"}
        assert bool(left) == (not unit)
        assert all("which may be bar or MPa; give it" in each.text for each in item.left)


@pytest.mark.parametrize(
    "file", sorted((FAULTS / "03_command_taken_as_gauge").glob("*.csv")), ids=lambda p: p.stem
)
def test_commands_taken_as_gauges(file: Path) -> None:
    (item,) = propose([file], load_rig(REGULATED)).logs
    found = {match.channel: match.series.name for match in item.matches}
    assert set(found) == {"supply_command", "muscle_pressure"}
    assert found["supply_command"] == item.listed[1].name


@pytest.mark.parametrize(
    "file", sorted((FAULTS / "02_units_not_known").glob("*.csv")), ids=lambda p: p.stem
)
def test_units_that_were_not_known(tmp_path: Path, file: Path) -> None:
    proposal = propose([file], SHOULDER)
    assert not any("muscle_pressure" in text for text in proposal.logs[0].remarks)
    (plain,) = case_of(tmp_path, propose([file.with_name("unit_barg.csv")], SHOULDER)).recordings
    found, only = pressure(tmp_path, proposal)
    np.testing.assert_allclose(found, plain.channels["muscle_pressure"], rtol=1e-5)
    assert only.notes == {}


def test_a_tank_that_empties_becomes_a_case(tmp_path: Path) -> None:
    """It has one pressure, whatever it is called: not of a supply, and of no line."""
    rig = pamrs.rigs.named("blow_down_tank")
    falling = 6e5 * np.exp(-TIME / 2.0)
    for heading, values in (
        ("p_tank [bar]", falling / 1e5),
        ("tank pressure bar(a)", (falling + STANDARD) / 1e5),
        ("pressure [kPa]", falling / 1e3),
        ("P1 (mmHg)", falling / MERCURY),
    ):
        proposal = propose([log(tmp_path, {heading: values})], rig)
        (match,) = proposal.logs[0].matches
        assert match.channel == "muscle_pressure"
        assert not any("likely" in text for text in proposal.logs[0].remarks)
        found, _ = pressure_of(case_of(tmp_path, proposal, rig))
        np.testing.assert_allclose(found, falling, atol=5.0)


# ----------------------------------------------------------------------------- ROS


def test_a_fluid_pressure_is_absolute_and_its_variance_no_channel(tmp_path: Path) -> None:
    file = tmp_path / "run.mcap"
    sent = []
    for at, gauge in zip(TIME, GAUGE, strict=True):
        stamp = {"sec": 1_700_000_000 + int(at), "nanosec": round(at % 1 * 1e9)}
        body = {"header": {"stamp": stamp}, "fluid_pressure": gauge + STANDARD, "variance": 4.0}
        nanos = 1_700_000_000 * 10**9 + round(at * 1e9)
        sent.append((nanos, nanos, body))
    write_json_messages(file, "/muscle", sent, "sensor_msgs/msg/FluidPressure")
    for rig in (SHOULDER, load_rig(REGULATED), None):
        proposal = propose([file], rig)
        (match,) = proposal.logs[0].matches
        assert (match.channel, match.series.name) == ("muscle_pressure", "/muscle/fluid_pressure")
    found, only = pressure(tmp_path, propose([file], SHOULDER))
    np.testing.assert_allclose(found, GAUGE, atol=0.1)
    assert "is subtracted" in only.notes["muscle_pressure"]


@pytest.mark.parametrize(
    ("heading", "names"),
    [
        ("Piezo_P_(mA)", ("Piezo_P", "Piezo_P_", "Piezo_P_(mA)", "Piezo_P (mA)")),
        ("p_{bar}", ("p", "p_", "p_{bar}", "p [bar]")),
        ("Druck <mbar>", ("Druck", "Druck <mbar>")),
        ("stroke (raw)", ("stroke", "stroke (raw)")),
    ],
)
def test_a_heading_with_its_unit_names_its_series(
    tmp_path: Path, heading: str, names: tuple[str, ...]
) -> None:
    """What earlier versions called it in a ``case.toml`` goes on, and what stands in the file."""
    found = read_log(log(tmp_path, {heading: GAUGE, "angle [deg]": ANGLE}))
    assert list(found.series) == ["time", names[0], "angle"]
    assert all(found.find(name) is found.series[names[0]] for name in names)


def test_a_number_in_brackets_is_no_unit_and_an_unknown_name_is_told(tmp_path: Path) -> None:
    twice = log(tmp_path, {"p [bar]": GAUGE, "p (bar)": ANGLE, "p_tank (mA)": GAUGE})
    found = read_log(twice)
    np.testing.assert_allclose(found.find("p (2)").values, ANGLE, rtol=1e-6)
    with pytest.raises(RecordingError, match=r"no channel 'p \(3\)'; did you mean 'p \(2\)'"):
        found.find("p (3)")
    with pytest.raises(RecordingError, match="no channel 'p_tnk_'; did you mean 'p_tank'"):
        found.find("p_tnk_")
