"""Report of a diagnosis: one offline HTML page, its first screen as PDF, and one PNG."""

from __future__ import annotations

import importlib
import os
from pathlib import Path
from types import ModuleType

from pamrs._writing import write_atomically
from pamrs.findings import Findings

__all__ = ["motion", "render_html", "write_figure", "write_page", "write_report"]


def render_html(diagnosis: Findings) -> str:
    """Return the report as one self-contained HTML page."""
    from pamrs.report.html import render

    return render(diagnosis)


def write_report(diagnosis: Findings, path: str | os.PathLike[str]) -> Path:
    """Write the HTML report to `path` and return the path."""
    return write_atomically(path, render_html(diagnosis))


def write_page(diagnosis: Findings, path: str | os.PathLike[str]) -> Path:
    """Write the first screen of the report, one page of A4 as PDF, and return the path."""
    from pamrs.report.pictures import one_page_pdf

    return write_atomically(path, one_page_pdf(diagnosis))


def write_figure(diagnosis: Findings, path: str | os.PathLike[str]) -> Path:
    """Write the one-picture summary, a PNG of 1600 x 1000 pixels, and return the path."""
    from pamrs.report.pictures import summary_png

    return write_atomically(path, summary_png(diagnosis))


def __getattr__(name: str) -> ModuleType:
    if name != "motion":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return importlib.import_module("pamrs.report.motion")
