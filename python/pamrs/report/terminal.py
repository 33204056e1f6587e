"""A diagnosis as plain text for a terminal, and as a few lines for a notebook."""

from __future__ import annotations

import html
import textwrap
from functools import partial
from typing import Final

from pamrs.findings import YOURS, Findings
from pamrs.report import story
from pamrs.report import text as words
from pamrs.units import with_unit

_wrapped = partial(textwrap.wrap, width=96, subsequent_indent="  ")
"""A paragraph: narrower than the usual 100 letters of a terminal, so that none is broken there."""
_ASCII: Final = str.maketrans({"°": "deg", "−": "-", "–": "-", "×": "x"})
"""Signs that a terminal may lack."""


def summary(diagnosis: Findings) -> str:
    """Return the result as plain text for a terminal."""
    lines = [f"Diagnosis of {diagnosis.case}", *textwrap.wrap(story.headline(diagnosis) + ".", 96)]
    left_out = words.left_out_sentence(diagnosis)
    lines += _wrapped(left_out + "." * bool(left_out))
    where = diagnosis.where.text
    if where:
        lines += [
            "",
            *textwrap.wrap(where, 96, initial_indent="where  ", subsequent_indent=" " * 7),
        ]
    lines += _probabilities(diagnosis)
    for effect in diagnosis.effects:
        lines.append("")
        lines.append(words.effect_heading(diagnosis, effect))
        bench = dict(story.bench_value(effect, own_units=True))
        vague = words.undetermined(effect)
        for name, own in effect.parameters.items():
            if name not in vague:
                value = words.format_uncertain(own.value, own.std, unicode=False)
                line = with_unit(f"  {name} = {value}", own.unit)
                usual = bench.get(words.label(name)) or words.value_words(effect, name)
                lines.append(f"{line}: {usual}" if usual else line)
        if vague:
            names = f"  these recordings do not determine {', '.join(vague)}"
            lines += textwrap.wrap(names, 96, subsequent_indent="    ")
    for wrong in diagnosis.wrong_parameters:
        lines += ["", *textwrap.wrap(words.sentence_of(wrong), 96)]
    lines += _budget(diagnosis)
    lines += _fit(diagnosis)
    lines += _free_run(diagnosis)
    for kept in diagnosis.unexplained:
        lines += _wrapped(f"Unexplained: {words.kept_sentence(kept)}")
    for asked in diagnosis.considered:
        lines += _wrapped(f"Asked for: {words.considered_sentence(asked)}")
    for part in diagnosis.answer.parts:
        if len(part.left) > 1:
            sets = "; ".join(words.answer_label(own) for own, _ in part.left)
            lines += ["", *_wrapped(f"Not separable: {sets}.")]
    for instruction in story.to_do(diagnosis):
        lines += _wrapped(f"On the bench: {instruction}")
    lines += _next(diagnosis)
    rests = words.data_sentence(diagnosis)
    lines += ["", *_wrapped(rests)] if rests else []
    for warning in diagnosis.warnings[:3]:
        lines += _wrapped(f"Warning: {warning}")
    if len(diagnosis.warnings) > 3:
        lines.append(f"({len(diagnosis.warnings) - 3} more warnings in the report)")
    lines.append(f"{diagnosis.seconds:.1f} s")
    return "\n".join(lines)


def _probabilities(diagnosis: Findings) -> list[str]:
    """Bars of each group of blocks with a mismatch."""
    lines = []
    for part, chances in words.bars(diagnosis):
        rows = words.ranked_probabilities(chances, 5)
        if rows:
            lines.append("")
        if rows and len(diagnosis.judged) > 1 and part:
            lines.append(f"{words.blocks_label(part.group)}:")
        names = [words.hypothesis_label(name) for name, _ in rows]
        width = min(max(38, *map(len, names)), 56) if names else 38
        lines += [
            (
                f"{words.hypothesis_label(name):<{width}.{width}} "
                f"{words.format_probability(p):>7}  {'#' * round(30 * p)}"
            ).rstrip()
            for place, (name, p) in enumerate(rows)
            if place == 0 or p >= 0.005
        ]
    return lines


