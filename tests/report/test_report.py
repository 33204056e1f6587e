"""Report and figure of a diagnosis."""

from __future__ import annotations

import json
import re
import struct
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.diagnosis import synthetic

pytest.importorskip("matplotlib")
pytest.importorskip("jinja2")

from pamrs._views import MAX_POINTS, decimate
from pamrs.diagnosis import Diagnosis
from pamrs.findings import (
    BudgetTerm,
    ChannelError,
    EffectFound,
    EffectParameterFound,
    FreeRun,
    FreeRunError,
    MissingInput,
    MissingRecording,
    fields_from,
)
from pamrs.report import figures, render_html, sentences
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
    assert not re.search(r"<script[^>]*\bsrc", html)
    assert "<svg" in html.partition("<script")[0]  # drawn without a script, too
    assert len(html) < 3_000_000


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
        "The model of the chamber leaves out heat that the gas exchanges: heat transfer (0.96)",
        "41.3 ± 2.2",
        "W/(m² K)",
        "do not determine",
        "outside its tolerance",
        "6.0× noise",
        "watch the pressure for 5 s",
        "sine_sweep",
        "step_up",
        "random",
        "Next experiment",
        "sealed &lt;chamber&gt;",
        "frozen joint_angle",
        "3.1 to 4.9 bar",
        "all as by default",
        "9.00 to 11.20 s",
        "How to read this page",
        "The 2 effects that were tested",
        "under 1 %",
        "not fitted",
    ):
        assert part in page, part
    assert page.count('<figure class="curves">') == page.count("application/json") == 3


def lacking() -> Diagnosis:
    """The made-up diagnosis with a missing input that has two strokes."""
    time = np.linspace(0.0, 9.0, 300)
    rate = np.cos(time)
    value = -0.4 * np.sign(rate)
    along = {"joint_angle": np.sin(time), "joint_rate": rate}
    sizes = (time, value, 0.1 + 0.0 * time, along, 9.0, 1.0, 0.9 * value)
    missing = MissingInput(
        block="arm",
        unit="N m",
        sentence="0.4 N m against the motion <really>",
        argument="joint_rate",
        explained=0.9,
        share=0.99,
        noises_before=9.0,
        noises_after=1.0,
        position="joint_angle",
        rate="joint_rate",
        units={"time": "s", "joint_angle": "rad", "joint_rate": "rad/s"},
        recordings=[MissingRecording("random", "held_out", *sizes)],
    )
    return replace(synthetic.diagnosis(), missing_input=missing)


def test_the_first_screen_has_the_missing_input(page: str) -> None:
    found = lacking()
    html = render_html(found)
    first = html.partition("<details><summary>The verdict in full")[0]
    assert "lacks: 0.4 N m against the motion &lt;really&gt;</h2>" in first
    for part in ("joint rate [deg/s]", "missing, arm [N m]", "up stroke", "what is named"):
        assert part in first.partition("lacks: ")[2], part
        assert part not in page
    ids = re.findall(r'\bid="([^"]+)"', html)
    assert len(ids) == len(set(ids))
    titles = [axes.get_title() for axes in found.plot()]
    assert titles[-1].startswith("Missing: 0.4 N m")
    read = fields_from(Diagnosis, json.loads(found.to_json()))["missing_input"]
    assert read.to_dict() == found.missing_input.to_dict()


def visible(html: str) -> list[str]:
    """Words before anything is unfolded, without pictures and tables."""
    body = html.partition("<body>")[2]
    left = re.sub(r"<(svg|table|script|details)\b.*?</\1>", " ", body, flags=re.DOTALL)
    return re.sub(r"<[^>]*>", " ", left).split()


