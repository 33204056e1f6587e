"""Small curves of series as SVG."""

from __future__ import annotations

from typing import Final

import numpy as np
from markupsafe import Markup

from pamrs._arrays import Array
from pamrs._views import decimate

_WIDTH: Final = 240
_HEIGHT: Final = 36


def sparkline(values: Array) -> Markup:
    """A curve over the samples, from the smallest to the largest value of each stretch.

    Parameters
    ----------
    values : (n,) array
        Numbers; what is not finite is left out.

    Returns
    -------
    Markup
        An ``svg`` element; empty where no number is.
    """
    rows = np.flatnonzero(np.isfinite(values))
    if not rows.size:
        return Markup("")
    ends, drawn = decimate(rows, values[rows], 2 * _WIDTH)
    low, high = float(drawn.min()), float(drawn.max())
    scale = (_HEIGHT - 4) / (high - low) if high > low else 0.0
    x = ends * (_WIDTH / max(1, values.size - 1))
    y = _HEIGHT - 2 - (drawn - low) * scale if scale else np.full(x.size, _HEIGHT / 2)
    points = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x, y, strict=True))
    return Markup(
        '<svg class="spark" viewBox="0 0 {} {}" preserveAspectRatio="none" aria-hidden="true">'
        '<polyline points="{}"/></svg>'
    ).format(_WIDTH, _HEIGHT, points)
