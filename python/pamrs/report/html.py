"""The report page: gathers what the template shows. Import through `pamrs.report`."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from datetime import datetime
from functools import partial
from pathlib import Path
from typing import Any, Final

from markupsafe import Markup

from pamrs._losses import Losses
from pamrs.findings import (
    HEALTHY,
    YOURS,
    BlockMismatch,
    BlockVerdict,
    ChannelError,
    Findings,
    Trace,
)
from pamrs.report import figures, story
from pamrs.report import text as words
from pamrs.report.chain import chain_svg
from pamrs.report.page import render_page

TRACES = 3
"""Channels of a recording that are drawn."""
_LEAST_CONDITION = 0.005  # share of the excess below which a condition is not named: 0 %
THROUGHOUT = 0.9
"""Share of a recording from which an excess is throughout it."""
_BADGES = {
    "none": ("nothing missing", "nothing missing, but not settled"),
    "parameters": ("parameters inside their tolerances", "parameters or physics, not settled"),
    "effects": ("missing physics named", "missing physics, the name is not settled"),
    "unlisted": ("missing physics, no name", "missing physics, no name"),
    "units": ("", "a channel is in another unit"),
    "wrong": ("a value of the rig file is wrong", "a value of the rig file may be wrong"),
}
"""Verdicts in a few words, settled and not settled; ``wrong`` is ``parameters`` where a value is
named."""
_MORE = ("not settled: what is missing was not found", "not settled: more is missing")
"""Verdicts where the final model still misses too much: without a name, and with one."""


def _badge(verdict: str, named: Sequence[str], *, settled: bool) -> str:
    """A verdict in a few words, no surer than it is."""
    return _BADGES["wrong" if named and verdict == "parameters" else verdict][not settled]


def case_badge(diagnosis: Findings) -> str:
    """The answer in a few words."""
    answer = diagnosis.answer
    if answer.missed:
        return _MORE[bool(answer.named)]
    return _badge(answer.verdict, answer.named, settled=answer.settled)


def _span(bounds: tuple[float, float] | None, digits: int = 3) -> str:
    if bounds is None:
        return "–"
    return f"{words.format_number(bounds[0], digits)} to {words.format_number(bounds[1], digits)}"


def _unit(unit: Any) -> str:
    """Unit with raised powers; empty for dimensionless."""
    text = str(unit or "")
    if text in {"1", "-", ""}:
        return ""
    for digit, raised in (("2", "²"), ("3", "³"), ("4", "⁴")):
        text = text.replace(f"^{digit}", raised)
        for letter in ("m", "s", "K"):
            text = text.replace(f"{letter}{digit}", f"{letter}{raised}")
    return text


def _typeset(text: str) -> str:
    """Text of a terminal as a page has it: ``361.9 ± 1.2 cm³``."""
    raised = re.sub(r"\b(c?m?m)([23])\b", lambda m: m[1] + {"2": "²", "3": "³"}[m[2]], text)
    return raised.replace("+-", "±")


def _verdict(diagnosis: Findings, block: BlockVerdict) -> tuple[str, str, str]:
    """The verdict of a group of blocks, what it names, and what leads with its probability."""
    part = diagnosis.answer.part_of(block.blocks[0])
    if part is None:
        return "", "", ""
    lacking = {m.block for m in diagnosis.answer.missed} & {*block.blocks}
    badge = _badge(block.verdict, part.names, settled=part.sure and not lacking)
    leading = f"{words.answer_label(part.words)}, {words.chance_words(part)}"
    return badge, words.set_label(list(part.names)) if part.names else "–", leading


def _missed(diagnosis: Findings, block: BlockMismatch) -> list[str]:
    """Errors of a block, refitted and with what was found, in words."""
    texts = []
    for stage in ("refit", "after"):
        missed = words.miss(diagnosis, block.channel, stage)
        left = words.left_in(diagnosis, block.block, stage)
        note = {"noise": ", noise only", "error": ", inside its usual error"}.get(left, "")
        texts.append(f"{_typeset(str(missed))}{note}" if missed else "–")
    return texts


def _signed(moved: float) -> str:
    return f"{moved:+.1f}".replace("-", "−")


def _share(share: float | None) -> str:
    """A share of the mismatch in percent."""
    if share is None:
        return "not fitted"
    if share >= 1.0:
        return "all"
    return f"{100 * share:.0f} %" if share > 0.005 else "under 1 %"


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
        flag = "the rig file is wrong" if name in wrong else ""
        if not flag and not known:
            flag = "not determined by these recordings"
        elif not flag and size >= 2:
            flag = "outside its tolerance" if size >= 3 else "at the edge of its tolerance"
        rows.append(
            {
                "cells": (
                    words.format_number(p.nominal * factor, 4),
                    words.format_uncertain(p.value * factor, p.std * factor) if known else "–",
                ),
                "name": name,
                "unit": _unit(unit),
                "moved": _signed(p.moved_sigmas) if shown else "–",
                "bar": min(1.0, size / 4.0) if shown else 0.0,
                "right": p.moved_sigmas >= 0,
                "flag": flag,
                "known": shown,
                "alarm": known and size >= 3,
            }
        )
    return rows


def _fit(
    errors: dict[str, ChannelError], stages: Mapping[str, str]
) -> list[tuple[str, str, list[tuple[str, str, str]]]]:
    """Errors by channel: its name and unit, and of each stage its key, value and noise levels."""
    rows = []
    for channel, unit, factor, entry in words.shown_errors(errors):
        noise, cells = entry.noise, []
        for key in stages:
            value = entry[key]
            known = words.is_number(value) and words.is_number(noise) and noise > 0
            times = f"{words.format_number(value / noise, 2)}×" if known else "–"
            shown = words.format_number(value * factor) if words.is_number(value) else "–"
            cells.append((key, shown, "" if key == "noise" else times))
        rows.append((words.spoken_name(channel), unit, cells))
    return rows


def _fits(diagnosis: Findings) -> list[tuple[str, list[Any], str]]:
    """The tables of errors with their titles, and which errors the refit makes worse."""
    held, fitted = diagnosis.fit.held_out, diagnosis.fit.channels
    worse = "" if diagnosis.answer.verdict in HEALTHY else words.worse_sentence(held)
    stages = words.shown_stages(diagnosis)
    tables = (
        ("Held-out recordings (not used for the fit)", _fit(held, stages), worse),
        ("Fitted recordings", _fit(fitted, stages), ""),
    )
    return [own for own in tables if own[1]]


def _free_run(diagnosis: Findings) -> list[tuple[str, str, str, list[str]]]:
    """Errors of free runs and of the cut chain, channel by channel."""
    rows, yours = [], diagnosis.answer.model == YOURS
    for run in diagnosis.free_run or []:
        for k, (channel, error) in enumerate(run.channels.items()):
            every = (error.before, error.after, error.cut_before, error.cut_after)[:: 1 + yours]
            sizes = [abs(v) for v in every if words.is_number(v)]
            unit, factor = words.display_unit(error.unit, max(sizes, default=math.nan))
            cells = [words.format_number(v * factor) if words.is_number(v) else "–" for v in every]
            rows.append((run.recording if k == 0 else "", words.spoken_name(channel), unit, cells))
    return rows


_LEFT = {
    "noise": "left, no more than noise",
    "error": "left, inside the usual error of the model",
}
"""Words for the rest of a block's budget, where it is nothing unexplained."""


