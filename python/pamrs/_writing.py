"""Files that appear whole or not at all."""

from __future__ import annotations

import contextlib
import os
import secrets
import stat
import tempfile
from collections.abc import Iterable
from pathlib import Path
from typing import Final

from pamrs.errors import ParameterError

_ROOM: Final = 1 << 20
"""Bytes that must fit where a file is to be written: a result with its page and pictures."""


def write_atomically(path: str | os.PathLike[str], content: str | bytes) -> Path:
    """Write `content` to a temporary file in the folder of `path`, then rename: readers never see
    half a file. A new file has the mode that the process gives to files, one that was there keeps
    its own.
    """
    target = Path(os.path.realpath(path))  # through a symbolic link, not over it
    data = content.encode("utf-8") if isinstance(content, str) else content
    # a pipe or a terminal: nothing there to keep whole
    if target.exists() and not target.is_file():
        Path(path).write_bytes(data)
        return Path(path)
    temporary = target.with_name(f".{target.name[:40]}.{secrets.token_hex(8)}.tmp")
    # made as any file is, so that the system takes off what the user's mask says
    handle = os.open(temporary, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o666)
    try:
        with os.fdopen(handle, "wb") as stream:
            stream.write(data)
        with contextlib.suppress(FileNotFoundError):
            os.chmod(temporary, stat.S_IMODE(target.stat().st_mode) & 0o777)
        os.replace(temporary, target)
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise
    return Path(path)


def check_writable(*paths: str | os.PathLike[str] | None) -> None:
    """Refuse outputs that could not be written, before any long work starts.

    Parameters
    ----------
    *paths : path-like or None
        Files that are to be written; None is passed over. Nothing is left behind.

    Raises
    ------
    OSError
        If a folder does not exist, is full or does not let files be made in it, or a path is a
        folder itself or a file that must not be written.
    ParameterError
        If two of them are the same file, or one is called ``-``.
    """
    wanted = [Path(path) for path in paths if path is not None]
    for path in wanted:
        if path == Path("-"):
            raise ParameterError("-: standard output is for --json alone; a file is needed")
        _check_writable(path)
    _check_different(path for path in wanted if not path.exists() or path.is_file())


def _check_writable(path: Path) -> None:
    if not path.absolute().parent.is_dir():
        raise FileNotFoundError(f"{path}: the folder {path.parent} does not exist")
    target = Path(os.path.realpath(path))
    if target.is_dir():
        raise IsADirectoryError(f"{path}: cannot be written, it is a folder; a file is needed")
    if target.exists() and not os.access(target, os.W_OK):
        raise PermissionError(f"{path}: cannot be written, the file is read-only")
    if target.exists() and not target.is_file():
        return  # a pipe or a terminal
    try:
        with tempfile.TemporaryFile(dir=target.parent, prefix=f".{target.name[:40]}.") as stream:
            stream.write(bytes(_ROOM))
            stream.flush()
    except OSError as error:
        why = error.strerror or str(error)
        raise OSError(
            f"{path}: cannot be written, the folder {target.parent} takes no file of "
            f"{_ROOM >> 20} MB ({why})"
        ) from error


def _check_different(paths: Iterable[Path]) -> None:
    seen: dict[str, Path] = {}
    for path in paths:
        real = os.path.realpath(path)
        if real in seen:
            raise ParameterError(
                f"{seen[real]} and {path} are the same file: each result needs one of its own"
            )
        seen[real] = path
