"""Drawing of the rig's chain from supply to joint: what was measured, what was judged together, and
where the mismatch is. An SVG element, made from the structure of the rig.
"""

from __future__ import annotations

import textwrap
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from matplotlib.axes import Axes
from matplotlib.patches import Rectangle

from pamrs.channels import dotted
from pamrs.effects import EFFECTS
from pamrs.findings import BlockMismatch, Findings
from pamrs.report.figures import COLOURS
from pamrs.report.page import render_page
from pamrs.report.sentences import refit_words, unsure_names
from pamrs.report.words import label
from pamrs.rig import Rig

COLUMN, BOX, LINE, PAD, GAP = 186.0, 134.0, 17.0, 14.0, 34.0
"""Distance of columns, width of a box, height of a line of text, margin of a frame and distance of
rows [px]."""

KINDS = ("supply", "valve", "line", "chamber", "muscle", "joint", "load")
"""Kinds of blocks that are drawn; transmissions, arms and links go with their joint."""

CHANNELS = {
    "supply": ("supply_command", "supply_pressure"),
    "valve": ("valve_command",),
    "line": ("line_pressure",),
    "chamber": ("muscle_pressure", "temperature", "air_flow"),
    "muscle": ("muscle_force",),
    "joint": ("joint_angle", "joint_torque"),
    "load": ("length", "force"),
}
"""Channels that a block can have a sensor, or a command, for."""

ALWAYS = ("supply_pressure", "valve_command", "muscle_pressure", "joint_angle", "length")
"""Channels that are shown where nothing measured them, too."""

MOVED = {
    "arm": "joint",
    "torque": "joint",
    "force": "load",
    "temperature": "chamber",
    "flow": "chamber",
}
"""Box at which a block of the diagnosis ends, where that has not its name."""

PULLS = ("force", "torque")
"""Blocks of the diagnosis that are what muscles pull."""

UNDER = (*PULLS, "temperature", "flow")
"""Blocks of the diagnosis whose boxes are in another block too; their residual is below them."""

ELSEWHERE = {
    "line": ("valve", "supply", "chamber"),
    "joint": ("load", "muscle"),
    "arm": ("joint", "load"),
    "link": ("joint",),
    "transmission": ("joint", "load"),
    "sensors": ("valve", "chamber"),
    "valve": ("line", "chamber"),
    "supply": ("line", "chamber"),
    "muscle": ("chamber",),
}
"""Boxes in which a block is drawn that the rig has not, or that has no box of its own."""


@dataclass(eq=False)
class _DrawnBlock:
    """A block of the rig in the drawing.

    Attributes
    ----------
    kind, name : str
        Its kind, and its name, empty for the only one.
    after : list of str
        Blocks that lead to it, in full.
    column, row : float
        Place [columns, rows].
    found : list of str
        What was found to be missing or wrong in it, in words.
    """

    kind: str
    name: str
    title: str
    after: list[str] = field(default_factory=list)
    column: float = 0.0
    row: float = 0.0
    found: list[str] = field(default_factory=list)

    @property
    def full(self) -> str:
        return dotted(self.kind, self.name)


def chain_svg(diagnosis: Findings) -> str | None:
    """The rig as a chain of blocks; None where the diagnosis has no rig.

    Parameters
    ----------
    diagnosis : Findings
        With the final model as `rig`; its `measured` channels are marked, the blocks that it judges
        by themselves framed, and the located one is lit.

    Returns
    -------
    str or None
        SVG element.
    """
    rig = diagnosis.rig
    if not isinstance(rig, Rig):
        return None
    return render_page(
        Path(__file__).with_name("chain.svg.j2"),
        **_Drawing(_marked(rig, diagnosis), diagnosis, rig).content(),
        box=BOX,
        line=LINE,
        symbols=SYMBOLS,
        found=COLOURS["before"],
        dot=COLOURS["after"],
        px="{:.1f}".format,
        wrap=textwrap.wrap,
    )