def _budget(diagnosis: Findings) -> list[tuple[str, list[dict[str, str]]]]:
    """Bars of the terms of each block's budget, each with its interval where the text has it."""
    blocks = {name: words.reported_terms(own) for name, own in words.budgets(diagnosis).items()}
    every = [v for own in blocks.values() for _, t in own for v in (t.share, *t.interval)]
    low, high = max(-1.0, min([0.0, *every])), min(2.5, max([1.0, *every]))

    def at(share: float) -> float:
        return 100.0 * (min(high, max(low, share)) - low) / (high - low)

    found = []
    for block, own in blocks.items():
        rows = []
        left = _LEFT.get(words.left_in(diagnosis, block), "")
        for name, term in own:
            ends = sorted((at(0.0), at(term.share)))
            first, last = at(term.interval[0]), at(term.interval[1])
            rows.append(
                {
                    "name": left if term.kind == "unexplained" and left else name,
                    "kind": term.kind,
                    "text": words.format_share(term.share),
                    "interval": words.format_interval(term.interval),
                    "bar": f"left:{ends[0]:.2f}%;width:{ends[1] - ends[0]:.2f}%",
                    "whisker": f"left:{first:.2f}%;width:{last - first:.2f}%",
                }
            )
        found.append((words.spoken_name(block), rows))
    return found


