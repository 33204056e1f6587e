"""Chapter 2 beside ours: the braid on the ends, the stand-ins and their fits, and how a statement
is put to all of them.
"""

import math
import re

import numpy as np
import pytest
from scipy.integrate import quad

from pamrs.library import ch2_075in
from reproduction import chapter2
from reproduction import stand_in as stand_ins
from reproduction.tests.pages import by_fact, page_of

#: Statements that do not agree; one that changes sides must be noticed.
DIFFER = {
    "deadband of the blocked force",
    "least radius in extension, without a floor of our own",
    "braid on an end, radius 10 % wider over 10 % narrower",
}


@pytest.fixture(scope="module")
def few():
    """Three stand-ins instead of all."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(chapter2, "COUNT", 3)
        return chapter2.facts(search=False)


# ------------------------------------------------------------------------------ shape


@pytest.mark.parametrize("contraction", [-0.004, 0.02, 0.1, 0.3])
def test_braid_on_an_end_is_the_arc_of_the_ellipse(contraction):
    muscle = ch2_075in()
    own = muscle.parameters
    ratio, axial, braid = (float(x[0]) for x in chapter2.ends(muscle, np.array([contraction])))
    rest, radius = 0.5 * own["rest_diameter"], float(muscle.radius(contraction))
    slope = own["contraction_slope"] if contraction > 0 else own["extension_slope"]
    assert ratio == pytest.approx(1.64 - slope * contraction)
    # (2.17) to (2.28) with the polar angle of 60 deg, as an integral of its own
    q = ratio / math.sqrt(ratio**2 + 3.0)
    a = (radius - rest) / (1.0 - q)
    b, c = ratio * abs(a), radius - a
    assert axial == pytest.approx(math.sqrt(3.0) * q * abs(a))
    end = math.atan(math.sqrt(3.0) / ratio)
    length = own["rest_length"] * (1.0 - contraction)
    turning = 2.0 * math.pi * muscle.turns * axial / (length * end)

    def arc(v):
        return math.sqrt(
            ((a * math.cos(v) + c) * turning) ** 2 + (a * math.sin(v)) ** 2 + (b * math.cos(v)) ** 2
        )

    assert braid == pytest.approx(quad(arc, 0.0, end)[0], rel=1e-6)


# ---------------------------------------------------------------------------- stand-ins


def test_stand_ins_contract_as_the_text_has_it():
    for number in range(stand_ins.COUNT):
        own = stand_ins.stand_in(number)
        last = [float(own.contractions(psi * stand_ins.PSI)[-1]) for psi in stand_ins.LEVELS]
        assert np.all(np.diff(last) > 0.0)
        assert 0.003 < last[0] < 0.03  # activation near 0.07 MPa
        assert float(own.muscle.circumferential_strain(last[-1])) > 2.0
    assert stand_ins.stand_in(0).rubber != stand_ins.stand_in(1).rubber


def test_friction_of_the_text_comes_back_from_slipping_loops():
    c0, c1, gain = stand_ins.hysteresis(2)
    assert c0 == pytest.approx(0.16, abs=0.005)
    assert c1 == pytest.approx(-0.145, abs=0.01)
    assert gain > 2.0


# ----------------------------------------------------------------------------- verdicts


@pytest.mark.parametrize(
    ("above", "verdict"),
    [
        (10, "agree"),
        (9, "agree"),
        (8, "cannot tell"),
        (2, "cannot tell"),
        (1, "differs"),
        (0, "differs"),
    ],
)
def test_nine_of_ten_stand_ins_decide(above, verdict, monkeypatch):
    line = {"group": "free", "fact": "f", "where": "2.3", "published": 1.0, "relation": "above"}
    monkeypatch.setitem(chapter2.say.rows, "tried", {**line, "note": "because of {0}"})
    values = [2.0] * above + [0.5] * (10 - above)
    row = chapter2.over("tried", values, "it")
    assert row.verdict == verdict
    assert row.ours == np.median(values)
    assert "over 10 stand-ins" in row.note
    assert row.note.endswith("because of it")


def test_statements_count_once_and_with_a_source(few):
    assert len({(row.group, row.fact) for row in few}) == len(few)
    assert all(re.match(r"2\.\d", row.where) for row in few)
    places = {}
    for row in few:
        if not row.apart and "'" in row.where:
            places.setdefault(row.where, []).append(row.fact)
    again = {where: facts for where, facts in places.items() if len(facts) > 1}
    # one sentence has two orders in it
    assert list(again) == [
        "2.3: 'the first- and second-order functions exhibit higher error at high pressures'"
    ]
    assert {row.group for row in few} == set(chapter2.say.groups.values())


def test_what_needs_no_measurement_is_as_before(few):
    alone = [row for row in few if "stand-ins" not in row.note and not row.apart]
    assert {row.fact for row in alone if row.verdict == "differs"} == DIFFER
    assert sum(row.verdict == "cannot tell" for row in alone) == 2
    assert all(isinstance(text, str) and text for text in chapter2.in_short(few))
    names = [name for name, _, _ in chapter2.chosen()]
    assert len(names) == len(set(names))


def test_page_is_what_the_command_makes(few):
    stored = by_fact("chapter2")
    assert list(stored) == [(row.group, row.fact) for row in few]
    for row in few:
        if "stand-ins" in row.note:
            continue
        there = stored[row.group, row.fact]
        assert there["verdict"] == row.verdict
        ours = float(there["ours"] or "nan")
        assert ours == pytest.approx(row.ours, rel=1e-4, abs=1e-6, nan_ok=True)


@pytest.mark.slow
def test_whole_page():
    rows = chapter2.facts()
    stored = {key: row["verdict"] for key, row in by_fact("chapter2").items()}
    assert {(row.group, row.fact): row.verdict for row in rows} == stored
    from reproduction.chapter2_figures import pictures

    drawn = pictures()
    assert {one.group for one in drawn} <= set(chapter2.say.groups.values())
    for one in drawn:
        assert one.png.startswith(b"\x89PNG")
        assert f"chapter2/{one.name}.png" in page_of("chapter2")