def draw_chain(axes: Axes, diagnosis: Findings) -> None:
    """Draw the rig as a chain of blocks on matplotlib's axes; nothing where there is no rig.

    Parameters
    ----------
    axes : Axes
        Where.
    diagnosis : Findings
        As of :func:`chain_svg`.
    """
    axes.set_axis_off()
    rig = diagnosis.rig
    if not isinstance(rig, Rig):
        return
    own = _Drawing(_marked(rig, diagnosis), diagnosis, rig).content()
    room = axes.get_window_extent()  # in pixels, a letter's size in points
    scale = min(room.width / own["width"], room.height / own["tall"])
    small = 10.5 * scale * 72.0 / axes.figure.dpi
    for frame in own["frames"]:
        x, y, colour = frame["x"], frame["y"], frame["colour"]
        size = (frame["right"] - x, frame["low"] - y)
        fill = "#fdebdd" if frame["lit"] else "#f6f7f9"
        axes.add_patch(Rectangle((x, y), *size, facecolor=fill, edgecolor=colour))
        axes.text(x + 8, frame["title"], frame["text"], color=colour, size=small)
    for start, y, stop, end in own["arrows"]:
        arrow: dict[str, Any] = {
            "arrowstyle": "-|>",
            "color": "#6b7280",
            "shrinkA": 0,
            "shrinkB": 0,
        }
        axes.annotate("", (stop, end), (start, y), arrowprops=arrow)
    for box in own["boxes"]:
        x, y = box["x"], box["y"]
        edge = COLOURS["before"] if box["part"].found else "#aeb5bf"
        axes.add_patch(Rectangle((x, y), BOX, box["height"], facecolor="white", edgecolor=edge))
        title = "\n".join(textwrap.wrap(box["part"].title, 16)[:2])
        style: dict[str, Any] = {"size": 1.1 * small, "fontweight": "bold", "va": "center"}
        axes.text(x + 9, y + 23, title, **style)
        for row, (text, kind) in enumerate(box["lines"]):
            sign = {"measured": "● ", "unmeasured": "○ ", "found": ""}[kind]
            colour = COLOURS["before"] if kind == "found" else "#1b1f24"
            axes.text(x + 9, y + 54 + LINE * row, sign + text, size=small, color=colour)
    axes.set_xlim(0.0, own["width"])
    axes.set_ylim(own["tall"], 0.0)
    axes.set_aspect("equal")


def _marked(rig: Rig, diagnosis: Findings) -> dict[str, _DrawnBlock]:
    """The blocks that are drawn, in their places, with what was found."""
    parts = _parts(rig)
    _place(parts, rig)
    _mark(parts, diagnosis)
    return parts


def _title(rig: Rig, kind: str, name: str) -> str:
    """Title of a block in the drawing."""
    table = rig.tables(kind)[name]
    own = {
        "supply": {"tank": "tank", "regulator": "regulator"}.get(str(table.get("kind")), "supply"),
        "line": "orifice" if table.get("kind") == "orifice" else "tube",
        "joint": "joint and arm" if rig.tables("arm") else "joint",
        "load": "load frame" if table.get("kind") == "frame" else "hanging mass",
    }.get(kind, kind)
    return f"{own} {label(name)}".strip()


def _parts(rig: Rig) -> dict[str, _DrawnBlock]:
    """The blocks that are drawn, each with those that lead to it."""
    parts = {}
    for kind in KINDS:
        for name in rig.tables(kind):
            part = _DrawnBlock(kind, name, _title(rig, kind, name))
            parts[part.full] = part
    links = [
        pair
        for kind in ("valve", "line")
        for name, ports in rig.ports(kind).items()
        for pair in (
            (ports.get("from", ""), dotted(kind, name)),
            (dotted(kind, name), ports.get("to", "")),
        )
    ]
    for name, ports in rig.ports("supply").items():
        links.append((ports.get("inlet", ""), dotted("supply", name)))
    for name, ports in rig.ports("muscle").items():
        links.append((ports.get("chamber", ""), dotted("muscle", name)))
        links.append((dotted("muscle", name), ports.get("joint", "")))
    for first, second in links:
        if first in parts and second in parts and first not in parts[second].after:
            parts[second].after.append(first)
    return parts


