"""The dissertation beside pamrs: how a statement is judged, the experiments of chapter 3, and the
command.
"""

import csv
import io
import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pamrs import rigs
from pamrs.errors import ParameterError
from reproduction import CHAPTERS, chapter3, chapter5, elbow
from reproduction.comparison import judge, verdicts
from reproduction.page import Picture, Section, page
from reproduction.statement_tables import markdown, to_csv
from reproduction.statements import symbols
from reproduction.tests.pages import by_fact, facts, page_of
from tests.tables import rows_of

AXIAL, OFFSET, TENDON = 1.56 * 0.0254, 0.42 * 0.0254, 3.04 * 0.0254
#: Statements of the chapter's experiments with which ours do not agree; one that changes sides must
#: be noticed.
DIFFER = {
    "torque where the range begins, at rest length",
    "last rotation with 200 ft lbf",
    "last rotation with 200 ft lbf, as printed, with the muscle of (3.21)",
    "last rotation with 200 ft lbf, printed torque, angle from the vertical",
    "mean rate over 90 deg, the same valve",
    "rate at the top of the pressure over the largest",
    "largest torque",
    "rotation at the largest torque",
    "least over largest torque from 0 to 78 deg of rotation, 150 psi",
    "largest over resting diameter of the chapter's muscles, the larger",
}


@pytest.fixture(scope="module")
def rows():
    return chapter3.facts(search=False)


# ------------------------------------------------------------------------- verdicts


@pytest.mark.parametrize(
    ("published", "ours", "options", "verdict"),
    rows_of(__file__, "verdict"),
)
def test_verdict(published, ours, options, verdict):
    row = judge("group", "fact", "3.2", published, ours, "deg", **options)
    assert row.verdict == verdict
    assert row.published == published or math.isnan(published)
    if math.isfinite(ours):
        assert row.deviation == ours - published
    assert "nan" not in markdown([row]) + to_csv([row])


def test_a_fact_needs_a_source_and_a_criterion():
    with pytest.raises(ParameterError, match="where is empty: the fact 'fact'"):
        judge("group", "fact", " ", 1.0, 1.0)
    words = "relation = 'near' is not allowed: one of 'equals', 'above', 'below'"
    with pytest.raises(ParameterError, match=words):
        judge("group", "fact", "3.2", 1.0, 1.0, relation="near")
    with pytest.raises(ParameterError, match="basis = 'luck' is not allowed"):
        judge("group", "fact", "3.2", 1.0, 1.0, basis="luck")
    for tolerance in (-1.0, math.nan):
        with pytest.raises(ParameterError, match=f"tolerance = {tolerance}"):
            judge("group", "fact", "3.2", 1.0, 1.0, tolerance=tolerance)
    near = judge("group", "fact", "3.2", 10.0, 9.0, "in", tolerance=0.5)
    assert near.criterion == "within 0.5 in"
    assert judge("group", "fact", "3.2", 10.0, 9.0, relation="below").criterion == "below"


def test_text_markdown_and_csv_have_every_fact():
    made = [
        judge("first", "a | b", "Table 3.2", 100.0, 90.0, "lbf", tolerance=1.0, reason="because"),
        judge("second", "c", "3.4", 1.0, 2.0, relation="above", basis="construction"),
        judge("second", "d", "3.5", 0.5, math.nan, "in", cannot_tell="no section"),
    ]
    headings, below = {"first": "The first"}, {"second": "end"}
    page_text = markdown(made, headings=headings, below=below)
    assert all(row.where in page_text for row in made)
    assert page_text.startswith("### The first\n")
    assert page_text.index("because") < page_text.index("second")
    assert "a \\| b" in page_text
    assert "**differs** [1]" in page_text
    assert "- [1] a | b: because" in page_text
    assert "- [2] d: no section" in page_text
    assert page_text.rstrip().endswith("end")
    assert "-10.0 %" in page_text
    parsed = list(csv.DictReader(io.StringIO(to_csv(made))))
    assert [row["fact"] for row in parsed] == ["a | b", "c", "d"]
    assert parsed[0]["relative"] == "-0.1"
    assert parsed[1]["basis"] == "construction"
    assert (parsed[2]["ours"], parsed[2]["verdict"]) == ("", "cannot tell")
    assert [row["kind"] for row in parsed] == ["differs", "agrees by construction", "cannot tell"]
    assert verdicts(made) == (
        "0 agree on their own, 1 by construction, 0 in sign only, 1 differ, 1 cannot tell"
    )
    trial = judge("g", "d", "1", 1.0, 2.0, apart="a trial")
    open_ = judge("g", "e", "1", 1.0, 2.0, apart="a trial", cannot_tell="counted")
    assert verdicts([*made, trial]).endswith("1 cannot tell; 1 line stands apart")
    assert verdicts([*made, trial, open_]).endswith("1 cannot tell; 2 lines stand apart")
    page_ = markdown([trial, open_])
    assert "| (a trial: differs) |" in page_
    assert "| (a trial) [1] |" in page_
    assert "**" not in page_


