"""Force maps: parsing, units, every flag with its count, levels, descriptions, recordings of a
bench.
"""

import math
import re
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from pamrs import Muscle
from pamrs.errors import ParameterError, RecordingError
from pamrs.fit import ForceMap, load_force_map, load_measured_muscle
from tests.fit.cases import grid, mapped
from tests.recordings.written import write_workbook
from tests.tables import rows_of

CASE = Path(__file__).parents[2] / "cases" / "festo_dmsp"
TABLE = (
    CASE.parents[2]
    / "shared/recordings/festo_dmsp_martens_boblan/martens_boblan_2017_force_maps.csv"
)
needs_festo = pytest.mark.skipif(
    not TABLE.exists(), reason="the Festo maps are not beside the project"
)

REST = 0.3
LENGTHS = np.tile([0.30, 0.28, 0.26, 0.24], 3)
PRESSURES = np.repeat([1e5, 2e5, 4e5], 4)
FORCES = PRESSURES * 3e-3 * (LENGTHS / REST - 0.7)

DESCRIPTION = """
schema = "pamrs.force_map/1"
name = "bench 7"
file = "map.csv"
columns = { "L" = "length [mm]", "p" = "pressure [bar]", "F" = "force [N]", "spot" = "" }
where = { specimen = "B" }
clipped_force = { value = 0.0, unit = "N" }
[muscle]
rest_length = { value = 300.0, unit = "mm" }
rest_diameter = { value = 20.0, unit = "mm", tol = 0.5 }
braid_angle = { value = 64.0, unit = "deg", tol = 3.0 }
wall_thickness = { value = 2.0, unit = "mm", unknown = true }
"""


def made(length=LENGTHS, pressure=PRESSURES, force=FORCES, rest_length=REST, **options):
    return ForceMap.from_arrays(
        length=length, pressure=pressure, force=force, rest_length=rest_length, **options
    )


def changed(values, index, value):
    copy = np.array(values, dtype=float)
    copy[index] = value
    return copy


def write(tmp_path, text, name="map.csv"):
    path = tmp_path / name
    path.write_text(text, encoding="utf-8")
    return path


def loaded(tmp_path, text, **options):
    """The map of a table."""
    return load_force_map(write(tmp_path, text), **{"rest_length": REST, **options})


def refused(tmp_path, text, match, **options):
    with pytest.raises(RecordingError, match=match):
        loaded(tmp_path, text, **options)


MILLIMETRES = (1e3, 1e-5, 1.0)


def csv_text(heading="length [mm],pressure [bar],force [N]", scale=MILLIMETRES):
    rows = np.column_stack([LENGTHS, PRESSURES, FORCES]) * scale
    return "\n".join([heading, *(",".join(f"{v:.9g}" for v in row) for row in rows)]) + "\n"


# ------------------------------------------------------------------------ arrays


def test_clean_map_uses_every_row():
    data = made()
    assert data.used.all()
    assert data.issues == []
    assert data.reason == ("",) * 12
    np.testing.assert_array_equal(data.levels, [1e5, 2e5, 4e5])
    np.testing.assert_array_equal(data.level, np.repeat([0, 1, 2], 4))
    np.testing.assert_allclose(data.contraction, 1 - LENGTHS / REST)
    wanted = (PRESSURES, data.contraction, FORCES, data.level, np.zeros(12, dtype=np.int8))
    for found, column in zip(data.used_rows(), wanted, strict=True):
        np.testing.assert_array_equal(found, column)
        assert found.dtype == column.dtype


REPEATED = {
    name: changed(values, 3, values[2])
    for name, values in (("length", LENGTHS), ("pressure", PRESSURES), ("force", FORCES))
}