def _found(diagnosis: Findings) -> list[tuple[str, ...]]:
    """Rows of what was found: name, in the rig file, on the bench, value and interval, unit."""
    rows: list[tuple[str, ...]] = []
    for effect in diagnosis.effects:
        bench, vague = dict(story.bench_value(effect)), words.undetermined(effect)
        closest = "" if effect.term in diagnosis.answer.named else "not named, but closest: "
        for name, own in effect.parameters.items():
            if name in vague:
                continue
            title = f"{closest}{words.label(effect.term)}: {words.label(name)}"
            usual = bench.get(words.label(name)) or words.value_words(effect, name)
            on_bench = _typeset(usual)
            value = words.format_uncertain(own.value, own.std)
            rows.append((title, "", on_bench, value, _span(words.span95(own)), _unit(own.unit)))
        if vague:
            names = ", ".join(map(words.label, vague))
            title = f"{closest}{words.label(effect.term)}: not determined"
            rows.append((title, f"these recordings do not determine {names}"))
    for entry in diagnosis.wrong_parameters:
        unit, factor = words.display_unit(entry.unit, abs(entry.nominal))
        low, high = (float(v) * factor for v in entry.interval)
        stated = words.format_uncertain(entry.nominal * factor, entry.tolerance * factor)
        value = words.format_uncertain(entry.value * factor, entry.std * factor)
        far = f"{stated} ({_signed(entry.moved_sigmas)} tolerances)"
        rows.append((entry.name, far, "", value, _span((low, high), 4), _unit(unit)))
    return rows


def _limits(diagnosis: Findings) -> list[tuple[bool | str, ...]]:
    """Rows of sizes from which the recordings would have shown effects, and distinguished them;
    first of each, True where the effect is named.
    """
    return [
        (
            own.effect in diagnosis.answer.named,
            words.label(own.effect),
            words.spoken_name(own.block),
            words.label(own.size.rpartition(".")[2]),
            *words.limit_sizes(own)[1:],
            words.set_label([own.rival]) if own.rival else "",
        )
        for own in diagnosis.limits
    ]


def _curves(panels: list[figures.Panel], prefix: str) -> Markup | None:
    return Markup(figures.curves(panels, prefix)) if panels else None  # noqa: S704


def _recordings(diagnosis: Findings) -> tuple[list[dict[str, Any]], int]:
    """One fitted and one held-out recording with their figure, and how many are not shown."""
    telling = figures.telling_trace(diagnosis)
    groups: dict[tuple[str, str], list[Trace]] = {}
    for trace in diagnosis.traces:
        groups.setdefault((trace.role, trace.recording), []).append(trace)
    keys = list(groups)
    if telling is not None:
        keys.sort(key=lambda k: k != (telling.role, telling.recording))
    held = [k for k in keys if k[0] == "held_out"]
    chosen = [k for k in keys if k not in held][:1] + held[:1]
    shown = []
    for i, key in enumerate(chosen):
        traces = sorted(groups[key], key=lambda t: t.channel != diagnosis.where.channel)[:TRACES]
        shown.append(
            {
                "name": key[1],
                "role": "held out" if key[0] == "held_out" else "used for the fit",
                "curves": _curves(figures.trace_panels(diagnosis, traces), f"rec{i}"),
            }
        )
    return shown, len(groups) - len(shown)