LONG = (
    "Drive the muscle pressure in nested triangles around 1.95 bar, of ±1.17, ±0.7 and ±0.35 bar, "
    "first with a period of 12 s, then of 1.2 s, with one more channel: supply pressure."
)


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"ambiguity": [["leak_muscle"], ["heat_transfer"], ["unlisted"]]},
        {"verdict": "unlisted", "effects": [], "warnings": ["long " * 60] * 9},
        {"next_experiment": {"text": "Fill and hold, " * 90, "instruction": LONG}},
    ],
)
def test_little_is_to_be_read_before_details(changes) -> None:
    found = synthetic.diagnosis(**changes, traces=synthetic.diagnosis().traces[:1])
    seen = visible(render_html(found))
    assert 20 < len(seen) <= 150
    assert found.next_experiment.instruction in " ".join(seen)  # whole
    assert len(sentences.title(found).split()) <= sentences.LONGEST


@pytest.mark.parametrize(
    ("changes", "told"),
    rows_of(__file__, "the_title_says_what_all_that_is_left_shares"),
)
def test_the_title_says_what_all_that_is_left_shares(changes, told: str) -> None:
    assert sentences.title(synthetic.diagnosis(**changes)) == told


def test_curves_are_data_that_a_script_redraws() -> None:
    found = synthetic.diagnosis(case="</script><b>")
    (panel, left) = figures.trace_panels(found, found.traces[:1])
    hostile = replace(panel, title="</script>")
    drawn, _, text = figures.curves([hostile, left], "a").partition(
        '<script type="application/json">'
    )
    assert drawn.startswith("<svg")
    told = json.loads(text.removesuffix("</script>"))
    assert [own["title"] for own in told] == ["</script>", "not explained of joint angle [°]"]
    assert "</script>" not in text.removesuffix("</script>")
    measured = told[0]["lines"][0]
    assert measured["name"] == "measured"
    assert len(measured["x"]) == len(measured["y"]) <= MAX_POINTS
    assert None in measured["y"]  # a gap
    assert max(v for v in measured["y"] if v is not None) == pytest.approx(
        np.degrees(np.nanmax(found.traces[0].measured)), rel=1e-4
    )


def test_the_free_run_is_drawn_first_with_what_it_misses() -> None:
    trace = replace(synthetic.trace("random", "held_out", "muscle_pressure", "Pa", 3e5), refit=None)
    error = FreeRunError("Pa", 22800.0, 610.0, 900.0, 400.0, 400.0)
    run = FreeRun("random", "held_out", 30.0, {"muscle_pressure": error})
    found = synthetic.diagnosis(free_run=[run], free_traces=[trace], traces=[])
    (panel,) = figures.free_panels(found)
    assert panel.title == "muscle pressure [bar]: missed by 0.23, mended 0.0061"
    assert [line.name for line in panel.lines] == ["measured", "your model", "mended model"]
    assert "Recording random, the whole rig from its commands alone" in render_html(found)


def test_a_size_is_told_as_a_bench_has_it() -> None:
    def leak(share: float, form: str = "") -> str:
        values = {
            "conductance": (2.151e-10, 6.9e-12, "m3/(s Pa)"),
            "laminar_share": (share, None, "1"),
        }
        parameters = {n: EffectParameterFound(*own) for n, own in values.items()}
        effect = EffectFound("leak_muscle", form=form, parameters=parameters)
        ((_, _, told), _) = sentences.effect_values(effect)
        return told

    # sonic flow at 4.013 bar absolute; and (p^2 - pa^2)/500 kPa of a porous wall, both times C
    assert pytest.approx(5.18, abs=0.005) == 2.151e-10 * 4.01325e5 * 6e4
    assert leak(0.0) == "5.2 (4.9 to 5.5) l/min at 3 bar"
    assert (
        pytest.approx(3.89, abs=0.005) == 2.151e-10 * (4.01325**2 - 1.01325**2) * 1e10 / 5e5 * 6e4
    )
    assert leak(1.0) == "3.9 (3.6 to 4.1) l/min at 3 bar"
    assert leak(0.0, "power") == "6.5 (6.0 to 6.9) l/min at 4 bar"


def test_the_first_screen_is_a_page(tmp_path: Path) -> None:
    data = synthetic.diagnosis().pdf(tmp_path / "page.pdf").read_bytes()
    assert data.startswith(b"%PDF-")
    assert data.count(b"/Type /Page\n") + data.count(b"/Type /Page ") == 1