@pytest.mark.parametrize(
    ("columns", "reason", "words"),
    [
        ({"force": changed(FORCES, 3, np.nan)}, "not a number", "1 row of 12 has no number"),
        ({"length": changed(LENGTHS, 3, np.inf)}, "not a number", "no number"),
        ({"pressure": changed(PRESSURES, 3, -2e4)}, "negative pressure", "negative gauge pressure"),
        ({"pressure": changed(PRESSURES, 3, 9e8)}, "pressure out of range", "beyond 5 MPa"),
        ({"length": changed(LENGTHS, 3, 280.0)}, "length out of range", "no muscle of this rest"),
        ({"force": changed(FORCES, 3, 0.0), "clipped": 0.0}, "clipped", "1 row of 12 is clipped"),
        ({"faulty": np.arange(12) == 3}, "sensor fault", "masked by the check"),
        (REPEATED, "duplicate", "repeats an earlier row"),
    ],
)
def test_each_bad_row_is_flagged_with_its_reason(columns, reason, words):
    data = made(**columns)
    assert np.flatnonzero(~data.used).tolist() == [3]
    assert data.reason[3] == reason
    assert data.level[3] == -1
    assert len(data) == 12
    assert len(data.issues) == 1
    assert words in data.issues[0]
    assert data.issues[0].endswith("not used (index 3)")
    assert all(np.isfinite(column).all() for column in data.used_rows())


def test_repeats_of_a_resting_bench_are_no_duplicates():
    assert made(**REPEATED, check_duplicates=False).used.all()


def test_exact_zeros_that_nobody_explains_are_used_and_reported():
    data = made(force=changed(FORCES, [1, 2, 3], 0.0))
    assert data.used.all()
    assert "3 rows have a force of exactly 0 N" in data.issues[0]


@pytest.mark.parametrize(
    ("columns", "unit"),
    [
        ({"length": LENGTHS * 1e3}, "in mm, read as m"),
        ({"length": LENGTHS * 1e2}, "in cm, read as m"),
        ({"length": LENGTHS / 0.0254}, "in in, read as m"),
        ({"length": LENGTHS / 1e3}, "in m, read as mm"),
        ({"pressure": PRESSURES / 1e3}, "in kPa, read as Pa"),
        ({"pressure": PRESSURES / 1e5}, "in bar, read as Pa"),
        ({"pressure": PRESSURES / 6894.757}, "in psi, read as Pa"),
        ({"pressure": PRESSURES / 1e6}, "in MPa, read as Pa"),
        ({"pressure": PRESSURES * 1e3}, "in Pa, read as kPa"),
        ({"pressure": PRESSURES * 1e5}, "in Pa, read as bar"),
        ({"pressure": PRESSURES * 20.0}, "in Pa, read as mbar"),  # half the rows are possible
    ],
)
def test_wrong_units_are_an_error_that_names_the_likely_unit(columns, unit):
    with pytest.raises(RecordingError, match=f"wrong unit.* {unit}$"):
        made(**columns)


@pytest.mark.parametrize(
    ("columns", "told"),
    [
        ({"pressure": PRESSURES * 1e5}, r"pressures around [\d.e+]+ psi, beyond 725\.189 psi"),
        ({"pressure": PRESSURES / 1e6}, r"pressure up to [\d.e-]+ psi only"),
        ({"length": LENGTHS * 1e3}, r"lengths up to [\d.e+]+ in do not .* [\d.]+ in: wrong"),
    ],
)
def test_wrong_units_are_told_in_those_of_the_file(columns, told):
    with pytest.raises(RecordingError, match=told):
        made(**columns, units={"pressure": "psi", "length": "in", "force": "lbf"})


@pytest.mark.parametrize(
    ("options", "match"),
    [
        ({"rest_length": 300.0}, "rest_length = 300 m is not allowed.*in mm"),
        ({"rest_length": np.nan}, "rest_length"),
        ({"level_tolerance": 0.0}, "level_tolerance = 0.0"),
    ],
)
def test_impossible_arguments(options, match):
    with pytest.raises(ParameterError, match=match):
        made(**options)


def test_columns_of_different_lengths():
    with pytest.raises(RecordingError, match=r"\[11, 12, 12\] rows"):
        made(length=LENGTHS[1:])
    with pytest.raises(RecordingError, match="direction has 3 rows"):
        made(direction=[1, -1, 0])


def test_too_few_rows_says_what_became_of_the_others():
    why = "11 rows of 12 are clipped.*indices 0, 1, 2, 3, 4 and 6 more"
    with pytest.raises(RecordingError, match=f"1 usable row, two at least.*{why}"):
        made(force=np.append(np.zeros(11), 5.0), clipped=0.0)


