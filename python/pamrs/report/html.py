"""The report page: gathers what the template shows. Import through `pamrs.report`."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from datetime import datetime
from functools import partial
from pathlib import Path
from typing import Any, Final

from markupsafe import Markup

from pamrs._losses import Losses
from pamrs.findings import HEALTHY, YOURS, BlockMismatch, Findings
from pamrs.report import figures, sentences, words
from pamrs.report.chain import chain_svg
from pamrs.report.page import render_page
from pamrs.report.words import format_number, in_one_unit, is_number, spoken_name, typeset

TRACES = 3
"""Channels of a recording that are drawn."""
_LEAST_CONDITION = 0.005  # share of the excess below which a condition is not named: 0 %
THROUGHOUT = 0.9
"""Share of a recording from which an excess is throughout it."""


def _span(bounds: tuple[float, ...] | None, digits: int = 3) -> str:
    return " to ".join(format_number(bound, digits) for bound in bounds) if bounds else "–"


def _unit(unit: str) -> str:
    """Unit with raised powers; empty for dimensionless."""
    raised = {"2": "²", "3": "³", "4": "⁴"}
    text = re.sub(r"(?:\^|(?<=[msK]))([234])", lambda m: raised[m[1]], unit)
    return "" if text in {"1", "-"} else text


def _missed(diagnosis: Findings, block: BlockMismatch) -> list[str]:
    """Errors of a block, refitted and with what was found, in words."""
    texts = []
    for stage in ("refit", "after"):
        missed = sentences.miss(diagnosis, block.channel, stage)
        note = sentences.LEFT[sentences.left_in(diagnosis, block.block, stage) or "more"][1]
        texts.append(f"{typeset(str(missed))}{note}" if missed else "–")
    return texts


def _signed(moved: float) -> str:
    return f"{moved:+.1f}".replace("-", "−")


def _share(share: float | None) -> str:
    """A share of the mismatch in percent."""
    if share is None:
        return "not fitted"
    return "all" if share >= 1.0 else words.format_share(max(share, 1e-9))


def _intervals(diagnosis: Findings) -> list[str]:
    """Words on the times at which the excess is."""
    spans = [(float(a), float(b)) for a, b in diagnosis.where.intervals]
    trace = next((t for t in diagnosis.traces if t.recording == diagnosis.where.recording), None)
    if trace is not None and sum(b - a for a, b in spans) > THROUGHOUT * float(
        trace.time[-1] - trace.time[0]
    ):
        return ["throughout the recording"]
    return [f"{a:.2f} to {b:.2f} s" for a, b in spans]


def _parameters(diagnosis: Findings) -> list[dict[str, Any]]:
    wrong = {w.name for w in diagnosis.wrong_parameters}
    rows = []
    for name, p in diagnosis.parameters.items():
        known, size = p.known or name in wrong, abs(p.moved_sigmas)
        unit, factor = words.display_unit(p.unit, max(abs(p.nominal), abs(p.value)))
        shown = known and math.isfinite(size)
        flag = "" if known else "not determined by these recordings"
        if known and size >= 2:
            flag = "outside its tolerance" if size >= 3 else "at the edge of its tolerance"
        rows.append(
            {
                "cells": (
                    format_number(p.nominal * factor, 4),
                    words.format_uncertain(p.value * factor, p.std * factor) if known else "–",
                ),
                "name": name,
                "unit": _unit(unit),
                "moved": _signed(p.moved_sigmas) if shown else "–",
                "bar": min(1.0, size / 4.0) if shown else 0.0,
                "right": p.moved_sigmas >= 0,
                "flag": "the rig file is wrong" if name in wrong else flag,
                "known": shown,
                "alarm": known and size >= 3,
            }
        )
    return rows


def _fits(diagnosis: Findings) -> list[tuple[str, list[Any], str]]:
    """The tables of errors with their titles, and which errors the refit makes worse: of each
    channel its name and unit, and of each stage its key, value and noise levels.
    """
    held, stages = diagnosis.fit.held_out, sentences.shown_stages(diagnosis)
    worse = "" if diagnosis.answer.verdict in HEALTHY else sentences.worse_sentence(held)
    tables = []
    for title, errors, note in (
        ("Held-out recordings (not used for the fit)", held, worse),
        ("Fitted recordings", diagnosis.fit.channels, ""),
    ):
        rows = []
        for channel, unit, cells, entry in words.error_cells(errors):
            missed = {key: sentences.miss_of(entry, channel, key) for key in stages}
            times = {k: f"{format_number(m.noises, 2)}×" if m else "–" for k, m in missed.items()}
            own = [(key, cells[key], times[key] * (key != "noise")) for key in stages]
            rows.append((spoken_name(channel), unit, own))
        tables.append((title, rows, note))
    return [own for own in tables if own[1]]


def _free_run(diagnosis: Findings) -> list[tuple[str, str, str, list[str]]]:
    """Errors of free runs and of the cut chain, channel by channel."""
    rows, yours = [], diagnosis.answer.model == YOURS
    for run in diagnosis.free_run or []:
        for k, (channel, error) in enumerate(run.channels.items()):
            every = (error.before, error.after, error.cut_before, error.cut_after)[:: 1 + yours]
            cells, unit = in_one_unit(error.unit, every)
            rows.append((run.recording if k == 0 else "", spoken_name(channel), unit, cells))
    return rows


def _budget(diagnosis: Findings) -> list[tuple[str, list[dict[str, str]]]]:
    """Bars of the terms of each block's budget, each with its interval where the text has it."""
    terms = sentences.budgets(diagnosis)
    blocks = {name: sentences.reported_terms(own) for name, own in terms.items()}
    every = [v for own in blocks.values() for _, t in own for v in (t.share, *t.interval)]
    low, high = max(-1.0, min([0.0, *every])), min(2.5, max([1.0, *every]))

    def at(share: float) -> float:
        return 100.0 * (min(high, max(low, share)) - low) / (high - low)

    def bar(first: float, last: float) -> str:
        return f"left:{at(first):.2f}%;width:{at(last) - at(first):.2f}%"

    found = []
    for block, own in blocks.items():
        left = sentences.LEFT[sentences.left_in(diagnosis, block) or "more"][0]
        rows = [
            {
                "name": (left if term.kind == "unexplained" else "") or name,
                "kind": term.kind,
                "text": words.format_share(term.share),
                "interval": words.format_interval(term.interval),
                "bar": bar(*sorted((0.0, term.share))),
                "whisker": bar(*term.interval),
            }
            for name, term in own
        ]
        found.append((spoken_name(block), rows))
    return found


