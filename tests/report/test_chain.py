"""The drawing of the rig's chain, and the table of free runs."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ElementTree

import pytest
from matplotlib.figure import Figure

import pamrs
from pamrs.diagnosis.result import Diagnosis
from pamrs.findings import (
    BlockMismatch,
    BlockResidual,
    BlockVerdict,
    FreeRun,
    FreeRunError,
    MismatchSize,
    MismatchStages,
    WrongParameter,
)
from pamrs.report import render_html
from pamrs.report.chain import chain_svg, draw_chain
from tests.diagnosis import synthetic


def verdict(name: str, channel: str, kind: str = "none", noises: float = 0.0) -> BlockVerdict:
    size = MismatchSize(noises, noises, noises > 0.0)
    stages = MismatchStages(size, size, size)
    mismatch = BlockMismatch(name, channel, "Pa", stages, None)
    named = ["leak_muscle"] if kind == "effects" else []
    return BlockVerdict([name], kind, {}, named, [], [], [mismatch])


def found(rig: pamrs.Rig, located: str, blocks: list[BlockVerdict], **more: object) -> Diagnosis:
    residuals = {
        m.block: BlockResidual(1.0, 1.0, m.fitted.refit.noises, 0.5, m.channel)
        for b in blocks
        for m in b.mismatch
    }
    base = {
        "verdict": "effects",
        "effects": [{"id": "leak_muscle", "probability": 0.97, "parameters": {}}],
        "where": {"block": located},
        "blocks": blocks,
        "rig": rig,
        "measured": ["supply_pressure", "muscle_pressure", "joint_angle"],
        "traces": [],
    }
    # a table of residuals as dictionaries is what the maker of results expects
    told = {name: dict(r) for name, r in residuals.items()}
    return synthetic.diagnosis(**(base | {"residuals": told} | more))


@pytest.mark.parametrize("name", pamrs.rigs.names())
def test_every_rig_is_drawn_with_its_blocks_beside_each_other(name: str) -> None:
    rig = pamrs.rigs.named(name)
    svg = chain_svg(found(rig, "chamber", []))
    assert svg is not None
    drawn = ElementTree.fromstring(svg)  # noqa: S314  made here
    boxes = [
        tuple(float(r.attrib[k]) for k in ("x", "y", "width", "height"))
        for r in drawn.iter("rect")
        if r.attrib["fill"] == "#fff"
    ]
    kinds = ("supply", "valve", "line", "chamber", "muscle", "joint", "load")
    assert len(boxes) == sum(len(rig.tables(kind)) for kind in kinds)
    for k, (x, y, w, h) in enumerate(boxes):
        for u, v, p, q in boxes[:k]:
            assert x >= u + p or u >= x + w or y >= v + q or v >= y + h, "two boxes overlap"
    _, _, width, height = map(float, drawn.attrib["viewBox"].split())
    assert all(x + w <= width and y + h <= height for x, y, w, h in boxes)


@pytest.mark.parametrize("name", ["shoulder", "antagonistic_joint"])
def test_the_same_chain_is_drawn_on_a_picture(name: str) -> None:
    rig, axes = pamrs.rigs.named(name), Figure().subplots()
    judged = [verdict("supply", "supply_pressure")]
    draw_chain(axes, found(rig, "supply", judged))
    white = [p for p in axes.patches if p.get_facecolor()[:3] == (1.0, 1.0, 1.0)]
    kinds = ("supply", "valve", "line", "chamber", "muscle", "joint", "load")
    assert len(white) == sum(len(rig.tables(kind)) for kind in kinds)
    assert "fits to the noise" in [text.get_text() for text in axes.texts]


def test_measured_channels_are_marked_and_the_located_block_is_lit() -> None:
    blocks = [
        verdict("supply", "supply_pressure"),
        verdict("chamber", "muscle_pressure", "effects", 12.0),
        verdict("arm", "joint_angle"),
    ]
    errors = {
        "muscle_pressure": synthetic.fit_entry(3e5),
        "joint_angle": dict.fromkeys(("noise", "before", "refit", "after"), 0.001),
    }
    fit = {"channels": errors, "held_out": {}, "gap_closed": None}
    svg = chain_svg(found(pamrs.rigs.shoulder(), "chamber", blocks, fit=fit)) or ""
    assert svg.count('stroke-width="2.4"') == 1  # one frame is lit
    assert "misses 6.0 × noise" in svg  # the error of the channel in the table of errors
    assert svg.count("fits to the noise") == 2
    assert "missing: muscle" in svg
    dots = re.findall(r'<circle [^>]*r="4" fill="([^"]+)"', svg)
    assert len([d for d in dots if d != "none"]) == 3
    assert len([d for d in dots if d == "none"]) == 1  # nobody recorded the valve's command


def test_a_name_that_is_not_settled_is_drawn_as_that() -> None:
    blocks = [verdict("chamber", "muscle_pressure", "effects", 3.0)]
    blocks[0].ambiguity.extend([["leak_muscle"], ["unlisted"]])
    rig = pamrs.rigs.shoulder()
    assert "perhaps missing:" in (chain_svg(found(rig, "chamber", blocks)) or "")


def test_a_wrong_parameter_stands_at_its_block() -> None:
    entry = WrongParameter(
        name="chamber.dead_volume",
        block="chamber",
        nominal=1e-4,
        tolerance=1e-5,
        value=2e-4,
        std=1e-6,
        interval=[1.98e-4, 2.02e-4],
        unit="m3",
        moved_sigmas=10.0,
        probability=0.97,
        held_out={},
    )
    more = {"wrong_parameters": [entry], "probabilities": {entry.name: 0.97}, "effects": []}
    made = found(pamrs.rigs.shoulder(), "chamber", [], verdict="parameters", **more)
    assert ">wrong: dead volume" in (chain_svg(made) or "")


def test_without_a_rig_there_is_no_drawing() -> None:
    assert chain_svg(synthetic.diagnosis()) is None


def test_the_page_has_the_drawing_and_the_free_runs() -> None:
    error = FreeRunError("Pa", 5000.0, float("nan"), 900.0, 400.0)
    run = FreeRun("random", "held_out", 30.0, {"muscle_pressure": error}, "left its range")
    html = render_html(
        found(pamrs.rigs.shoulder(), "chamber", [], free_run=[run], free_run_note="no command in a")
    )
    assert 'class="chain"' in html
    row = html[html.index("<td>random</td>") :].partition("</tr>")[0]
    assert re.findall(r">([^<>]+)</td>", row) == ["random", "50.0", "–", "9.00", "4.00"]
    assert "mbar" in row
    assert "Random: left its range" in html
    assert "No command in a" in html