def test_direction_is_signed_and_unknown_is_zero():
    data = made(direction=np.tile([-1.0, 0.4, np.nan, 0.0], 3))
    np.testing.assert_array_equal(data.direction, np.tile([-1, 1, 0, 0], 3))


# ------------------------------------------------------------------------ levels


def test_scatter_around_a_level_is_one_level():
    scatter = np.tile([-1e3, 1e3, -500.0, 500.0], 3)
    data = made(pressure=PRESSURES + scatter)
    np.testing.assert_allclose(data.levels, [1e5, 2e5, 4e5])
    assert len(made(pressure=PRESSURES + scatter, level_tolerance=100.0).levels) == 12


def test_ramping_pressure_is_cut_and_reported():
    data = made(pressure=np.linspace(1e5, 1.2e5, 12), level_tolerance=3e3)
    assert 3 <= len(data.levels) <= 7
    assert np.all(np.diff(data.levels) > 0)
    assert "have no gaps" in data.issues[0]


def test_select_leaves_out_the_other_levels():
    part = made().select(levels=[2, 0])
    np.testing.assert_array_equal(part.levels, [1e5, 4e5])
    np.testing.assert_array_equal(part.level, [0] * 4 + [-1] * 4 + [1] * 4)
    assert part.reason[4:8] == ("left out",) * 4
    assert "4 rows of 12" in part.issues[0]
    np.testing.assert_array_equal(made().select(levels=[-1]).levels, [4e5])
    with pytest.raises(ParameterError, match="levels"):
        made().select(levels=[3])
    with pytest.raises(ParameterError, match="one at least"):
        made().select(levels=[])


def test_levels_by_pressure():
    assert made().level_indices([4.01e5, 1e5, 1e5]) == [0, 2]
    message = "no measurement at 300 kPa; there are levels at 100, 200, 400 kPa"
    with pytest.raises(ParameterError, match=message):
        made().level_indices([3e5])


# ---------------------------------------------------------------- against a muscle


def fake_muscle(limits=(-0.1, 0.15), area=1e-3, rest_length=REST):
    return SimpleNamespace(
        model="robinson",
        parameters={"rest_length": rest_length},
        contraction_limits=limits,
        gas_area=lambda e: np.full_like(e, area),
        radius=np.ones_like,
    )


def test_lengths_beyond_the_braid_are_flagged():
    data = made().checked_against(fake_muscle())
    assert data.reason == ("", "", "", "beyond the braid") * 3
    np.testing.assert_array_equal(data.levels, [1e5, 2e5, 4e5])
    assert "3 rows of 12 have a length outside the braid's limits" in data.issues[0]


def test_a_level_without_a_row_left_vanishes():
    data = made(length=changed(LENGTHS, [0, 1, 2, 3], 0.24)).checked_against(fake_muscle())
    np.testing.assert_array_equal(data.levels, [2e5, 4e5])
    np.testing.assert_array_equal(np.unique(data.level), [-1, 0, 1])


@pytest.mark.parametrize(
    ("columns", "units", "words"),
    [
        ({"force": FORCES * 1e3}, {"force": "N"}, "forces are too large (in mN, read as N?)"),
        ({"force": FORCES * 9.81}, {"force": "kgf"}, "forces are too large (in N, read as kgf?)"),
        ({"force": FORCES / 1e3}, {}, "forces are too small (in kN, read as N or in N, read as mN"),
        ({"pressure": PRESSURES / 14.5}, {"pressure": "psi"}, "small (in bar, read as psi?)"),
        ({"force": FORCES * 30.0}, {}, "too small, or the muscle's sizes are too small"),
    ],
)
def test_forces_that_gas_cannot_make(columns, units, words):
    with pytest.raises(RecordingError) as error:
        made(**columns, units=units).checked_against(fake_muscle(area=9e-4))
    assert words in str(error.value)
    assert "or the pressures are too" in str(error.value)


def test_another_rest_length():
    with pytest.raises(ParameterError, match="the muscle has 0.25 m, the force map 0.3 m"):
        made().checked_against(fake_muscle(rest_length=0.25))


