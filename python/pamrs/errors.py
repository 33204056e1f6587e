"""The errors of pamrs: every message names the quantity, its value and what is allowed."""

from __future__ import annotations

from collections.abc import Iterable

_MOST_LISTED = 20
"""Problems of one file that are listed: a screen."""


class PamrsError(Exception):
    """Base of every error that pamrs raises on purpose."""


class ParameterError(PamrsError, ValueError):
    """A parameter or argument is unknown, or outside its allowed range."""


class RigError(PamrsError, ValueError):
    """A rig file is unreadable, or what it describes is impossible."""


class RecordingError(PamrsError, ValueError):
    """A recording is unreadable, or its columns cannot be understood."""


class CaseError(PamrsError, ValueError):
    """A case folder is incomplete, or its ``case.toml`` is wrong."""


class SimulationError(PamrsError, ArithmeticError):
    """An integration left the range in which the model holds; the message gives the time and the
    state.
    """


class DiagnosisError(PamrsError, ValueError):
    """The recordings of a case do not allow a diagnosis."""


class FitError(PamrsError, ValueError):
    """The measurements do not determine what a fit asks for; the message says what is missing."""


class NotWrittenError(PamrsError, OSError):
    """The work was done, and a file of its result could not be written; the message names each."""


class MissingPackageError(PamrsError, ImportError):
    """A package that only some commands need is not installed, or cannot be loaded."""


class UnitWarning(UserWarning):
    """A value that is possible and most likely meant in another unit than SI."""


def missing_package(error: ImportError, extra: str) -> MissingPackageError:
    """The error that says what to install for a package that could not be imported, or that it is
    there and cannot be loaded.

    Parameters
    ----------
    error : ImportError
        What the import raised.
    extra : str
        The extra of pamrs that installs the package.

    Returns
    -------
    MissingPackageError
    """
    name = error.name or "a package"
    if isinstance(error, ModuleNotFoundError):
        why = f"which is not installed: pip install 'pamrs[{extra}]'"
    else:
        why = f"which cannot be loaded ({error}); to install it anew: pip install 'pamrs[{extra}]'"
    return MissingPackageError(f"this needs {name}, {why}", name=error.name)


def meant(given: str, allowed: Iterable[str]) -> str:
    """Hint on an unknown name: the nearest known one, else all of them.

    Parameters
    ----------
    given : str
        The name.
    allowed : iterable of str
        The known ones.

    Returns
    -------
    str
        ``did you mean 'shoulder'?`` or ``there are: shoulder, elbow``.
    """
    import difflib

    names = list(allowed)
    near = difflib.get_close_matches(given, names, n=1)
    return f"did you mean {near[0]!r}?" if near else f"there are: {', '.join(names) or 'none'}"


def joined(head: str, problems: Iterable[str]) -> str:
    """One message out of a headline and the problems found under it.

    Parameters
    ----------
    head : str
        What the problems belong to, usually a file.
    problems : iterable of str
        One sentence each.

    Returns
    -------
    str
        A single line for one problem, else the headline and a line for each of the first.
    """
    found = list(problems)
    if len(found) == 1:
        return f"{head}: {found[0]}"
    lines = [f"  - {line}" for line in found[:_MOST_LISTED]]
    more = [f"  - and {len(found) - _MOST_LISTED} more"] if len(found) > _MOST_LISTED else []
    return "\n".join([f"{head}: {len(found)} problems", *lines, *more])
