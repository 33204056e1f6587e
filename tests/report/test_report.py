"""Report and figure of a diagnosis."""

from __future__ import annotations

import re
import struct
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.diagnosis import synthetic

pytest.importorskip("matplotlib")
pytest.importorskip("jinja2")

from pamrs.findings import BudgetTerm
from pamrs.report import figures, render_html
from pamrs.report import text as words
from tests.tables import rows_of


@pytest.fixture(scope="module")
def page() -> str:
    """The whole page of the made-up diagnosis."""
    return render_html(synthetic.diagnosis())


@pytest.mark.parametrize("make", [synthetic.diagnosis, synthetic.sealed_chamber, synthetic.nothing])
def test_page_is_self_contained(make, tmp_path: Path) -> None:
    path = tmp_path / "report.html"
    assert make().report(path) == path
    html = path.read_text(encoding="utf-8")
    links = re.findall(r"""(?:src|href|action|data)\s*=\s*["']([^"']*)""", html)
    assert all(link.startswith(("#", "data:")) for link in links)
    assert not re.search(r"url\(\s*['\"]?(?!#|data:)", html)
    assert "@import" not in html
    assert "<script" not in html
    assert len(html) < 4_000_000


@pytest.mark.parametrize(
    ("verdict", "ambiguity", "words"),
    rows_of(__file__, "a_set_with_parameters_in_it_is_no_missing_physics_yet"),
)
def test_a_set_with_parameters_in_it_is_no_missing_physics_yet(
    verdict: str, ambiguity: list[list[str]], words: str
) -> None:
    assert words in replace(synthetic.diagnosis(), verdict=verdict, ambiguity=ambiguity).headline


def test_the_headline_names_what_the_model_holds_already() -> None:
    term = BudgetTerm("chamber", "held", "leak_muscle", "", 0.9, [0.8, 1.0], None, 1.0, 300.0, "Pa")
    found = replace(synthetic.nothing(), budget=[term])
    assert found.headline.startswith(
        "Nothing is missing in addition to the muscle leak that the model holds: the model explains"
    )


def test_ids_are_unique_and_resolve(page: str) -> None:
    ids = re.findall(r'\bid="([^"]+)"', page)
    assert len(ids) == len(set(ids))
    for target in re.findall(r'(?:url\(|href=")#([^)"]+)', page):
        assert target in ids


def test_page_tells_the_story(page: str) -> None:
    for part in (
        "leaves out: heat transfer",
        "41.3 ± 2.2",
        "W/(m² K)",
        "do not determine",
        "outside its tolerance",
        "97 %",
        "sine_sweep",
        "step_up",
        "random",
        "Next experiment",
        "sealed &lt;chamber&gt;",
        "frozen joint_angle",
        "310 to 490 kPa",
        "9.00 to 11.20 s",
        "How to read this page",
        "The 2 effects that were tested",
        "under 1 %",
        "not fitted",
    ):
        assert part in page, part
    assert page.count("<svg") == 5


def test_ambiguity_is_shown_only_when_open(page: str) -> None:
    assert "cannot separate" not in page
    html = render_html(
        synthetic.diagnosis(ambiguity=[["leak_muscle"], ["leak_muscle", "heat_transfer"]])
    )
    assert "cannot separate" in html
    assert '<li>muscle leak + heat transfer <span class="note">(0.01)</span></li>' in html


def test_page_of_nothing_missing() -> None:
    html = render_html(synthetic.nothing())
    assert "Nothing is missing" in html
    assert "with the effect</h2>" not in html
    assert ">nan" not in html.lower()


@pytest.mark.parametrize("make", [synthetic.diagnosis, synthetic.sealed_chamber, synthetic.nothing])
def test_figure_is_a_png(make, tmp_path: Path) -> None:
    data = make().figure(tmp_path / "figure.png").read_bytes()
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    assert struct.unpack(">II", data[16:24]) == (1600, 1000)


def test_figure_without_traces(tmp_path: Path) -> None:
    assert (
        synthetic.diagnosis(traces=[], probabilities={}, residuals={}, condition_map=None)
        .figure(tmp_path / "f.png")
        .exists()
    )


def test_decimation_keeps_extremes_and_gaps() -> None:
    time = np.arange(100_000.0)
    values = np.sin(time / 1e4)
    values[51_234] = 9.0
    values[70_000:80_000] = np.nan
    t, v = figures.decimate(time, values)
    assert len(t) <= figures.MAX_POINTS
    assert np.nanmax(v) == 9.0
    assert np.all(np.diff(t) > 0)
    assert np.isnan(v[(t >= 71_000) & (t < 79_000)]).all()


def test_map_of_wrong_shape_is_refused() -> None:
    bad = {
        "x_label": "",
        "y_label": "",
        "x_edges": [0, 1, 2],
        "y_edges": [0, 1],
        "z": [[1.0, 2.0, 3.0]],
    }
    with pytest.raises(ValueError, match="shape"):
        figures.map_svg(synthetic.diagnosis(condition_map=bad))


def test_empty_map_is_left_out() -> None:
    empty = {
        "x_label": "",
        "y_label": "",
        "x_edges": [0, 1, 2],
        "y_edges": [0, 1],
        "z": [[np.nan, np.nan]],
        "z_after": None,
    }
    assert figures.map_svg(synthetic.diagnosis(condition_map=empty)) is None


def test_a_budget_is_drawn_with_all_its_terms_inside() -> None:
    def term(kind: str, name: str, share: float, interval: list[float]) -> BudgetTerm:
        return BudgetTerm("arm", kind, name, "", share, interval, None, 3.0, 0.01, "rad")

    terms = [
        term("parameters", "", -0.66, [-3.07, 0.38]),  # the refit spoils what was held out
        term("effect", "muscle_creep", 1.656, [0.3, 2.5]),
        term("unexplained", "", 0.004, [0.0, 0.01]),
    ]
    svg = figures.budget_svg(synthetic.diagnosis(budget=terms))
    assert svg is not None
    assert [text for text in ("\u221266 %", "166 %", "under 1 %") if text not in svg] == []
    # a number that lies outside of the picture would be lost
    width = float(re.search(r'viewBox="0 0 ([\d.]+)', svg)[1])  # type: ignore[index]
    places = [float(x) for x in re.findall(r'<text [^>]*\bx="([\d.]+)"', svg)]
    assert max(places) < width
    sentence = words.budget_sentence(terms)
    assert "muscle creep 166 % (30 to 250)" in sentence
    assert "under 1 % unexplained" in sentence