def test_lengths_at_which_the_geometry_has_no_solution_are_flagged():
    sizes = {"rest_length": 0.12, "rest_diameter": 0.05, "wall_thickness": 0.002}
    wide = Muscle(**sizes, braid_angle=math.radians(75.0))
    length = np.array([0.119, 0.115, 0.11, 0.08])
    pull = np.array([900.0, 700.0, 500.0, 100.0])
    map_ = made(length, np.full(4, 3e5), pull, 0.12).checked_against(wide)
    assert "no solution" in map_.reason
    assert any("no solution" in issue for issue in map_.issues)
    assert map_.used.any()


def test_a_stray_force_is_flagged_alone():
    muscle = Muscle(rest_length=0.3, rest_diameter=0.023, braid_angle=1.117, wall_thickness=0.0015)
    p, e = grid([2e5, 4e5, 6e5], np.linspace(0.0, 0.2, 6))
    force = changed(muscle.force(p, e), 7, 1e30)
    map_ = mapped(p, e, force, rest=0.3).checked_against(muscle)
    assert {row: why for row, why in enumerate(map_.reason) if why} == {7: "force out of range"}


# ------------------------------------------------------------------------ tables


@pytest.mark.parametrize(
    ("heading", "scale"),
    [
        ("length [m],pressure [Pa],force [N]", (1, 1, 1)),
        ("length_m,pressure_kPa,force_N", (1, 1e-3, 1)),
        ("muscle_length (mm),Gauge Pressure [bar],Tension_kN", (1e3, 1e-5, 1e-3)),
    ],
)
def test_headings_carry_the_unit(tmp_path, heading, scale):
    data = loaded(tmp_path, csv_text(heading, scale))
    np.testing.assert_allclose(data.length, LENGTHS, rtol=1e-6)
    np.testing.assert_allclose(data.pressure, PRESSURES, rtol=1e-6)
    np.testing.assert_allclose(data.force, FORCES, rtol=1e-6)
    assert data.name == "map"


def test_contraction_in_place_of_length(tmp_path):
    text = "contraction [%],pressure [bar],force [N]\n0,1,300\n10,1,200\n20,2,100\n"
    np.testing.assert_allclose(loaded(tmp_path, text).contraction, [0.0, 0.1, 0.2])
    refused(tmp_path, text.replace("[%]", "[1]"), "contraction around 10.*in %")


def test_direction_in_words_or_numbers(tmp_path):
    text = (
        "length_m,pressure_bar,force_N,direction\n.3,1,90,contracting\n.28,1,60,lengthening\n"
        ".26,1,30,\n.25,1,20,-1\n"
    )
    np.testing.assert_array_equal(loaded(tmp_path, text).direction, [-1, 1, 0, -1])
    wrong = text.replace("contracting", "sideways")
    refused(tmp_path, wrong, "row 2: 'sideways' is not allowed")


@pytest.mark.parametrize(
    ("heading", "match"),
    [
        ("length,pressure [Pa],force [N]", "'length' has no unit: write 'length \\[m\\]'"),
        ("length [m],pressure [V],force [N]", "'pressure \\[V\\]'.*wrong dimension"),
        ("length [m],pressure [Pa],load cell [N]", "no column for force; there are: length"),
        ("width [m],pressure [Pa],force [N]", "no column for length"),
        ("length [m],length_mm,force [N]", "length is there twice"),
        ("L,p,F", r'columns = \{ "\.\.\." = "length \[m\]", .* = "force \[N\]" \}'),
    ],
)
def test_columns_that_cannot_be_understood(tmp_path, heading, match):
    refused(tmp_path, csv_text(heading), match)


def test_a_bare_table_needs_the_rest_length(tmp_path):
    refused(tmp_path, csv_text(), "rest_length is missing", rest_length=None)


SEVERAL = (
    "specimen,spot,length_m,pressure_bar,force_N\nA,1,.3,1,90\nB,1,.3,1,95\nB,2,.28,1,0\n"
    "B,3,.26,2,130\nB,4,.27,2,oops\n"
)


def test_rows_of_one_specimen(tmp_path):
    text = SEVERAL.replace("oops", "nan")
    data = loaded(tmp_path, text, where={"specimen": "B"}, clipped=0.0)
    np.testing.assert_array_equal(data.force[data.used], [95.0, 130.0])
    assert len(data) == 4
    assert sorted(set(data.reason)) == ["", "clipped", "not a number"]
    for words in ("1 row of the file is not specimen = B and belongs", "columns not used: spot"):
        assert any(words in issue for issue in data.issues)