def _place(parts: dict[str, _DrawnBlock], rig: Rig) -> None:
    """Columns by the way from the supply, rows so that what belongs together is level."""

    def depth(part: _DrawnBlock, seen: tuple[str, ...] = ()) -> int:
        before = [parts[a] for a in part.after if a not in seen]
        return 1 + max((depth(p, (*seen, part.full)) for p in before), default=-1)

    for part in parts.values():
        part.column = depth(part)
    lane = "muscle" if rig.tables("muscle") else "chamber"
    lanes = [p for p in parts.values() if p.kind == lane]
    for part in lanes:
        part.row = [p for p in lanes if p.column == part.column].index(part)
    # along the chain to both sides of the lanes, each in the middle of what it is connected to
    for part in sorted(parts.values(), key=lambda p: -p.column):
        if part not in lanes:
            ahead = [p.row for p in parts.values() if part.full in p.after]
            part.row = _middle(ahead, part.row)
    for part in sorted(parts.values(), key=lambda p: p.column):
        if part.kind in ("joint", "load"):
            part.row = _middle([parts[a].row for a in part.after], part.row)
    for column in {p.column for p in parts.values()}:
        row = -1.0
        for part in sorted((p for p in parts.values() if p.column == column), key=lambda p: p.row):
            part.row = row = max(part.row, row + 1.0)


def _middle(rows: list[float], otherwise: float) -> float:
    return sum(rows) / len(rows) if rows else otherwise


def _mark(parts: dict[str, _DrawnBlock], diagnosis: Findings) -> None:
    """Mark the blocks in which something was found, with what was found."""
    unsure = unsure_names(diagnosis)
    marks = [
        (
            EFFECTS[effect.id].block if effect.id in EFFECTS else "",
            effect.at,
            "perhaps " * (effect.term in unsure) + f"missing: {label(effect.id)}",
        )
        for effect in diagnosis.effects
        if effect.term in diagnosis.answer.named
    ]
    for wrong in diagnosis.wrong_parameters:
        kind, _, rest = wrong.name.partition(".")
        name, _, key = rest.rpartition(".")
        if kind == "sensors":
            kind = "chamber" if key.startswith("pressure") else "joint"
        marks.append((kind, name, "perhaps " * (wrong.name in unsure) + f"wrong: {label(key)}"))
    for kind, name, text in marks:
        for part in _at(parts, kind, name):
            part.found.append(text)


def _at(parts: dict[str, _DrawnBlock], kind: str, name: str) -> list[_DrawnBlock]:
    """Boxes of a block; of the nearest one that is drawn where it has none."""
    for own in (kind, *ELSEWHERE.get(kind, ())):
        found = [p for p in parts.values() if p.kind == own]
        if found:
            return [p for p in found if p.name == name] or found
    return []


