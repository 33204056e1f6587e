"""Helpers that the commands of ``pamrs`` share: numbers with units, muscles by name, files to
write, progress, silence, arguments.
"""

from __future__ import annotations

import functools
import inspect
import json
import os
import re
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final, TypeAlias

import typer

from pamrs._checks import refused
from pamrs._files import shown
from pamrs._writing import write_atomically
from pamrs.cli._streams import terminal
from pamrs.errors import NotWrittenError, ParameterError, RigError, meant
from pamrs.units import DIMENSIONS, to_si

if TYPE_CHECKING:
    from pamrs._arrays import Array
    from pamrs.recordings import Recording
    from pamrs.rig import Muscle, Rig

_NUMBER = r"[-+]?\d*\.?\d+(?:[eE][-+]?\d+)?"
QUANTITY = re.compile(
    rf"^\s*(?P<value>{_NUMBER})\s*(?:(?:\+-|±)\s*(?P<tol>{_NUMBER})\s*)?(?P<unit>\S.*?)?\s*$"
)
#: Units to give as an example, where people seldom write the one of SI.
_USUAL: Final = {"pressure": "bar", "angle": "deg", "length": "mm"}
#: Sizes of a muscle that commands take, and their dimension.
GEOMETRY: Final = {
    "rest_length": "length",
    "rest_diameter": "length",
    "braid_angle": "angle",
    "wall_thickness": "length",
}
#: Whether notes and progress are left out, by ``--quiet``.
QUIET: Final = ContextVar("QUIET", default=False)
#: What ``--json -`` names; no other option means it.
STDOUT: Final = Path("-")
#: Seconds from one line of progress to the next where standard error is no terminal.
_EVERY: Final = 10.0


_QUIETLY = Annotated[
    bool,
    typer.Option("--quiet", "-q", help="Only the result; of the rest, warnings and errors."),
]
#: Arguments that several commands take.
RigName = Annotated[
    Path, typer.Argument(help="Rig file (TOML), or the name of a rig of the package.")
]
AllowOutside = Annotated[
    bool,
    typer.Option(
        "--allow-outside", help="Files may lie outside the folder of the case or description."
    ),
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
        "quiet", inspect.Parameter.KEYWORD_ONLY, default=False, annotation=_QUIETLY
    )
    quietly.__annotations__ = {**command.__annotations__, "quiet": _QUIETLY}
    changed: Any = quietly
    changed.__signature__ = signature.replace(parameters=[*signature.parameters.values(), option])
    return quietly


def note(text: str) -> None:
    """Say something on standard error that is no warning, unless ``--quiet`` is given."""
    if not QUIET.get():
        typer.echo(text, err=True)


def file_of(path: Path | None) -> Path | None:
    """The file that a path names; none where it is standard output."""
    return None if path == STDOUT else path


def json_help(schema: str) -> str:
    """Help text of the option ``--json``."""
    return f"Write the result (schema {schema}); -: to standard output, with nothing else on it."


def check_new(path: Path) -> None:
    """Refuse to write where something is: a file, a folder or a link."""
    if os.path.lexists(path):
        raise FileExistsError(f"{path}: is there already; it is not overwritten")


def option(name: str) -> str:
    """An option as it is typed."""
    return f"--{name.replace('_', '-')}"


@contextmanager
def naming(name: str, text: str) -> Iterator[None]:
    """Name an option and what it was given before the message of an error."""
    try:
        yield
    except ParameterError as error:
        raise ParameterError(f"{option(name)} = {text.strip()!r}: {error}") from None


def quantity(name: str, text: str, dimension: str) -> tuple[float, float | None]:
    """Value and, after ``+-``, standard deviation of a number with a unit, in SI."""
    match = QUANTITY.match(text)
    if match is None or match["unit"] is None:
        usual = _USUAL.get(dimension, DIMENSIONS[dimension])
        needed = f"a number with a unit like {usual!r} is needed"
        raise refused(option(name), text.strip(), needed)
    with naming(name, text):
        value = to_si(float(match["value"]), match["unit"], dimension)
        if match["tol"] is None:
            return value, None
        return value, to_si(float(match["tol"]), match["unit"], dimension, difference=True)


def exact(name: str, text: str, dimension: str) -> float:
    """A number with a unit in SI, without a standard deviation."""
    value, spread = quantity(name, text, dimension)
    if spread is not None:
        raise refused(option(name), text.strip(), "a standard deviation has no use here")
    return value


def named_muscle(
    name: str, option: str = "--muscle"
) -> tuple[Muscle, dict[str, float], Rig | None]:
    """Muscle of a rig file or of the library, the tolerances of its geometry, and the rig."""
    from pamrs import library
    from pamrs.rig import load_rig

    if not name.endswith(".toml") and not Path(name).exists():
        if name not in library.names():
            raise ParameterError(
                f"{option} = {name!r} is neither a file nor in the library; "
                f"{meant(name, library.names())}"
            )
        return library.entry(name).muscle, {}, None
    rig = load_rig(name)
    if rig.muscle is None:
        raise ParameterError(f"{option} = {name!r}: this rig has no block [muscle]")
    known = {
        key.partition(".")[2]: p.tol
        for key, p in rig.parameters.items()
        if key.startswith("muscle.") and p.tol > 0.0
    }
    return rig.muscle, {key: value for key, value in known.items() if key in GEOMETRY}, rig