@pytest.mark.parametrize(
    ("where", "match"),
    [
        (None, r"column 'specimen' has 2 values \(A, B\): choose one"),
        ({"specimen": "B"}, "row 6: 'oops' is not a number"),
        ({"specimen": "C"}, "no row has specimen = 'C'; there are: A, B"),
        ({"person": "B"}, "where names the column 'person'"),
    ],
)
def test_specimens_that_are_not_told_apart(tmp_path, where, match):
    refused(tmp_path, SEVERAL, match, where=where)


# ------------------------------------------------------- tables as newcomers bring them


@pytest.mark.parametrize("name", ["map.csv", "map.txt", "map.tsv"])
@pytest.mark.parametrize(
    ("delimiter", "decimal"),
    rows_of(__file__, "delimiter_and_decimal_mark_are_found"),
)
def test_delimiter_and_decimal_mark_are_found(tmp_path, name, delimiter, decimal):
    text = csv_text("length_mm,pressure_bar,force_N")
    text = text.replace(",", delimiter).replace(".", decimal)
    data = load_force_map(write(tmp_path, text, name), rest_length=REST)
    np.testing.assert_allclose(data.length, LENGTHS)
    np.testing.assert_allclose(data.force, FORCES, rtol=1e-6)


def test_quoted_cells_may_have_decimal_commas(tmp_path):
    text = (
        '"length [mm]","pressure [bar]","force [N]"\n"300,5","1,0","12,3"\n"290,5","1,0","8,5"\n'
        '"280,0","1,0","4,25"\n'
    )
    np.testing.assert_allclose(loaded(tmp_path, text).force, [12.3, 8.5, 4.25])


def test_descriptions_find_delimiter_and_decimal_mark(described):
    table = described.with_name("map.csv")
    text = table.read_text(encoding="utf-8").replace(",", ";").replace("95", "95,5")
    table.write_text(text, encoding="utf-8")
    assert load_measured_muscle(described).data.force[0] == 95.5


@pytest.mark.parametrize(
    ("text", "match"),
    rows_of(__file__, "tables_that_cannot_be_told_apart_ask_for_delimiter_and_decimal"),
)
def test_tables_that_cannot_be_told_apart_ask_for_delimiter_and_decimal(tmp_path, text, match):
    refused(tmp_path, text, match)


def test_a_given_decimal_mark_settles_thousands(tmp_path):
    text = "length_mm;pressure_bar;force_N\n300;1,000;12\n290;1,500;8\n"
    np.testing.assert_allclose(loaded(tmp_path, text, decimal=",").pressure, [1e5, 1.5e5])


@pytest.mark.parametrize(("option", "value"), [("delimiter", "tab"), ("decimal", ";")])
def test_impossible_marks(tmp_path, option, value):
    message = f"{option} = '{value}' is not allowed"
    refused(tmp_path, csv_text(), message, **{option: value})


@pytest.mark.parametrize(
    "heading", ["L [mm],p [bar],F [N]", "L\u00e4nge [mm],Druck [bar],Kraft [N]"]
)
def test_unknown_headings_say_how_to_map_them(tmp_path, heading):
    known = ("length [mm]", "pressure [bar]", "force [N]")
    columns = dict(zip(heading.split(","), known, strict=True))
    proposed = ", ".join(f'"{own}" = "{name}"' for own, name in columns.items())
    listed = ", ".join(columns)
    message = f"there are: {listed}. Rename the headings, or map them with columns = {{ {proposed} "
    refused(tmp_path, csv_text(heading), re.escape(message))
    np.testing.assert_allclose(loaded(tmp_path, csv_text(heading), columns=columns).force, FORCES)


@pytest.mark.parametrize(
    ("heading", "rest", "words"),
    rows_of(__file__, "wrong_lengths_name_the_rest_length_too"),
)
def test_wrong_lengths_name_the_rest_length_too(tmp_path, heading, rest, words):
    text = csv_text(f"{heading},pressure [bar],force [N]")
    refused(tmp_path, text, f"{re.escape(words)}$", rest_length=rest)


