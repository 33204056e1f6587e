"""Report of a diagnosis: one offline HTML page and one PNG. Needs ``pip install pamrs[report]``."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pamrs.diagnosis.result import Diagnosis

__all__ = ["render_html", "write_figure", "write_report"]


def _missing(error: ImportError) -> ImportError:
    return ImportError(f"the report needs {error.name}, which is not installed: pip install pamrs[report]", name=error.name)


def render_html(diagnosis: Diagnosis) -> str:
    """Return the report as one self-contained HTML page.

    Raises
    ------
    ImportError
        If matplotlib or jinja2 is missing; names the extra to install.
    """
    try:
        import jinja2  # noqa: F401
        import matplotlib  # noqa: F401
    except ImportError as error:
        raise _missing(error) from error
    from pamrs.report.html import render

    return render(diagnosis)


def write_report(diagnosis: Diagnosis, path: str | os.PathLike[str]) -> Path:
    """Write the HTML report to `path` and return the path.

    Raises
    ------
    ImportError
        If matplotlib or jinja2 is missing; names the extra to install.
    """
    from pamrs.writing import write_atomically

    return write_atomically(path, render_html(diagnosis))


def write_figure(diagnosis: Diagnosis, path: str | os.PathLike[str]) -> Path:
    """Write the one-picture summary, a PNG of 1600 x 1000 pixels, and return the path.

    Raises
    ------
    ImportError
        If matplotlib is missing; names the extra to install.
    """
    from pamrs.writing import write_atomically

    try:
        import matplotlib  # noqa: F401
    except ImportError as error:
        raise _missing(error) from error
    from pamrs.report.figures import summary_png

    return write_atomically(path, summary_png(diagnosis))
