"""Style sheet and settings of the templates, which every report page shares."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import jinja2
from markupsafe import Markup

from pamrs import __version__


def render_page(template: Path, **content: Any) -> str:
    """Fill a template.

    Parameters
    ----------
    template : Path
        Jinja2 file; it gets ``style``, the shared style sheet, and ``version`` besides `content`.
    **content
        What it shows.

    Returns
    -------
    str
        HTML text.
    """
    environment = jinja2.Environment(
        autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    style = Path(__file__).with_name("style.css").read_text(encoding="utf-8")
    page = environment.from_string(template.read_text(encoding="utf-8"))
    return page.render(style=Markup(style), version=__version__, **content)  # noqa: S704