def test_where_on_a_measured_column_keeps_it(tmp_path):
    text = csv_text().replace(",1,", ",1.000,")
    for value in ("1.000", "1", 1.0):
        data = loaded(tmp_path, text, where={"pressure [bar]": value})
        np.testing.assert_allclose(data.pressure, np.full(4, 1e5))
        np.testing.assert_allclose(data.force, FORCES[:4], rtol=1e-6)
    message = r"where names the column 'pressure', but .*; did you mean 'pressure \[bar\]'\?"
    refused(tmp_path, text, message, where={"pressure": "1"})
    message = r"columns names 'Force', but .*; did you mean 'force \[N\]'\?"
    refused(tmp_path, text, message, columns={"Force": "force [N]"})
    commas = csv_text(scale=(1e3, 1.5e-5, 1.0)).replace(",", ";").replace(".", ",")
    for value in ("1.5", "1,50"):
        assert len(loaded(tmp_path, commas, where={"pressure [bar]": value})) == 4


def test_rows_not_used_are_named_as_in_the_file(tmp_path):
    lines = csv_text().splitlines()
    lines.insert(6, "")
    for row, value in {3: "nan", **dict.fromkeys(range(7, 13), "0")}.items():
        lines[row] = f"{lines[row].rpartition(',')[0]},{value}"
    text = "\n".join(lines)
    assert loaded(tmp_path, text, clipped=0.0).issues == [
        "1 row of 12 has no number for length, pressure or force: not used (row 4)",
        "6 rows of 12 are clipped: the true force lies beyond the end of the scale: not used "
        "(rows 8, 9, 10, 11, 12 and 1 more)",
    ]
    message = r"3 rows of 4 are clipped.*\(rows 11, 12, 13\)"
    refused(tmp_path, text, message, where={"pressure [bar]": 4}, clipped=0.0)


@pytest.mark.parametrize(
    ("contractions", "found"),
    [((0.0, 0.1, 0.21), True), ((0.0, 10.0, 21.0), False), ((5.0, 5.1, 5.2), False)],
)
def test_fractions_under_a_heading_in_percent_are_asked_about(tmp_path, contractions, found):
    rows = [f"{e},{p},{100 * p * (30.0 - e)}" for e in contractions for p in (1, 2, 3)]
    data = loaded(tmp_path, "\n".join(["contraction [%],pressure [bar],force [N]", *rows]))
    note = "contractions span only 0.21 %: are they fractions? write contraction [1]"
    assert (note in data.issues) == found


def lifting(activation, ambient=0.0, stiffness=2e3, noise=0.0, lengths=(0.30, 0.29, 0.27, 0.25)):
    """Gauge data of a muscle whose bladder lifts at ``activation``, with ``ambient`` added to the
    pressures.
    """
    pressure, length = grid(np.arange(1e5, 6.1e5, 1e5), lengths)
    force = (pressure - activation) * 3e-3 * (length / REST - 0.7) - stiffness * (1 - length / REST)
    scatter = noise * np.random.default_rng(3).normal(size=force.size)
    return length, pressure + ambient, force + scatter


@pytest.mark.parametrize("noise", [0.0, 2.0])
def test_absolute_pressures_are_asked_about(noise):
    (issue,) = made(*lifting(0.0, 101.3e3, noise=noise)).issues
    words = (
        r"forces vanish near (9\.\d+e\+04|1\.0\d*e\+05) Pa .*are the pressures absolute\? gauge "
        "pressures"
    )
    assert re.match(f"{words} are needed", issue)


NO_QUESTION = {
    "gauge": lifting(0.0),
    "activation": lifting(7e4),
    "noise": lifting(7e4, noise=2.0),
    "stiff": lifting(7e4, stiffness=5e3, lengths=(0.299, 0.28, 0.26)),
    "no long length": lifting(0.0, stiffness=1e4, lengths=(0.28, 0.26)),
    "three levels": [column[:12] for column in lifting(0.0, 101.3e3)],
    "pressure below ambient": tuple(map(np.append, lifting(1e5), (0.30, 5e4, 1.0))),
}