def _free_run(diagnosis: Findings) -> list[str]:
    """The whole rig from its commands alone, one line for each of the first recordings."""
    lines = []
    for run in (diagnosis.free_run or [])[:2]:
        errors = []
        for channel, error in run.channels.items():
            unit, factor = words.display_unit(error.unit, error.before)
            before, after = (
                words.format_number(v * factor, unicode=False) for v in (error.before, error.after)
            )
            to = f" to {after}" if diagnosis.answer.model != YOURS else ""
            errors.append(f"{channel} {before}{to} {unit}")
        text = f"Whole rig from its commands alone, {run.recording}: {'; '.join(errors)}"
        lines += _wrapped(text.translate(_ASCII))
    return lines


def _budget(diagnosis: Findings) -> list[str]:
    """Lines on what takes the mismatch of each block."""
    lines = []
    for block, sentence in words.budget_sentences(diagnosis):
        text = f"Budget of the {words.spoken_name(block)}: {sentence}".translate(_ASCII)
        lines += _wrapped(text)
    # where parameters alone take all there is nothing to read wrongly
    shares = [t for t in diagnosis.budget if t.kind != "unexplained"]
    plain = all(t.kind == "parameters" and 0.0 <= t.share <= 1.0 for t in shares)
    note = "" if plain else f"({words.BUDGET_NOTE})"
    lines += textwrap.wrap(note, 96, initial_indent="  ", subsequent_indent="  ")
    return ["", *lines] if lines else []


def _next(diagnosis: Findings) -> list[str]:
    """Lines on what to record next, and on what separates the leading hypothesis from others."""
    own = diagnosis.next_experiment
    if not own.text:
        return []
    lines = ["", *_wrapped(f"Next experiment: {own.text}")]
    for pair, text in words.pair_texts(diagnosis):
        if own.pairs[0].between[0] in pair.between:
            between = " or ".join(words.hypothesis_label(name) for name in pair.between)
            question = f"{between}? {text}"
            lines += textwrap.wrap(question, 96, initial_indent="  ", subsequent_indent="    ")
    return lines


def _fit(diagnosis: Findings) -> list[str]:
    """Error table of the held-out recordings, else of the fitted ones."""
    channels = diagnosis.fit.held_out or diagnosis.fit.channels
    if not channels:
        return []
    title = "held-out error" if diagnosis.fit.held_out else "error (fit)"
    stages = words.shown_stages(diagnosis)
    lines = ["", f"{title:<22}{''.join(f'{name:>11}' for name in stages.values())}"]
    for channel, unit, factor, entry in words.shown_errors(channels):
        name = with_unit(channel, f"[{unit.replace('°', 'deg')}]" if unit else "")
        sizes = (entry[stage] for stage in stages)
        shown = [v * factor if words.is_number(v) else None for v in sizes]
        cells = (f"{words.format_number(v, unicode=False):>11}" for v in shown)
        lines.append(f"{name:<22}{''.join(cells)}")
    return lines


def notebook(diagnosis: Findings) -> str:
    """Short HTML for notebooks."""
    rows = "".join(
        f"<tr><td style='text-align:left'>{html.escape(words.hypothesis_label(name))}</td>"
        f"<td>{html.escape(words.format_probability(p))}</td>"
        f"<td style='text-align:left'><span style='display:inline-block;height:.7em;"
        f"width:{max(0.0, min(1.0, p)) * 12:.2f}em;background:#0072b2'></span></td></tr>"
        for name, p in words.ranked_probabilities(words.bars(diagnosis)[0][1], 5)
    )
    mended = words.mended_sentence(diagnosis, "With what was found")
    closed = f"<p>{html.escape(mended)}, on {diagnosis.proof}.</p>" if mended else ""
    where = html.escape(diagnosis.where.text)
    return (
        f"<div><p><b>{html.escape(story.headline(diagnosis))}.</b></p><p>{where}</p>"
        f"<table>{rows}</table>{closed}"
        "<p><code>.report(&quot;report.html&quot;)</code> writes the whole story.</p></div>"
    )