@dataclass
class _Drawing:
    """Boxes and frames with their texts, on a canvas that grows with them."""

    parts: dict[str, _DrawnBlock]
    diagnosis: Findings
    rig: Rig

    def content(self) -> dict[str, Any]:
        """Sizes, frames, arrows and boxes."""
        parts = self.parts.values()
        lines = {p.full: self._lines(p) for p in parts}
        height = {p.full: 46.0 + LINE * len(lines[p.full]) for p in parts}
        pitch = max(height.values()) + GAP + 2 * PAD
        place = {
            p.full: (
                PAD + 4.0 + COLUMN * p.column,
                2 * PAD + 22.0 + pitch * p.row,
            )
            for p in parts
        }
        judged = self._judged()
        tall = max(y + height[full] for full, (_, y) in place.items()) + PAD + 6.0
        tall += 20.0 if any(n.partition(".")[0] in UNDER for n, *_ in judged) else 0.0
        return dict(
            width=max(x for x, _ in place.values()) + BOX + PAD + 5.0,
            tall=tall,
            spoken=self._spoken(),
            frames=[self._frame(m, place, height) for m in judged],
            arrows=[self._arrow(place[a], place[p.full]) for p in parts for a in p.after],
            boxes=[
                dict(part=self.parts[full], x=x, y=y, height=height[full], lines=lines[full])
                for full, (x, y) in place.items()
            ],
        )

    def _spoken(self) -> str:
        """The drawing in one sentence, for who cannot see it."""
        names = ", ".join(p.title for p in self.parts.values())
        located = self.diagnosis.answer.block
        return f"The rig: {names}." + (f" The mismatch is in {located}." if located else "")

    def _lines(self, part: _DrawnBlock) -> list[tuple[str, str]]:
        """Text lines of a box with their kind: ``measured``, ``unmeasured`` or ``found``."""
        measured = self.diagnosis.measured
        out = [
            (label(channel), "measured" if given else "unmeasured")
            for channel in CHANNELS[part.kind]
            if (given := dotted(channel, part.name) in measured) or (measured and channel in ALWAYS)
        ]
        return out + [(line, "found") for own in part.found for line in textwrap.wrap(own, 18)]

    def _judged(self) -> list[tuple[str, list[str], BlockMismatch | None]]:
        """Blocks of the diagnosis, each with the boxes in it."""
        own = {m.block: m for b in self.diagnosis.judged for m in b.mismatch}
        return [
            (name, inside, own.get(name))
            for name in own or self.diagnosis.residuals
            if (inside := list(self._inside(*name.partition(".")[::2])))
        ]

    def _inside(self, kind: str, name: str) -> Iterable[str]:
        """Boxes of a block of the diagnosis: a chamber with what feeds it, a joint or a load with
        its muscles; of a force or torque the muscles alone, of a temperature the chamber, of a flow
        what it passes.
        """
        target = dotted(MOVED.get(kind, kind), name)
        if target not in self.parts:
            return
        if kind not in (*PULLS, "flow"):
            yield target
        if kind == "chamber":  # an outlet that leads nowhere else
            led = {a for p in self.parts.values() for a in p.after}
            outlets = (p for p in self.parts.values() if p.kind == "line" and target in p.after)
            yield from (p.full for p in outlets if p.full not in led)
        paths = ("valve", "line")
        feeding = {"chamber": paths, "flow": paths, "temperature": ()}.get(kind, ("muscle",))
        waiting = [target]
        while waiting:
            for before in self.parts[waiting.pop()].after:
                if before in self.parts and self.parts[before].kind in feeding:
                    yield before
                    waiting.append(before)

    def _frame(
        self,
        judged: tuple[str, list[str], BlockMismatch | None],
        place: dict[str, tuple[float, float]],
        height: dict[str, float],
    ) -> dict[str, Any]:
        """Frame around what is judged together, with its residual."""
        name, inside, mismatch = judged
        under = name.partition(".")[0] in UNDER
        pad = 0.5 * PAD if under else PAD
        x = min(place[n][0] for n in inside) - pad
        y = min(place[n][1] for n in inside) - pad - (0.0 if under else 20.0)
        right = max(place[n][0] for n in inside) + BOX + pad
        low = max(place[n][1] + height[n] for n in inside) + pad + (20.0 if under else 0.0)
        title = low - 8.0 if under else y + 17.0
        lit = name == (self.diagnosis.answer.block or self.diagnosis.where.block)
        left, size = refit_words(self.diagnosis, name, mismatch.channel if mismatch else None)
        colour = COLOURS["before"] if lit or left == "more" else "#8a94a3"
        text = textwrap.shorten(size, int((right - x) / 6.4), placeholder=" …")
        return dict(x=x, y=y, right=right, low=low, title=title, lit=lit, colour=colour, text=text)

    def _arrow(
        self, first: tuple[float, float], second: tuple[float, float]
    ) -> tuple[float, float, float, float]:
        """Begin and end of an arrow from one box to the next, at the height of their titles."""
        (x, y), (to, end) = first, second
        start, stop = (x + BOX, to - 2.0) if to > x else (x, to + BOX + 2.0)
        return start, y + 24.0, stop, end + 24.0


SYMBOLS = {
    "supply": '<path d="M3 6v13a4 4 0 0 0 4 4h11a4 4 0 0 0 4-4V6a4 4 0 0 0-4-4H7a4 4 0 0 0-4 4z'
    'M8 2v21"/>',
    "valve": '<path d="M3 5l20 15V5L3 20zM13 12V3M9 3h8"/>',
    "line": '<path d="M1 9h24M1 17h24"/>',
    "chamber": '<circle cx="13" cy="13" r="10"/><path d="M13 13l5-5"/>',
    "muscle": '<path d="M1 13h3M22 13h3M4 13c4-9 14-9 18 0c-4 9-14 9-18 0zM8 8l9 10M17 8L8 18"/>',
    "joint": '<circle cx="6" cy="19" r="4"/><path d="M9 16L24 4"/>',
    "load": '<path d="M13 1v7M5 8h16l3 15H2z"/>',
}
"""Symbols of the blocks, in a square of 26 px."""
