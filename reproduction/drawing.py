"""What the pictures of all chapters have in common: an empty figure, and a small PNG of a full
one.
"""

from __future__ import annotations

import io
from collections.abc import Callable, Mapping
from typing import Any

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pamrs.report.figures import STYLE
from reproduction.page import Picture
from reproduction.statements import Statements


def figure(rows: int = 1, columns: int = 1, height: float = 3.6, **more: Any) -> tuple[Figure, Any]:
    """An empty figure, 8 in wide.

    Parameters
    ----------
    rows, columns : int
        Of axes.
    height : float
        [in]
    **more
        For ``Figure.subplots``.

    Returns
    -------
    Figure, and its axes as ``Figure.subplots`` gives them
    """
    drawn = Figure(figsize=(8.0, height), dpi=110, layout="constrained")
    return drawn, drawn.subplots(rows, columns, **more)


def png(draw: Callable[[], Figure], colours: int) -> bytes:
    """Draw in the house's style, and keep few colours: a third to half of the size, no difference
    to the eye.

    Parameters
    ----------
    draw : callable
        Makes the figure.
    colours : int
        How many are kept, from 2 to 256.

    Returns
    -------
    bytes
        PNG.
    """
    from PIL import Image

    with mpl.rc_context(STYLE):
        stream = io.BytesIO()
        draw().savefig(stream, format="png")
    image = (
        Image.open(stream)
        .convert("RGB")
        .quantize(colours, method=Image.Quantize.MEDIANCUT, dither=Image.Dither.NONE)
    )
    small = io.BytesIO()
    image.save(small, format="png", optimize=True)
    return small.getvalue()


def axes(rows: int, columns: int, height: float, **more: Any) -> tuple[Figure, list[Axes]]:
    """The same with its axes as a list."""
    drawn, cells = figure(rows, columns, height, squeeze=False, **more)
    return drawn, list(cells.ravel())


def pictures(
    table: Statements, drawn: Mapping[str, Callable[[], Figure]], colours: int = 64
) -> list[Picture]:
    """Every picture of a chapter, in the order of its table.

    Parameters
    ----------
    table : Statements
        Of the chapter.
    drawn : mapping of str to callable
        What draws each, by its name.
    colours : int
        As for :func:`png`.

    Returns
    -------
    list of Picture
    """
    return [
        Picture(
            one["name"],
            table.groups[one["group"]],
            one["caption"],
            png(drawn[one["name"]], colours),
        )
        for one in table.pictures
    ]