@pytest.mark.parametrize("columns", NO_QUESTION.values(), ids=NO_QUESTION)
def test_gauge_pressures_are_not_asked_about(columns):
    assert not any("absolute" in issue for issue in made(*columns).issues)


# -------------------------------------------------------------------- recordings


@pytest.mark.parametrize("noise", [0.0, 300.0])
def test_recording_of_a_bench_knows_its_direction(tmp_path, noise):
    generator = np.random.default_rng(1)
    time = np.arange(0, 60, 0.02)
    held = np.repeat([1e5, 2e5, 3e5], 1000) + noise * generator.normal(size=time.size)
    length = 0.27 - 0.03 * np.cos(2 * np.pi * time / 5) + 2e-5 * generator.normal(size=time.size)
    way = np.sign(np.sin(2 * np.pi * time / 5))
    force = held * 3e-3 * (length / REST - 0.7) * (1 + 0.05 * way)
    force += generator.normal(size=time.size)
    table = np.column_stack([time, length * 1e3, held / 1e5, force])
    rows = [",".join(f"{v:.7g}" for v in row) for row in table]
    text = "\n".join(["time [s],length [mm],pressure [bar],force [N]", *rows])
    data = loaded(tmp_path, text)
    assert data.used.mean() > 0.99
    np.testing.assert_allclose(data.levels, [1e5, 2e5, 3e5], rtol=0.01)
    assert np.mean(data.direction == way) > 0.9
    assert np.mean(data.direction == -way) < 0.005
    german = text.replace(",", ";").replace(".", ",")
    np.testing.assert_array_equal(loaded(tmp_path, german).force, data.force)


# ------------------------------------------------------------------ descriptions


@pytest.fixture
def described(tmp_path):
    rows = ["A,1,300,1,90", "B,1,300,1,95", "B,2,280,1,0", "B,3,260,2,130", "B,4,270,2,80"]
    write(tmp_path, "\n".join(["specimen,spot,L,p,F", *rows]))
    return write(tmp_path, DESCRIPTION, "map.toml")


def test_description_gives_map_muscle_and_tolerances(described):
    measured = load_measured_muscle(described)
    assert measured.data.name == "bench 7"
    np.testing.assert_array_equal(measured.data.force[measured.data.used], [95.0, 130.0, 80.0])
    assert measured.data.rest_length == pytest.approx(0.3)
    assert measured.muscle.parameters["rest_diameter"] == pytest.approx(0.02)
    assert measured.tolerance == {
        "rest_diameter": pytest.approx(5e-4),
        "braid_angle": pytest.approx(np.radians(3.0)),
        "wall_thickness": np.inf,
    }
    np.testing.assert_array_equal(load_force_map(described).force, measured.data.force)


@pytest.mark.parametrize(
    ("old", "new", "match"),
    rows_of(__file__, "description_problems_are_named"),
)
def test_description_problems_are_named(described, old, new, match):
    text = described.read_text(encoding="utf-8")
    assert old in text
    described.write_text(text.replace(old, new), encoding="utf-8")
    with pytest.raises(RecordingError, match=match):
        load_measured_muscle(described)


@pytest.mark.parametrize("how", ["named", "a link"])
def test_a_table_outside_the_folder_of_its_description_is_not_opened(described, how):
    table = described.with_name("map.csv")
    folder = described.parent / "elsewhere"
    folder.mkdir()
    moved = described.rename(folder / "map.toml")
    text = moved.read_text(encoding="utf-8")
    assert '"map.csv"' in text
    if how == "named":
        moved.write_text(text.replace('"map.csv"', '"../map.csv"'), encoding="utf-8")
    else:
        (folder / "map.csv").symlink_to(table)
    for load in (load_measured_muscle, load_force_map):
        with pytest.raises(RecordingError, match=r"map.csv'?: lies outside .* --allow-outside"):
            load(moved)
    data = load_force_map(moved, allow_outside=True)
    np.testing.assert_array_equal(data.force[data.used], [95.0, 130.0, 80.0])