def test_ambiguity_is_shown_only_when_open(page: str) -> None:
    assert "cannot separate" not in page
    html = render_html(
        synthetic.diagnosis(
            ambiguity=[["leak_muscle"], ["leak_muscle", "heat_transfer"]], traces=[]
        )
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
    bare = synthetic.diagnosis(traces=[], probabilities={}, residuals={})
    assert bare.figure(tmp_path / "f.png").exists()


def test_decimation_keeps_extremes_and_gaps() -> None:
    time = np.arange(100_000.0)
    values = np.sin(time / 1e4)
    values[51_234] = 9.0
    values[70_000:80_000] = np.nan
    t, v = decimate(time, values)
    assert len(t) <= MAX_POINTS
    assert np.nanmax(v) == 9.0
    assert np.all(np.diff(t) > 0)
    assert np.isnan(v[(t >= 71_000) & (t < 79_000)]).all()


def test_the_final_model_is_called_what_it_is(page: str) -> None:
    named = synthetic.diagnosis()
    bare = {"effects": [], "wrong_parameters": [], "unexplained": []}
    refitted = synthetic.diagnosis(verdict="unlisted", **bare)
    nothing = synthetic.diagnosis(verdict="none", **bare)
    told = [found.answer.model for found in (named, refitted, nothing)]
    assert told == ["mended model", "refitted model", "your model"]
    for found, columns in ((named, 4), (refitted, 3), (nothing, 3)):
        heads = [*sentences.shown_stages(found).values()]
        assert len({*heads}) == len(heads) == columns
        assert all(head in found.summary() for head in heads)
    assert "<th>mended model</th>" in render_html(named)
    assert "<th>mended model</th>" not in render_html(refitted)


def test_a_refit_that_spoils_held_out_recordings_is_said() -> None:
    table = {
        "joint_angle": ChannelError(noise=0.001, before=0.03, refit=0.05, after=0.05),
        "muscle_pressure": ChannelError(noise=500.0, before=900.0, refit=990.0, after=600.0),
    }
    told = sentences.worse_sentence(table)
    assert "joint angle worse here" in told
    assert "muscle pressure" not in told  # within two noise levels it is chance
    assert (
        sentences.worse_sentence({"joint_angle": replace(table["joint_angle"], refit=0.03)}) == ""
    )


def test_a_whisker_is_drawn_where_its_text_says() -> None:
    def term(kind: str, name: str, share: float, interval: list[float]) -> BudgetTerm:
        return BudgetTerm("arm", kind, name, "", share, interval, None, 3.0, 0.01, "rad")

    terms = [
        term("parameters", "", -0.2, [-3.07, 0.38]),  # the refit spoils what was held out
        term("effect", "muscle_creep", 1.196, [0.3, 2.5]),
        term("unexplained", "", 0.004, [0.0, 0.01]),
    ]
    html = render_html(synthetic.diagnosis(budget=terms, traces=[]))
    rows = re.findall(r'<i class="\w+" style="([^"]+)"></i><b style="([^"]+)">.*?</tr>', html, re.S)
    assert [text for text in ("\u221220 %", "120 %", "under 1 %") if text not in html] == []

    def ends(style: str) -> tuple[float, float]:
        left, width = (float(v) for v in re.findall(r":([\d.]+)%", style))
        return left, left + width

    # drawn from -100 % to 250 %: an interval that ends outside is cut there
    def at(share: float) -> float:
        return 100.0 * (min(2.5, max(-1.0, share)) + 1.0) / 3.5

    for own, (bar, whisker) in zip(terms, rows, strict=True):
        assert ends(bar) == pytest.approx(sorted((at(0.0), at(own.share))), abs=0.02)
        assert ends(whisker) == pytest.approx([at(v) for v in own.interval], abs=0.02)
    sentence = sentences.budget_sentence(terms)
    assert "muscle creep 120 % (30 to 250)" in sentence
    assert "under 1 % unexplained" in sentence
