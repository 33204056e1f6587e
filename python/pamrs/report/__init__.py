"""Report of a diagnosis: one offline HTML page and one PNG. Needs ``pip install pamrs[report]``."""

from __future__ import annotations

import os
from pathlib import Path

from pamrs.errors import check_packages
from pamrs.findings import Findings

__all__ = ["render_html", "write_figure", "write_report"]


def require(*packages: str) -> None:
    """Import the packages that a report is made with.

    Parameters
    ----------
    *packages : str
        Names to import.

    Raises
    ------
    ImportError
        If one is missing; names it and the extra to install.
    """
    check_packages("report", *packages)


def render_html(diagnosis: Findings) -> str:
    """Return the report as one self-contained HTML page.

    Raises
    ------
    ImportError
        If matplotlib or jinja2 is missing; names the extra to install.
    """
    require("jinja2", "matplotlib")
    from pamrs.report.html import render

    return render(diagnosis)


def write_report(diagnosis: Findings, path: str | os.PathLike[str]) -> Path:
    """Write the HTML report to `path` and return the path.

    Raises
    ------
    ImportError
        If matplotlib or jinja2 is missing; names the extra to install.
    """
    from pamrs._writing import write_atomically

    return write_atomically(path, render_html(diagnosis))


def write_figure(diagnosis: Findings, path: str | os.PathLike[str]) -> Path:
    """Write the one-picture summary, a PNG of 1600 x 1000 pixels, and return the path.

    Raises
    ------
    ImportError
        If matplotlib is missing; names the extra to install.
    """
    from pamrs._writing import write_atomically

    require("matplotlib")
    from pamrs.report.figures import summary_png

    return write_atomically(path, summary_png(diagnosis))
