"""Files that are read: regular ones, with limits that no honest file comes near."""

from __future__ import annotations

import gzip
import io
import os
import re
import stat
import tomllib
from pathlib import Path
from typing import Any, Final

MOST_BYTES: Final = 512 << 20
"""Bytes of a table, packed or unpacked."""
MOST_TOML_BYTES: Final = 4 << 20
"""Bytes of a description in TOML."""
MOST_DEPTH: Final = 32
"""Tables and lists inside each other in TOML, groups in HDF5."""
MOST_PARTS: Final = 100_000
"""Groups and data sets of one HDF5 file."""
MOST_PIECE: Final = 128 << 20
"""Bytes that one packed part of a bag may have unpacked: they are written in parts of some MB."""
MOST_ROWS: Final = 5_000_000
"""Samples of a channel: some hours at 1 kHz."""
MOST_CELLS: Final = 20_000_000
"""Numbers of one file."""
MOST_COLUMNS: Final = 10_000
"""Channels of one file."""
MOST_SIZE: Final = 1e150
"""Size of a number that may be a measurement: the square of a larger one is none."""
MOST_NAME: Final = 200
"""Characters of a name."""
_MADE: Final = ("/proc", "/sys")
"""Folders in which the system makes files as they are read, without an end or a size."""
_KINDS: Final = (
    (stat.S_ISDIR, "a folder"),
    (stat.S_ISFIFO, "a pipe"),
    (stat.S_ISCHR, "a device"),
    (stat.S_ISBLK, "a device"),
    (stat.S_ISSOCK, "a socket"),
)


def check_regular(path: str | os.PathLike[str]) -> None:
    """Refuse what is no regular file, such as a device, a pipe or what is in ``/proc``.

    Raises
    ------
    OSError
        If it is not there or of another kind.
    """
    there = os.stat(path)
    made = any(os.path.ismount(one) and os.stat(one).st_dev == there.st_dev for one in _MADE)
    if made or not stat.S_ISREG(there.st_mode):
        kinds = (name for matches, name in _KINDS if matches(there.st_mode))
        kind = next(kinds, "made by the system as it is read" if made else "a special file")
        raise OSError(f"it is {kind}; a regular file is needed, copy what it gives into one")


def read_file(
    path: str | os.PathLike[str], *, most: int = MOST_BYTES, packed: bool = False
) -> bytes:
    """Bytes of a regular file.

    Parameters
    ----------
    path : path-like
        The file; links are followed.
    most : int
        Bytes that it may have, packed and unpacked.
    packed : bool
        Whether it is packed by gzip; its content is then unpacked.

    Returns
    -------
    bytes
        What is in it.

    Raises
    ------
    OSError
        If it is not there, cannot be read, is not a regular file (a device, a pipe) or has more
        than `most` bytes.
    EOFError, zlib.error
        If it is packed and broken.
    """
    check_regular(path)
    with open(path, "rb") as stream:
        data = stream.read(most + 1)
    if len(data) > most:
        raise OSError(f"it has more than {_size(most)}, and at most that is read; {_ADVICE}")
    if not packed:
        return data
    with gzip.GzipFile(fileobj=io.BytesIO(data)) as unpacked:
        content = unpacked.read(most + 1)
    if len(content) > most:
        raise OSError(f"it unpacks to more than {_size(most)}, and at most that is read; {_ADVICE}")
    return content


_ADVICE: Final = "cut it into parts"


def _size(count: int) -> str:
    return f"{count >> 20} MB" if count >= 1 << 20 else f"{count} bytes"


def read_toml(path: Path) -> str:
    """Text of a description in TOML.

    Parameters
    ----------
    path : Path
        The file.

    Returns
    -------
    str

    Raises
    ------
    OSError
        As :func:`read_file`.
    UnicodeDecodeError
        If it is no text in UTF-8.
    """
    return read_file(path, most=MOST_TOML_BYTES).decode("utf-8-sig").replace("\r\n", "\n")


def toml_document(path: Path, error: type[Exception]) -> dict[str, Any]:
    """A description in TOML; what is wrong with the file is an error of the type that is given."""
    try:
        return parse_toml(read_toml(path))
    except OSError as why:
        raise error(f"{path}: cannot be read ({why.strerror or why})") from why
    except UnicodeDecodeError as why:
        raise error(f"{path}: not a text file in UTF-8") from why
    except tomllib.TOMLDecodeError as why:
        raise error(f"{path}: not valid TOML: {why}") from why