def test_page_shows_command_numbers_and_pictures_from_where_it_stands():
    row = judge("group", "fact", "3.2", 1.0, 1.0)
    pictures = [Picture("one", "group", "What it shows", b"")]
    chosen, used = [("a.b", "1 m", "the reason")], [("nu", "error squared", "rad2 s")]
    section = Section("Title", [row], {}, ["In short."], chosen, pictures, used)
    text = page([section], "make x", "pictures/here")
    assert text.splitlines()[2].startswith("Made by `make x`")
    assert "![What it shows](pictures/here/one.png)" in text
    assert "| `a.b` | 1 m | the reason |" in text
    assert "- In short." in text
    assert "| nu | error squared | rad2 s |" in text
    assert "Symbols" not in page([replace(section, symbols=[])], "make x")


@pytest.mark.parametrize("name", CHAPTERS)
def test_page_in_the_documentation_explains_the_symbols_that_it_uses(name):
    text = page_of(name.replace("ch", "chapter"))
    table = [f"| {' | '.join(row)} |" for row in symbols(name)]
    head = ["### Symbols and abbreviations", "", "| symbol | meaning | unit |", "|---|---|---|"]
    assert "\n".join([*head, *table, "", "### "]) in text
    rest = text.replace("\n".join(table), "")
    for symbol in (word.strip() for row in symbols(name) for word in row[0].split(",")):
        plain = symbol.removeprefix("effects such as ").strip("`")
        assert re.search(rf"\b{re.escape(plain)}\b", rest), symbol
    assert [line for line in page([], "x").splitlines()[4:] if line not in text] == []


# ----------------------------------------------------------------------- experiments


def geometry(rotation):
    """(3.1)-(3.8) as printed, from the tendon's end: contraction, torque per pull as printed and
    with power conserved.
    """
    angle = elbow.rest_angle() + rotation
    reach = math.hypot(AXIAL, OFFSET)
    between = (
        math.pi - angle - math.atan2(OFFSET, AXIAL)
    )  # the lower end's direction from the upper link
    x, y = reach * np.cos(between), reach * np.sin(between)
    upper = x + np.sqrt(TENDON**2 - (OFFSET - y) ** 2)  # the upper end's place along its link
    ao = np.hypot(upper, OFFSET)
    theta_1 = np.arctan2(OFFSET, upper)
    theta_f = np.arccos((TENDON**2 + ao**2 - reach**2) / (2.0 * TENDON * ao)) - theta_1
    lever = ao * np.sin(theta_1 + theta_f)
    return upper - AXIAL, lever * np.cos(theta_f), lever / np.cos(theta_f)


def test_torque_laws_are_the_printed_equations_and_power():
    rotation = np.radians(np.linspace(0.0, 110.0, 56))
    contraction, printed, conserving = geometry(rotation)

    def pull(travel):
        share = travel / (7.785 * 0.0254)
        return 6.0 * rigs.named("elbow").muscle.force(150.0 * elbow.PSI, share)

    force = pull(contraction)
    # the file has the rest angle to 1e-5 deg
    for law, lever in (("printed", printed), ("conserving", conserving)):
        torque = elbow.elbow_torque(rotation, law=law)
        np.testing.assert_allclose(torque, force * lever, rtol=1e-5)
    fine = np.linspace(0.1, 1.8, 20001)
    travel = geometry(fine)[0]
    work = np.trapezoid(elbow.elbow_torque(fine), fine)
    assert work == pytest.approx(np.trapezoid(pull(travel), travel), rel=1e-7)