def rig_named(file: Path) -> Rig:
    """A rig file, or a rig of the package by its name."""
    from pamrs import rigs
    from pamrs.rig import load_rig

    name = str(file)
    if not file.exists() and name in rigs.names():
        return rigs.named(name)
    try:
        return load_rig(file)
    except RigError:
        if file.exists():
            raise
    if file.suffix or len(file.parts) > 1:
        others = [path.name for path in file.parent.glob("*.toml")]
        hint = meant(file.name, [*others, *rigs.names()])
        raise RigError(
            f"{file}: cannot be read (no such file{f'; {hint}' if 'mean' in hint else ''})"
        )
    raise RigError(
        f"{name!r} is neither a file nor a rig of the package; {meant(name, rigs.names())}"
    )


def usable_samples(
    recording: Recording,
) -> dict[str, tuple[Array, Array]]:
    """Times [s] and values [SI] of the samples of each channel that may be used, to be drawn."""
    return {
        name: (recording.time[rows], recording.channels[name][rows])
        for name, rows in recording.mask.items()
    }


#: What is to be in each file, or what writes it, given its path; None where no file is wanted.
Contents: TypeAlias = dict[Path | None, "str | bytes | Callable[[Path], object]"]


def document(schema: str, **content: Any) -> str:
    """A result as JSON, its schema first; what has ``to_dict`` is written as that says."""

    def plain(part: Any) -> Any:
        if not hasattr(part, "to_dict"):
            raise TypeError(f"{type(part).__name__} cannot be written as JSON")
        return part.to_dict()

    whole = {"schema": schema, **content}
    return json.dumps(whole, indent=1, allow_nan=False, default=plain) + "\n"


def write(contents: Contents, text: str = "") -> None:
    """Write every file that is wanted and say so, then print what was found; a file that fails does
    not keep the others, or the text, from coming.

    Text for :data:`STDOUT` goes there alone; what was found is then a note on standard error.

    Parameters
    ----------
    contents : dict of Path or None to str, bytes or callable
        The files.
    text : str, optional
        What was found, as text.

    Raises
    ------
    NotWrittenError
        If some could not be written; names each, and why.
    ParameterError
        If a file cannot be made from what was asked for.
    """
    failed: list[str] = []
    refused: ParameterError | None = None
    for path, content in contents.items():
        if path is None:
            continue
        if path == STDOUT and isinstance(content, str):
            typer.echo(content, nl=False)
            continue
        try:
            if callable(content):
                content(path)
            else:
                write_atomically(path, content)
        except ParameterError as error:
            refused = refused or error
        except Exception as error:  # a drawing that fails must not cost the other files
            why = getattr(error, "strerror", None) or str(error) or type(error).__name__
            failed.append(f"{path} ({why})")
        else:
            note(f"written: {path}")
    if text and isinstance(contents.get(STDOUT), str):
        note(text.removesuffix("\n"))
    elif text:
        typer.echo(text.removesuffix("\n"))
    if refused is not None:
        raise refused
    if failed:
        raise NotWrittenError(f"the work is done, but not written: {'; '.join(failed)}")


@contextmanager
def progress(text: str, *, ends: bool = True) -> Iterator[Callable[[str], None]]:
    """Say on standard error what is going on, with percent and time left; what it gives takes lines
    of the work.

    Where a person is looking that is a line that is written anew; elsewhere, and on a terminal with
    ``NO_COLOR`` or ``TERM=dumb`` in the environment, a plain line every ten seconds; lines say that
    it begins and that it is done unless ``ends`` is False.
    """
    started, text = time.perf_counter(), shown(text)
    plain = os.environ.get("NO_COLOR") or os.environ.get("TERM") == "dumb"
    if sys.stderr.isatty() and not plain and not QUIET.get():
        from rich.console import Console
        from rich.text import Text

        with Console(file=terminal()).status(Text(text)) as status:
            yield lambda line: status.update(Text(shown(getattr(line, "whole", line))))
    elif QUIET.get():
        yield lambda line: None
    else:
        from pamrs._progress import at_even_times

        if ends:
            note(f"{text} ...")
        with at_even_times(text, lambda line: note(shown(line)), _EVERY) as say:
            yield say
    if ends:
        note(f"{text}: done in {time.perf_counter() - started:.1f} s")


@contextmanager
def counted(what: str) -> Iterator[Callable[[int, int], None]]:
    """:func:`progress` of a work that is counted; what it gives takes how many are done, of all."""
    from pamrs._progress import Steps

    with progress(what, ends=False) as say:
        steps = Steps(say)
        yield lambda done, of: steps(f"{what}: {done} of {of}", done / of)