def _found(diagnosis: Findings) -> list[tuple[str, ...]]:
    """Rows of what was found: name, in the rig file, on the bench, value and interval, unit."""
    rows: list[tuple[str, ...]] = []
    for effect in diagnosis.effects:
        head = f"{sentences.closest_mark(diagnosis, effect)}{words.label(effect.term)}: "
        for name, own, usual in sentences.effect_values(effect):
            value = words.format_uncertain(own.value, own.std)
            size = (typeset(usual), value, _span(words.span95(own)), _unit(own.unit))
            rows.append((head + words.label(name), "", *size))
        if vague := sentences.undetermined_sentence(effect):
            rows.append((f"{head}not determined", vague))
    for entry in diagnosis.wrong_parameters:
        found, stated, (unit, factor) = sentences.wrong_values(entry)
        span = _span(tuple(v * factor for v in entry.interval), 4)
        far = f"{stated} ({_signed(entry.moved_sigmas)} tolerances)"
        rows.append((entry.name, far, "", found, span, _unit(unit)))
    return rows


def _limits(diagnosis: Findings) -> list[tuple[bool | str, ...]]:
    """Rows of sizes from which the recordings would have shown effects, and distinguished them;
    first of each, True where the effect is named.
    """
    return [
        (
            own.effect in diagnosis.answer.named,
            words.label(own.effect),
            spoken_name(own.block),
            words.label(own.size.rpartition(".")[2]),
            *sentences.limit_sizes(own)[1:],
            words.set_label([own.rival]) if own.rival else "",
        )
        for own in diagnosis.limits
    ]


def _markup(svg: str | None) -> Markup | None:
    return None if svg is None else Markup(svg)  # noqa: S704


def _curves(panels: list[figures.Panel], prefix: str) -> Markup | None:
    return _markup(figures.curves(panels, prefix)) if panels else None


def _recordings(diagnosis: Findings) -> tuple[list[dict[str, Any]], int]:
    """One fitted and one held-out recording with their figure, and how many are not shown."""
    telling = figures.telling_trace(diagnosis)
    first = telling and (telling.role, telling.recording)
    groups = words.grouped(((t.role, t.recording), t) for t in diagnosis.traces)
    keys = sorted(groups, key=lambda key: key != first)
    held = [key for key in keys if key[0] == "held_out"]
    chosen = [key for key in keys if key not in held][:1] + held[:1]
    shown = []
    for i, (role, name) in enumerate(chosen):
        traces = sorted(groups[role, name], key=lambda t: t.channel != diagnosis.where.channel)
        shown.append(
            {
                "name": name,
                "role": "held out" if role == "held_out" else "used for the fit",
                "curves": _curves(figures.trace_panels(diagnosis, traces[:TRACES]), f"rec{i}"),
            }
        )
    return shown, len(groups) - len(shown)