def test_another_braid_angle_is_that_of_every_experiment_inside_it_only():
    before = [elbow.arm_rig().model["muscle"], elbow.mooney_rivlin()]
    with elbow.braid(73.5):
        rig = elbow.arm_rig(law="printed", pounds=100.0)
        assert math.degrees(rig.model["muscle"]["braid_angle"]) == pytest.approx(73.5)
        assert elbow.mooney_rivlin().parameters["braid_angle"] == rig.model["muscle"]["braid_angle"]
        assert elbow.braid_angle() == 73.5
        steep = float(elbow.elbow_torque(0.0))
        with pytest.raises(ParameterError), elbow.braid(75.0):
            elbow.arm_rig(law="other")
        assert elbow.braid_angle() == 73.5
    assert elbow.braid_angle() is None
    assert [elbow.arm_rig().model["muscle"], elbow.mooney_rivlin()] == before
    assert steep == pytest.approx(
        float(elbow.elbow_torque(0.0, muscle=elbow.steeper_braid(73.5))), rel=1e-12
    )
    assert steep > 1.1 * float(elbow.elbow_torque(0.0))


# ------------------------------------------------------------------------ chapter 3


@pytest.mark.parametrize(
    ("chapter", "say"), [("chapter3", chapter3.say), ("chapter5", chapter5.say)]
)
def test_each_statement_counts_once_and_no_pattern_is_idle(chapter, say, monkeypatch):
    stored = facts(chapter)
    made = [judge(row["group"], row["fact"], "1", 1.0, 1.0) for row in stored]
    for row, one in zip(stored, say.scored(made), strict=True):
        assert row["apart"] == one.apart or row["group"] == chapter3.say.groups["braid"]
    for pattern in list(say.apart):
        monkeypatch.setattr(say, "apart", [pattern])
        assert any(row.apart for row in say.scored(made)), pattern
    # the first pattern that fits decides
    monkeypatch.setattr(say, "apart", [(".*", ".*", "one"), (".*", ".*", "two")])
    assert say.scored(made[:1])[0].apart == "one"


def test_lines_that_a_braid_turns_are_those_whose_verdict_it_changes(rows):
    turned = [row for row in rows if row.group == chapter3.say.groups["braid"]]
    assert all(row.apart for row in turned)
    before = {f"{row.fact}: {row.verdict} at 72.5 deg" for row in rows}
    assert len(turned) > 1
    for row in turned[1:]:
        assert row.fact in before
        assert not row.fact.endswith(f": {row.verdict} at 72.5 deg")
    with elbow.braid(chapter3.STEEPER):
        blocked = elbow.arm_rig().muscle.force(150.0 * elbow.PSI, 0.0)
    fact = next(row for row in turned if row.fact.startswith("blocked force"))
    assert fact.ours == pytest.approx(float(blocked) / 4.4482216152605, rel=1e-6)


def test_verdicts_of_the_chapter(rows):
    own = [
        row
        for row in rows
        if row.group in chapter3.say.groups.values() and row.group != chapter3.say.groups["braid"]
    ]
    assert {row.fact for row in own if row.verdict == "differs"} == DIFFER
    assert all(row.reason for row in own if row.verdict == "differs" and not row.apart)
    assert all(row.note for row in rows if row.verdict == "cannot tell")
    built = {row.fact for row in own if row.basis == "construction"}
    assert "peak rate, valve area chosen for it" in built
    assert {row.verdict for row in rows} == {"agree", "differs", "cannot tell"}


def test_the_printed_torque_law_is_what_fits_and_the_table_says_so(rows):
    by = {row.fact: row for row in rows if row.group in chapter3.say.groups.values()}
    for fact in (
        "last rotation with 200 ft lbf",
        "largest torque",
        "rotation at the largest torque",
    ):
        plain, printed = by[fact], by[f"{fact}, torque as printed in (3.6)-(3.8)"]
        assert abs(printed.relative) < 0.05 < abs(plain.relative)
    text = " ".join(chapter3.in_short(rows))
    assert (
        f"{by['last rotation with 200 ft lbf, torque as printed in (3.6)-(3.8)'].ours:.1f} deg "
        "(published 78)"
    ) in text


def test_every_number_chosen_is_the_rigs_and_says_from_where():
    rig = rigs.named("elbow")
    for name, _, reason in chapter3.chosen():
        assert name in rig.parameters
        assert len(reason) >= 10, name
    lines = (Path(rigs.__file__).parent / "elbow.toml").read_text(encoding="utf-8").splitlines()
    own = "discharge_area_max dead_volume inertia first_moment viscous coulomb max_angle volume"
    for name in own.split():
        line = next(line for line in lines if line.startswith(f"{name} "))
        assert "#" in line, f"{name} has no origin"


def test_page_in_the_documentation_is_what_the_command_makes(rows):
    stored = by_fact("chapter3")
    for row in rows:
        there = stored[row.group, row.fact]
        assert there["verdict"] == row.verdict
        ours = float(there["ours"] or "nan")
        assert ours == pytest.approx(row.ours, rel=1e-4, abs=1e-6, nan_ok=True)
