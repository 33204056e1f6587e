"""A diagnosis as plain text for a terminal, and as a few lines for a notebook."""

from __future__ import annotations

import html
import textwrap
from collections.abc import Iterable

from pamrs.findings import Findings
from pamrs.report import sentences
from pamrs.report.words import (
    blocks_label,
    error_cells,
    format_probability,
    format_uncertain,
    plain,
)
from pamrs.units import with_unit


def _laid(
    texts: Iterable[str], head: str = "", *, rest: str = "  ", blank: bool = False
) -> list[str]:
    """Lines of paragraphs, narrower than the usual 100 letters of a terminal, so that none is
    broken there.
    """
    lines = [
        line
        for text in texts
        for line in textwrap.wrap(text, 96, initial_indent=head, subsequent_indent=rest)
    ]
    return ["", *lines] if blank and lines else lines


def summary(diagnosis: Findings) -> str:
    """Return the result as plain text for a terminal."""
    said = {k: list(filter(None, make(diagnosis))) for k, make in sentences.SENTENCES.items()}
    more = len(diagnosis.warnings) - 3
    lines = [
        f"Diagnosis of {diagnosis.case}",
        *_laid(said["headline"], rest=""),
        *_laid(f"{own}." for own in said["left_out"]),
        *_laid(said["where"], "where  ", rest=" " * 7, blank=True),
        *_probabilities(diagnosis),
        *_effects(diagnosis),
        *(line for own in said["wrong_parameters"] for line in _laid([own], rest="", blank=True)),
        *_laid(said["budget"], blank=True),
        *_laid(said["budget_note"], "  "),
        *_fit(diagnosis),
        *_laid(said["free_run"]),
        *_laid(said["unexplained"], "Unexplained: "),
        *_laid(said["considered"], "Asked for: "),
        *(line for own in said["left"] for line in _laid([own], "Not separable: ", blank=True)),
        *_laid(said["to_do"], "On the bench: "),
        *_laid(said["next_experiment"], "Next experiment: ", blank=True),
        *_laid(said["pairs"], "  ", rest="    "),
        *_laid(said["data"], blank=True),
        *_laid(diagnosis.warnings[:3], "Warning: "),
        *_laid([f"({more} more warnings in the report)"] * (more > 0)),
        f"{diagnosis.seconds:.1f} s",
    ]
    return "\n".join(lines)


def _probabilities(diagnosis: Findings) -> list[str]:
    """Bars of each group of blocks with a mismatch."""
    lines = []
    for part, chances in sentences.bars(diagnosis):
        ranked = sentences.ranked_probabilities(chances, 5)
        rows = [(sentences.explanation_label(part, name), p) for name, p in ranked]
        width = min(max([38, *(len(name) for name, _ in rows)]), 56)
        heads = [f"{blocks_label(part.group)}:"] if part and len(diagnosis.judged) > 1 else []
        lines += ["", *heads] if rows else []
        lines += [
            f"{name:<{width}.{width}} {format_probability(p):>7}  {'#' * round(30 * p)}".rstrip()
            for place, (name, p) in enumerate(rows)
            if place == 0 or p >= 0.005
        ]
    return lines


def _effects(diagnosis: Findings) -> list[str]:
    """Effects with the values that the recordings determine."""
    lines = []
    for effect in diagnosis.effects:
        lines += ["", sentences.effect_heading(diagnosis, effect)]
        for name, own, usual in sentences.effect_values(effect, own_units=True):
            value = plain(format_uncertain(own.value, own.std))
            line = with_unit(f"  {name} = {value}", own.unit)
            lines.append(f"{line}: {usual}" if usual else line)
        lines += _laid([sentences.undetermined_sentence(effect)], "  ", rest="    ")
    return lines


def _fit(diagnosis: Findings) -> list[str]:
    """Error table of the held-out recordings, else of the fitted ones."""
    if not diagnosis.proven:
        return []
    title = "held-out error" if diagnosis.fit.held_out else "error (fit)"
    stages = sentences.shown_stages(diagnosis)
    lines = ["", f"{title:<22}{''.join(f'{name:>11}' for name in stages.values())}"]
    for channel, unit, cells, _ in error_cells(diagnosis.proven):
        name = with_unit(channel, plain(f"[{unit}]") if unit else "")
        lines.append(f"{name:<22}{''.join(f'{plain(cells[stage]):>11}' for stage in stages)}")
    return lines


def notebook(diagnosis: Findings) -> str:
    """Short HTML for notebooks."""
    part, chances = sentences.bars(diagnosis)[0]
    rows = "".join(
        f"<tr><td style='text-align:left'>{html.escape(sentences.explanation_label(part, name))}"
        "</td>"
        f"<td>{html.escape(format_probability(p))}</td>"
        f"<td style='text-align:left'><span style='display:inline-block;height:.7em;"
        f"width:{max(0.0, min(1.0, p)) * 12:.2f}em;background:#0072b2'></span></td></tr>"
        for name, p in sentences.ranked_probabilities(chances, 5)
    )
    mended = html.escape(sentences.mended_sentence(diagnosis, "With what was found"))
    return (
        f"<div><p><b>{html.escape(sentences.headline(diagnosis))}.</b></p>"
        f"<p>{html.escape(diagnosis.where.text)}</p>"
        f"<table>{rows}</table>{f'<p>{mended}</p>' if mended else ''}"
        "<p><code>.report(&quot;report.html&quot;)</code> writes the whole story.</p></div>"
    )