def _value(value: object) -> str:
    """A value of an excitation; of several chains by their names."""
    if isinstance(value, Mapping):
        return "; ".join(f"{name}: {_value(own)}" for name, own in value.items())
    if is_number(value) and not isinstance(value, bool):
        return format_number(value)
    return str(value)


def _paragraphs(diagnosis: Findings) -> list[str]:
    """Paragraphs of the verdict, with the headline and the place where it has not said them."""
    around = (f"{sentences.headline(diagnosis)}.", diagnosis.where.text)
    lead, place = (own * (own not in diagnosis.text) for own in around)
    return [own.strip() for own in (lead, *diagnosis.text.split("\n\n"), place) if own.strip()]


def render(diagnosis: Findings) -> str:
    """Return the report of a diagnosis as one HTML page without references to anything outside it.

    Parameters
    ----------
    diagnosis : Findings
        Result to show; parts that it lacks are left out.

    Returns
    -------
    str
        HTML text.
    """
    losses = Losses()
    pictures = {
        name: losses.part(f"the picture of the {name}", partial(drawn, diagnosis))
        for name, drawn in _PICTURES.items()
    }
    tables = {
        name: losses.part(f"the table of {name.replace('_', ' ')}", partial(made, diagnosis), [])
        for name, made in _TABLES.items()
    }
    recordings, hidden = losses.part(
        "the pictures of the recordings", partial(_recordings, diagnosis), ([], 0)
    )
    said = {name: partial(make, diagnosis) for name, make in sentences.SENTENCES.items()}
    bits = diagnosis.next_experiment.expected_information_bits
    settings = getattr(diagnosis, "settings", None)
    page = partial(
        render_page,
        Path(__file__).with_name("template.html.j2"),
        script=Path(__file__).with_name("curves.js").read_text(encoding="utf-8"),
        d=diagnosis,
        w=words,
        s=sentences,
        badge=sentences.case_badge(diagnosis),
        title=typeset(sentences.title(diagnosis)),
        paragraphs=list(map(typeset, _paragraphs(diagnosis))),
        forms=list(map(typeset, said["forms"]())),
        conditions=[c for c in diagnosis.where.conditions if c.share >= _LEAST_CONDITION],
        stages=sentences.shown_stages(diagnosis),
        final=diagnosis.answer.model,
        yours=diagnosis.answer.model == YOURS,
        bits=format_number(bits, 2) if is_number(bits) else "",
        recordings=recordings,
        hidden=hidden,
        free_head=figures.free_head(diagnosis),
        record=sentences.next_to_do(diagnosis).partition(": "),
        settings=settings.to_dict() if settings is not None else {},
        date=datetime.now().astimezone().isoformat(" ", "minutes"),
        data=". ".join(filter(None, (*said["data"](), *said["left_out"]()))),
        guarded=lambda what, caller: losses.part(f"the table of {what}", caller, ""),
        cells={"share": _share, "value": _value, "typeset": typeset, "capital": words.capital},
        said=said,
        verdict=partial(sentences.group_verdict, diagnosis),
        missed=partial(_missed, diagnosis),
        **pictures,
        **tables,
    )
    known = len(losses.sentences)
    text = page(warnings=[*losses.sentences, *diagnosis.warnings])
    if len(losses.sentences) == known:
        return text
    return page(warnings=[*losses.sentences, *diagnosis.warnings])


#: What the template calls each, and what makes it.
_PICTURES: Final[dict[str, Callable[[Findings], Markup | None]]] = {
    "chain": lambda diagnosis: _markup(chain_svg(diagnosis)),
    "missing": lambda diagnosis: (
        _markup(figures.missing_svg(diagnosis.missing_input)) if diagnosis.missing_input else None
    ),
    "first": lambda diagnosis: _curves(figures.free_panels(diagnosis), "free"),
    "separating": lambda diagnosis: _curves(
        figures.separating_panels(diagnosis.next_experiment.curves), "next"
    ),
}
_TABLES: Final[dict[str, Callable[[Findings], list[Any]]]] = {
    "facts": sentences.facts,
    "to_do": sentences.to_do,
    "rivals": sentences.rivals,
    "found": _found,
    "budget": _budget,
    "intervals": _intervals,
    "limits": _limits,
    "free_run": _free_run,
    "fits": _fits,
    "parameters": _parameters,
}