def _missing(diagnosis: Findings) -> str | None:
    """The missing input, where there is one."""
    found = diagnosis.missing_input
    return None if found is None else figures.missing_svg(found)


def _markup(svg: str | None) -> Markup | None:
    return None if svg is None else Markup(svg)  # noqa: S704


def _value(value: object) -> str:
    """A value of an excitation; of several chains by their names."""
    if isinstance(value, Mapping):
        return "; ".join(f"{name}: {_value(own)}" for name, own in value.items())
    if words.is_number(value) and not isinstance(value, bool):
        return words.format_number(value)
    return str(value)


def _separating(diagnosis: Findings) -> Markup | None:
    """The curves of the next experiment, where it was simulated."""
    own = diagnosis.next_experiment.curves
    return _curves(figures.separating_panels(own), "next") if own else None


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
    losses, proposed = Losses(), diagnosis.next_experiment
    pictures = {
        name: _markup(losses.part(f"the picture of the {name}", partial(drawn, diagnosis)))
        for name, drawn in _PICTURES.items()
    }
    tables = {
        name: losses.part(f"the table of {name.replace('_', ' ')}", partial(made, diagnosis), [])
        for name, made in _TABLES.items()
    }
    recordings, hidden = losses.part(
        "the pictures of the recordings", partial(_recordings, diagnosis), ([], 0)
    )
    bits = proposed.expected_information_bits
    settings = getattr(diagnosis, "settings", None)
    page = partial(
        render_page,
        Path(__file__).with_name("template.html.j2"),
        script=Path(__file__).with_name("curves.js").read_text(encoding="utf-8"),
        d=diagnosis,
        w=words,
        badge=case_badge(diagnosis),
        title=_typeset(story.title(diagnosis)),
        headline=_typeset(story.headline(diagnosis)),
        paragraphs=[_typeset(p.strip()) for p in diagnosis.text.split("\n\n") if p.strip()],
        forms=list(
            dict.fromkeys(
                _typeset(form)
                for form in (
                    *(u.form for u in diagnosis.unexplained),
                    *(e.correction for e in diagnosis.effects),
                )
                if form
            )
        ),
        conditions=[c for c in diagnosis.where.conditions if c.share >= _LEAST_CONDITION],
        stages=words.shown_stages(diagnosis),
        final=diagnosis.answer.model,
        yours=diagnosis.answer.model == YOURS,
        # said above already, where the text has it
        where_text="" if diagnosis.where.text in diagnosis.text else diagnosis.where.text,
        bits=words.format_number(bits, 2) if words.is_number(bits) else "",
        recordings=recordings,
        hidden=hidden,
        free_head=figures.free_head(diagnosis),
        record=story.next_to_do(diagnosis).split(": ", 1) if story.next_to_do(diagnosis) else [],
        settings=settings.to_dict() if settings is not None else {},
        date=datetime.now().astimezone().isoformat(" ", "minutes"),
        data=". ".join(
            filter(None, (words.data_sentence(diagnosis), words.left_out_sentence(diagnosis)))
        ),
        guarded=lambda what, caller: losses.part(f"the table of {what}", caller, ""),
        cells={"share": _share, "value": _value, "typeset": _typeset},
        verdict=partial(_verdict, diagnosis),
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
_PICTURES: Final[dict[str, Callable[[Findings], str | None]]] = {
    "chain": chain_svg,
    "missing": _missing,
    "first": lambda diagnosis: _curves(figures.free_panels(diagnosis), "free"),
    "separating": _separating,
}
_TABLES: Final[dict[str, Callable[[Findings], list[Any]]]] = {
    "facts": story.facts,
    "to_do": story.to_do,
    "rivals": story.rivals,
    "found": _found,
    "budget": _budget,
    "intervals": _intervals,
    "limits": _limits,
    "free_run": _free_run,
    "fits": _fits,
    "parameters": _parameters,
}
