"""The report page: gathers what the template shows. Import through `pamrs.report`."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any, Final

from markupsafe import Markup

from pamrs._losses import Losses
from pamrs.channels import UNITS, channel_of
from pamrs.findings import ChannelError, Findings, Trace
from pamrs.report import figures
from pamrs.report import text as words
from pamrs.report.chain import chain_svg
from pamrs.report.page import render_page

__all__ = ["render"]

HELD_OUT_SHOWN = 2
WARNINGS_SHOWN = 6
THROUGHOUT = 0.9
"""Share of a recording from which an excess is throughout it."""
BADGES = {
    "none": "nothing missing",
    "parameters": "parameters inside their tolerances",
    "effects": "missing physics named",
    "unlisted": "missing physics, not in the catalogue",
    "units": "a channel is in another unit",
}


OPEN_BADGES = {
    "none": "nothing missing, but not settled",
    "parameters": "parameters or physics, not settled",
    "effects": "missing physics, the name is not settled",
    "unlisted": "missing physics, no name",
    "units": "a channel is in another unit",
}
"""The same where several answers are left."""

WRONG, PERHAPS_WRONG = "a value of the rig file is wrong", "a value of the rig file may be wrong"
"""Badges of the verdict ``parameters`` where a value is named."""


def _badge(verdict: str, *, wrong: bool, is_open: bool) -> str:
    """A verdict in a few words, no surer than it is."""
    if wrong and verdict == "parameters":
        return PERHAPS_WRONG if is_open else WRONG
    return (OPEN_BADGES if is_open else BADGES)[verdict]


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


def _effects(diagnosis: Findings) -> list[dict[str, Any]]:
    rows = []
    for effect in diagnosis.effects:
        parameters = []
        for name, p in effect.parameters.items():
            known = p.identifiable is not False and words.is_number(p.value)
            parameters.append(
                {
                    "name": words.label(name),
                    "known": known,
                    "value": words.format_uncertain(p.value, p.std),
                    "interval": _span(words.span95(p)),
                    "unit": _unit(p.unit),
                }
            )
        rows.append(
            {
                "id": effect.id,
                "name": words.effect_heading(diagnosis, effect),
                "probability": words.name_chance(diagnosis, effect),
                "inclusion": "" if effect.inclusion is None else f"{100 * effect.inclusion:.0f} %",
                "parameters": parameters,
            }
        )
    return rows


def _blocks(diagnosis: Findings) -> list[dict[str, Any]]:
    """The verdict of each group of blocks, and what each block misses before and after."""
    rows = []
    for entry in diagnosis.judged:
        found = [*entry.effects, *entry.wrong_parameters]
        leading, chance = max(
            entry.probabilities.items(), key=lambda kv: kv[1], default=("none", math.nan)
        )
        sizes = []
        for block in entry.mismatch:
            part = block.held_out or block.fitted
            unit, factor = words.display_unit(block.unit, abs(part.refit.size))
            shown = [
                (
                    f"{words.format_number(s.noises, 2)} "
                    f"({words.format_number(s.size * factor, 2)} {unit})"
                )
                if s.more_than_noise
                else "noise only"
                for s in (part.refit, part.after)
            ]
            sizes.append(
                {
                    "block": words.spoken_name(block.block),
                    "refit": shown[0],
                    "after": shown[1],
                }
            )
        rows.append(
            {
                "verdict": _badge(
                    entry.verdict,
                    wrong=bool(entry.wrong_parameters),
                    is_open=len(entry.ambiguity) > 1,
                ),
                "names": words.set_label(found) if found else "–",
                "probability": words.format_probability(chance),
                "leading": words.hypothesis_label(leading),
                "sizes": sizes,
            }
        )
    return rows


def _not_judged(diagnosis: Findings) -> list[dict[str, str]]:
    """Blocks that were not judged, and why."""
    return [
        {"block": words.blocks_label(b), "covers": b.covers, "why": b.reason}
        for b in diagnosis.not_judged
    ]


def _wrong(diagnosis: Findings) -> list[dict[str, Any]]:
    """Values of the rig file that are wrong."""
    rows = []
    for entry in diagnosis.wrong_parameters:
        unit, factor = words.display_unit(entry.unit, abs(entry.nominal))
        errors = []
        for channel, error in entry.held_out.items():
            shown, scale = words.display_unit(
                UNITS.get(channel_of(channel), ""), max(error.values())
            )
            before, after = (words.format_number(error[key] * scale) for key in ("refit", "after"))
            errors.append(f"{words.spoken_name(channel)}: {before} to {after} {shown}")
        interval = [float(v) * factor for v in entry.interval]
        rows.append(
            {
                "name": entry.name,
                "unit": _unit(unit),
                "stated": words.format_uncertain(entry.nominal * factor, entry.tolerance * factor),
                "value": words.format_uncertain(entry.value * factor, entry.std * factor),
                "interval": _span((interval[0], interval[1]), 4),
                "moved": f"{entry.moved_sigmas:+.1f}".replace("-", "−"),
                "probability": words.name_chance(diagnosis, entry),
                "errors": "; ".join(errors),
            }
        )
    return rows


def _tested(diagnosis: Findings) -> list[dict[str, str]]:
    """Effects that were tested, in percent of the mismatch."""

    def percent(share: float | None) -> str:
        return (
            "not fitted"
            if share is None
            else "all"
            if share >= 1.0
            else f"{100 * share:.0f} %"
            if share > 0.005
            else "under 1 %"
        )

    return [
        {
            "name": words.label(a.id),
            "blocks": ", ".join(a.blocks),
            "predicted_gain": percent(a.predicted_gain),
            "left": percent(a.left),
        }
        for a in diagnosis.tested
    ]


def _intervals(diagnosis: Findings) -> list[str]:
    """Where in time the excess is, in words."""
    spans = [(float(a), float(b)) for a, b in diagnosis.where.intervals]
    told = next((t for t in diagnosis.traces if t.recording == diagnosis.where.recording), None)
    if told is not None and sum(b - a for a, b in spans) > THROUGHOUT * float(
        told.time[-1] - told.time[0]
    ):
        return ["throughout the recording"]
    return [f"{a:.2f} to {b:.2f} s" for a, b in spans]


def _parameters(diagnosis: Findings) -> list[dict[str, Any]]:
    rows = []
    for name, p in diagnosis.parameters.items():
        known = p.identifiable is not False
        moved = p.moved_sigmas
        flag = ""
        if name in {w.name for w in diagnosis.wrong_parameters}:
            flag = "the rig file is wrong"
        elif not known:
            flag = "not determined by these recordings"
        elif abs(moved) >= 3:
            flag = "outside its tolerance"
        elif abs(moved) >= 2:
            flag = "at the edge of its tolerance"
        rows.append(
            {
                "name": name,
                "nominal": words.format_number(p.nominal, 4),
                "value": words.format_uncertain(p.value, p.std) if known else "–",
                "unit": _unit(p.unit),
                "moved": f"{moved:+.1f}".replace("-", "−")
                if known and math.isfinite(moved)
                else "–",
                "bar": min(1.0, abs(moved) / 4.0) if known and math.isfinite(moved) else 0.0,
                "right": moved >= 0,
                "flag": flag,
                "known": known and math.isfinite(moved),
                "alarm": known and abs(moved) >= 3,
            }
        )
    return rows


def _fit(errors: dict[str, ChannelError]) -> list[dict[str, Any]]:
    rows = []
    for channel, entry in errors.items():
        sizes = [abs(float(v)) for v in entry.values() if words.is_number(v)]
        unit, factor = words.display_unit(
            UNITS.get(channel_of(channel), ""), max(sizes, default=math.nan)
        )
        noise = entry.noise
        cells = []
        for key in ("noise", "before", "refit", "after"):
            value = entry[key]
            good = words.is_number(value)
            ratio = (
                float(value) / float(noise)
                if good and words.is_number(noise) and float(noise) > 0
                else math.nan
            )
            times = "–" if math.isnan(ratio) else f"{words.format_number(ratio, 2)}×"
            shown = words.format_number(float(value) * factor) if good else "–"
            cells.append({"key": key, "value": shown, "times": "" if key == "noise" else times})
        rows.append({"channel": words.spoken_name(channel), "unit": unit, "cells": cells})
    return rows


def _fits(diagnosis: Findings) -> list[tuple[str, list[dict[str, Any]]]]:
    """The tables of errors with their titles."""
    tables = (
        ("Held-out recordings (not used for the fit)", _fit(diagnosis.fit.held_out)),
        ("Fitted recordings", _fit(diagnosis.fit.channels)),
    )
    return [(title, rows) for title, rows in tables if rows]


def _sets(diagnosis: Findings) -> list[tuple[str, str]]:
    """The sets that are left, each with its probability: as the headline has it, by the one group
    of blocks that is open, else that of the case.
    """
    is_open = [b for b in diagnosis.judged if len(b.ambiguity) > 1]
    own = is_open[0].probabilities if len(is_open) == 1 else {}
    found = []
    for names in diagnosis.ambiguity:
        chance = words.chance_of(own, names)
        if not words.is_number(chance):
            chance = words.chance_of(diagnosis.probabilities, names)
        found.append((words.set_label(names), words.format_probability(chance)))
    return found


def _free_run(diagnosis: Findings) -> list[dict[str, Any]]:
    """Errors of free runs beside those of the cut chain, channel by channel."""
    rows = []
    for run in diagnosis.free_run or []:
        for k, (channel, error) in enumerate(run.channels.items()):
            every = (error.before, error.after, error.cut_before, error.cut_after)
            sizes = [abs(v) for v in every if words.is_number(v)]
            unit, factor = words.display_unit(error.unit, max(sizes, default=math.nan))
            cells = [words.format_number(v * factor) if words.is_number(v) else "–" for v in every]
            rows.append(
                {
                    "recording": run.recording if k == 0 else "",
                    "channel": words.spoken_name(channel),
                    "unit": unit,
                    "cells": cells,
                }
            )
    return rows


def _free_notes(diagnosis: Findings) -> list[str]:
    """What is missing among the free runs, and why."""
    notes = [f"{run.recording}: {run.note}" for run in diagnosis.free_run or [] if run.note]
    return [*notes, *([diagnosis.free_run_note] if diagnosis.free_run_note else [])]


def _recordings(diagnosis: Findings) -> tuple[list[dict[str, Any]], int]:
    """One fitted and up to two held-out recordings with their figure, and how many are not
    shown.
    """
    telling = figures.telling_trace(diagnosis)
    groups: dict[tuple[str, str], list[Trace]] = {}
    for trace in diagnosis.traces:
        groups.setdefault((trace.role, trace.recording), []).append(trace)
    keys = list(groups)
    if telling is not None:
        keys.sort(key=lambda k: k != (telling.role, telling.recording))
    chosen = [k for k in keys if k[0] != "held_out"][:1] + [k for k in keys if k[0] == "held_out"][
        :HELD_OUT_SHOWN
    ]
    shown = []
    for i, key in enumerate(chosen):
        traces = sorted(groups[key], key=lambda t: t.channel != diagnosis.where.channel)
        shown.append(
            {
                "name": key[1],
                "role": "held out" if key[0] == "held_out" else "used for the fit",
                "svg": Markup(figures.traces_svg(diagnosis, traces, f"rec{i}")),  # noqa: S704
            }
        )
    return shown, len(groups) - len(shown)


def _probabilities(diagnosis: Findings) -> list[tuple[str, list[dict[str, Any]]]]:
    """The bars of each group of blocks with a mismatch, under its name where there are several
    groups.
    """
    several = len(diagnosis.judged) > 1
    return [
        (
            words.blocks_label(block) if several else "",
            [
                {
                    "name": words.hypothesis_label(name),
                    "text": words.format_probability(p),
                    "width": f"{100 * max(0.0, min(1.0, p)):.1f}",
                    "named": words.is_named(block, name),
                }
                for name, p in words.ranked_probabilities(block.probabilities, 8)
            ],
        )
        for block in words.told_probabilities(diagnosis)
        if block.probabilities
    ]


def _markup(svg: str | None) -> Markup | None:
    return None if svg is None else Markup(svg)  # noqa: S704


def _facts(diagnosis: Findings) -> list[tuple[str, str]]:
    """The few numbers under the headline."""
    facts = []
    answer, chance = words.leading(diagnosis)
    if words.is_number(chance):
        facts.append((words.format_probability(chance), f"probability: {answer}"))
    gap = diagnosis.fit.gap_closed
    if words.is_number(gap):
        facts.append(
            (
                f"{100 * float(gap):.0f} %".replace("-", "−"),
                f"of the gap to the noise closed over all channels on {diagnosis.proof}",
            )
        )
    if diagnosis.where.block:
        channel = diagnosis.where.channel
        seen = f"block; seen in {words.spoken_name(channel)}" if channel else "block"
        facts.append((words.spoken_name(diagnosis.where.block), seen))
    facts.append(
        (
            f"{diagnosis.seconds:.0f} s"
            if diagnosis.seconds >= 10
            else f"{diagnosis.seconds:.1f} s",
            "computing time",
        )
    )
    return facts


def _excitation(diagnosis: Findings) -> list[tuple[str, str]]:
    content = diagnosis.next_experiment.excitation
    return [(words.label(str(k)), _value(v)) for k, v in content.items()]


def _value(value: object) -> str:
    """A value of an excitation; of several chains by their names."""
    if isinstance(value, Mapping):
        return "; ".join(f"{name}: {_value(own)}" for name, own in value.items())
    if words.is_number(value) and not isinstance(value, bool):
        return words.format_number(value)
    return str(value)


def _separating(diagnosis: Findings) -> str | None:
    """The curves of the next experiment, where it was simulated."""
    curves = diagnosis.next_experiment.curves
    return figures.separating_curves(curves) if curves else None


def _pairs(diagnosis: Findings) -> list[tuple[str, str]]:
    """What tells each two hypotheses that are left open apart."""
    return [
        (" or ".join(words.hypothesis_label(name) for name in pair.between), text)
        for pair, text in words.told_pairs(diagnosis)
    ]


def _ranking(diagnosis: Findings) -> list[dict[str, str]]:
    """The experiments that were compared, the most telling first."""
    return [
        {
            "name": words.label(entry.name)
            + (f" with {words.label(entry.sensor)}" if entry.sensor else ""),
            "bits": words.format_number(entry.bits, 2),
            "effort": f"{entry.effort_s / 60.0:.1f} min",
        }
        for entry in diagnosis.next_experiment.ranking
    ]


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
    bits = diagnosis.next_experiment.expected_information_bits
    shown = diagnosis.condition_map.block if diagnosis.condition_map else ""
    warnings = [*losses.told, *diagnosis.warnings]
    return render_page(
        Path(__file__).with_name("template.html.j2"),
        d=diagnosis,
        badge=_badge(
            diagnosis.verdict,
            wrong=bool(diagnosis.wrong_parameters),
            is_open=words.is_open(diagnosis),
        ),
        headline=_typeset(words.claim(diagnosis)),
        paragraphs=[_typeset(p.strip()) for p in diagnosis.text.split("\n\n") if p.strip()],
        warnings=(warnings[:WARNINGS_SHOWN], warnings[WARNINGS_SHOWN:]),
        # said above already, where the text has it
        where_text="" if diagnosis.where.text in diagnosis.text else diagnosis.where.text,
        conditions=[condition.text for condition in diagnosis.where.conditions],
        map_block=words.spoken_name(shown or diagnosis.where.block or ""),
        budget_note=words.BUDGET_NOTE,
        experiment=diagnosis.next_experiment.text,
        bits=words.format_number(bits, 2) if words.is_number(bits) else "",
        recordings=recordings,
        hidden=hidden,
        timings=[(words.label(k), f"{float(v):.1f} s") for k, v in diagnosis.timings.items()],
        data=". ".join(
            text
            for text in (words.data_sentence(diagnosis), words.left_out_sentence(diagnosis))
            if text
        ),
        model=diagnosis.model,
        **pictures,
        **tables,
    )


def _budgets(diagnosis: Findings) -> list[str]:
    """What takes the mismatch of each block, in words."""
    return [
        f"{words.spoken_name(block)}: {sentence}"
        for block, sentence in words.budget_sentences(diagnosis)
    ]


#: What the template calls each, and what makes it.
_PICTURES: Final[dict[str, Callable[[Findings], str | None]]] = {
    "chain": chain_svg,
    "blocks": figures.blocks_svg,
    "map": figures.map_svg,
    "budget": figures.budget_svg,
    "separating": _separating,
}
_TABLES: Final[dict[str, Callable[[Findings], list[Any]]]] = {
    "facts": _facts,
    "intervals": _intervals,
    "free_run": _free_run,
    "free_notes": _free_notes,
    "probabilities": _probabilities,
    "effects": _effects,
    "verdicts": _blocks,
    "not_judged": _not_judged,
    "budgets": _budgets,
    "wrong": _wrong,
    "kept": lambda diagnosis: [words.kept_details(u) for u in diagnosis.unexplained],
    "considered": lambda d: [words.considered_sentence(asked) for asked in d.considered],
    "ambiguity": _sets,
    "tested": _tested,
    "excitation": _excitation,
    "ranking": _ranking,
    "pairs": _pairs,
    "fits": _fits,
    "parameters": _parameters,
}