@needs_festo
@pytest.mark.parametrize(
    ("name", "used", "clipped", "levels"),
    [("DMSP-20-300", 60, 66, 20), ("DMSP-10-250", 40, 45, 16)],
)
def test_festo_maps_leave_the_clipped_zeros_out(name, used, clipped, levels):
    measured = load_measured_muscle(CASE / f"{name}.toml", allow_outside=True)
    assert measured.data.used.sum() == used
    assert measured.data.reason.count("clipped") == clipped
    assert len(measured.data.levels) == levels
    assert (measured.data.force[measured.data.used] > 0).all()
    sizes = {"rest_length", "rest_diameter", "braid_angle", "wall_thickness"}
    assert set(measured.tolerance) == {*sizes, "modulus_slope", "modulus_offset"}
    assert measured.tolerance["modulus_offset"] == 1e7
    assert not any("absolute" in issue for issue in measured.data.issues)
    assert measured.noise == pytest.approx(0.005 * measured.data.force.max(), rel=0.02)


def test_a_description_takes_no_arguments_beside_it(described):
    message = r"rest_length cannot be given: .* describes its table itself"
    with pytest.raises(ParameterError, match=message):
        load_force_map(described, rest_length=0.3)


# ------------------------------------------------- without headings, with scales, workbooks

PULL = [(300.0 - 2.0 * k, 10.0 + 3.0 * (k % 7), 1.0 + k % 3) for k in range(24)]  # mm, N, bar


def same_map(found: ForceMap) -> None:
    length, force, gauge = np.array(PULL).T
    np.testing.assert_allclose(found.length, 1e-3 * length)
    np.testing.assert_allclose(found.force, force, atol=1e-9)
    np.testing.assert_allclose(found.pressure, 1e5 * gauge)


def test_a_table_without_headings_takes_a_list_of_them(tmp_path):
    file = tmp_path / "map.csv"
    file.write_text("\n".join(f"{a:.1f};{b:.2f};x;{c:.0f}".replace(".", ",") for a, b, c in PULL))
    names = ["length [mm]", "force [N]", "", "pressure [bar]"]
    same_map(load_force_map(file, rest_length=0.3, columns=names))
    with pytest.raises(RecordingError, match=r"the first row has numbers.*columns = \["):
        load_force_map(file, rest_length=0.3)
    with pytest.raises(RecordingError, match="columns lists 3 headings, but there are 4 columns"):
        load_force_map(file, rest_length=0.3, columns=names[:3])


def test_a_load_cell_in_volts_has_a_scale(tmp_path):
    file = tmp_path / "map.csv"
    rows = [f"{a:.1f},{0.5 + b / 50.0:.5f},{4.0 + 16.0 * c / 6.0:.9f}" for a, b, c in PULL]
    file.write_text("\n".join(["L [mm],U1,I1", *rows]))
    cell = {"name": "force [N]", "scale": 50.0, "offset": -25.0}
    gauge = {"name": "pressure [bar]", "from": [4, 20], "to": [0, 6]}
    columns = {"L [mm]": "length [mm]", "U1": cell, "I1": gauge}
    found = load_force_map(file, rest_length=0.3, columns=columns)
    same_map(found)
    (tmp_path / "map.toml").write_text(
        'schema = "pamrs.force_map/1"\nfile = "map.csv"\n[columns]\n"L [mm]" = "length [mm]"\n'
        'U1 = { name = "force [N]", scale = 50.0, offset = -25.0 }\n'
        'I1 = { name = "pressure [bar]", from = [4, 20], to = [0, 6] }\n[muscle]'
        + DESCRIPTION.partition("[muscle]")[2]
    )
    np.testing.assert_allclose(load_force_map(tmp_path / "map.toml").force, found.force)
    for wrong, words in (({"scale": 2}, "name"), ({"name": "force [N]", "scale": 0}, "scale = 0")):
        with pytest.raises(RecordingError, match=words):
            load_force_map(file, rest_length=0.3, columns=columns | {"U1": wrong})


def test_a_workbook_is_a_force_map(tmp_path):
    rows = [[*row, "contracting" if k % 2 else "lengthening"] for k, row in enumerate(PULL)]
    head = ["length [mm]", "force [N]", "pressure [bar]", "direction"]
    write_workbook(tmp_path / "map.xlsx", [head, *rows])
    found = load_force_map(tmp_path / "map.xlsx", rest_length=0.3)
    same_map(found)
    assert set(found.direction.tolist()) == {-1, 1}
