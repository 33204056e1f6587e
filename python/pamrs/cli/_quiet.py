"""``--quiet``: an option of every command."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable
from typing import Annotated, Any

import typer

from pamrs.cli._shared import QUIET

_OPTION = Annotated[
    bool,
    typer.Option("--quiet", "-q", help="Only the result; of the rest, warnings and errors."),
]


def with_quiet(command: Callable[..., Any]) -> Callable[..., Any]:
    """A command that also takes ``--quiet``, and then leaves out progress and notes."""

    @functools.wraps(command)
    def quietly(*args: Any, quiet: bool = False, **others: Any) -> Any:
        before = QUIET.set(quiet)
        try:
            return command(*args, **others)
        finally:
            QUIET.reset(before)

    signature = inspect.signature(command, eval_str=True)
    option = inspect.Parameter(
        "quiet", inspect.Parameter.KEYWORD_ONLY, default=False, annotation=_OPTION
    )
    quietly.__annotations__ = {**command.__annotations__, "quiet": _OPTION}
    changed: Any = quietly
    changed.__signature__ = signature.replace(parameters=[*signature.parameters.values(), option])
    return quietly