def parse_toml(text: str) -> dict[str, Any]:
    """A TOML document that is not nested without end.

    Parameters
    ----------
    text : str
        The text.

    Returns
    -------
    dict

    Raises
    ------
    tomllib.TOMLDecodeError
        If it is not TOML, or is nested deeper than :data:`MOST_DEPTH`.
    """
    deep = f"nested more than {MOST_DEPTH} deep, and at most that is allowed"
    if _DOTTED.search(text):  # before it is parsed, which takes the square of the depth
        raise tomllib.TOMLDecodeError(deep)
    try:
        document = tomllib.loads(text)
    except RecursionError as error:
        raise tomllib.TOMLDecodeError(deep) from error
    except ValueError as error:  # a number of more digits than Python reads, too
        raise tomllib.TOMLDecodeError(str(error)) from error
    inside: list[Any] = [document]
    for _ in range(MOST_DEPTH + 1):
        parts = [
            part
            for value in inside
            for part in (value.values() if isinstance(value, dict) else value)
        ]
        for part in parts:
            if isinstance(part, int) and not -(2**63) <= part < 2**63:
                raise tomllib.TOMLDecodeError(
                    f"a whole number of {len(str(abs(part)))} digits is not allowed: it must fit "
                    "into 64 bits"
                )
        inside = [part for part in parts if isinstance(part, (dict, list))]
        if not inside:
            return document
    raise tomllib.TOMLDecodeError(deep)


_DOTTED: Final = re.compile(
    rf"""(?<![\w"'-])(?:(?:[\w-]++|"[^"\n]*+"|'[^'\n]*+')[ \t]*+\.[ \t]*+){{{MOST_DEPTH + 1}}}"""
)
"""A key of more parts than tables may be nested."""


_SHOWN: Final = {
    code: f"\\x{code:02x}" if code < 256 else f"\\u{code:04x}"  # noqa: PLR2004
    for code in (*range(32), 127, *range(128, 160), 0x61C, *range(0x200B, 0x2010),
                 *range(0x2028, 0x202F), *range(0x2066, 0x206A), 0xFEFF)
} | {9: "\\t", 10: "\\n", 13: "\\r"}  # fmt: skip


def shown(text: str, *, lines: bool = False) -> str:
    r"""Text of which what a terminal would obey (its escapes, returns, marks of direction) is shown
    instead: a name in a file must not be able to write over what is said of it.

    Parameters
    ----------
    text : str
        The text.
    lines : bool, optional
        Whether it may have several lines and tabs.

    Returns
    -------
    str

    Examples
    --------
    >>> print(shown("a\x1b[2J\nb"))
    a\x1b[2J\nb
    """
    if lines:
        text = text.replace("\r\n", "\n")
    kept = {code: escape for code, escape in _SHOWN.items() if not lines or code not in (9, 10)}
    return text.translate(kept)


def resolved(path: str | os.PathLike[str]) -> Path:
    """A path with its links followed as far as they lead: one in a circle stays as it is, and what
    opens it says so.

    Parameters
    ----------
    path : path-like
        It need not be there.

    Returns
    -------
    Path
    """
    return Path(os.path.realpath(path))


def is_inside(folder: Path, path: Path) -> bool:
    """True where a file is in a folder or below it, links followed.

    Parameters
    ----------
    folder, path : Path
        They need not be there.

    Returns
    -------
    bool
    """
    return resolved(path).is_relative_to(resolved(folder))


def found_outside(folder: Path, path: Path) -> Path | None:
    """The first of what is read from a path that lies outside a folder, links followed.

    Parameters
    ----------
    folder : Path
        What it should lie in.
    path : Path
        A file, or a folder of which any file may be read; it need not be there.

    Returns
    -------
    Path or None
        The path itself, or what lies in it and is a link out of `folder`; None if nothing is.
    """
    if not is_inside(folder, path):
        return path
    inside = (Path(home, name) for home, *names in os.walk(path) for name in sum(names, []))
    return next((one for one in inside if one.is_symlink() and not is_inside(folder, one)), None)
