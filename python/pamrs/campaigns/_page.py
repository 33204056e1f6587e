"""Pages of a campaign: why each run, what it changed, what is still open."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

from markupsafe import Markup
from matplotlib.figure import Figure

from pamrs._views import decimate
from pamrs._writing import write_atomically
from pamrs.campaigns._folder import Folder, Step, columns_of
from pamrs.channels import laboratory_unit
from pamrs.report.figures import HYPOTHESES, svg_text
from pamrs.report.page import render_page
from pamrs.report.words import format_probability, hypothesis_label, listed, set_label, spoken_name

_TEMPLATE: Final = Path(__file__).with_name("page.html.j2")
_MOST_PANELS: Final = 4


def write_pages(folder: Folder) -> None:
    """Write a page of the last step, and one of the whole campaign."""
    entries = [_entry(folder, step) for step in folder.steps]
    if entries:
        last = folder.steps[-1]
        own = [{**entries[-1], "report": "report.html" if last.after else ""}]
        title = f"Step {last.number}: {last.name.replace('_', ' ')}"
        write_atomically(folder.home(last) / "page.html", _page(folder, title, own, ""))
    text = folder.ended.get("text", "")
    write_atomically(folder.path / "campaign.html", _page(folder, "All steps", entries, text))


def _page(folder: Folder, title: str, steps: list[dict[str, Any]], ended: str) -> str:
    return render_page(_TEMPLATE, title=title, rig=folder.rig.name, steps=steps, ended=ended)


def _entry(folder: Folder, step: Step) -> dict[str, Any]:
    """Text of a step on its page."""
    before, after = step.before or {}, step.after or {}
    chances = [own.get("probabilities", {}) for own in (before, after)]
    names = list(dict.fromkeys([*chances[1], *chances[0]]))
    rivals = [
        {
            "name": hypothesis_label(own["label"]),
            "probability": format_probability(own["probability"]),
            "left": _left(step, own["label"]),
        }
        for own in step.rivals
    ]
    return {
        **vars(step),
        "rivals": rivals,
        "telling": spoken_name(step.telling) if step.telling else "run",
        "verdict": "" if step.changed else "This run changed nothing that counts.",
        "probabilities": [
            (hypothesis_label(name), *(format_probability(own.get(name)) for own in chances))
            for name in names
        ],
        "open": _open(after),
        "picture": _picture(folder, step),
        "report": f"step_{step.number:02d}/report.html" if step.after else "",
    }


def _left(step: Step, label: str) -> str:
    """Noise levels that a rival left of the telling channel, in words."""
    if not step.telling:
        return ""
    if label not in step.scores:
        return "leaves its range"
    return f"{step.scores[label][step.telling]:.2g}"


def _open(after: dict[str, Any]) -> str:
    """Open questions, in words."""
    questions = (
        [f"{' or '.join(map(set_label, after['ambiguity']))}"] if after.get("ambiguity") else []
    )
    if after and not after["settled"] and not questions:
        questions.append("the answer is not settled")
    if after.get("unseen"):
        effects = listed([hypothesis_label(name) for name in after["unseen"]])
        questions.append(f"even if there, not seen at the usual size: {effects}")
    return "; ".join(questions) + "." if questions else "Nothing."


def _picture(folder: Folder, step: Step) -> Markup:
    """The commands, and what was measured over what every rival foretold."""
    home, panels = folder.home(step), dict[str, list[tuple[Any, Any, str, str]]]()
    labels = [f"if {hypothesis_label(own['label'])}" for own in step.rivals]
    colours = dict(zip(labels, HYPOTHESES, strict=False))

    def add(name: str, time: Any, values: Any, label: str) -> None:
        unit, factor = laboratory_unit(name)
        line = (*decimate(time, factor * values), label, colours.get(label, "0.2"))
        panels.setdefault(f"{spoken_name(name)} [{unit}]", []).append(line)

    for file in (home / "commands.csv", home / "foretold.csv"):
        time, *others = columns_of(file).items() if file.exists() else [("", None)]
        for head, values in others:
            rival = head.partition(" if ")[2]
            add(head.partition(" [")[0], time[1], values, f"if {rival}" if rival else "sent")
    if step.finished:
        recording = folder.recording(step)
        for name, values in recording.channels.items():
            add(name, recording.time, values, "measured")
    shown = list(panels.items())[:_MOST_PANELS]
    if not shown:
        return Markup("")
    figure = Figure(figsize=(8.0, 1.7 * len(shown)), layout="constrained")
    every = figure.subplots(len(shown), 1, sharex=True, squeeze=False)[:, 0]
    for axes, (title, lines) in zip(every, shown, strict=True):
        for time, values, label, colour in lines:
            axes.plot(time, values, color=colour, lw=1.0, label=label)
        axes.set_ylabel(title, fontsize="small")
    every[-1].legend(fontsize="x-small", frameon=False)
    every[-1].set_xlabel("time [s]")
    return Markup(svg_text(figure, f"step-{step.number}"))  # noqa: S704
