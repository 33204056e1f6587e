"""Files that appear whole or not at all."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

__all__ = ["write_atomically"]


_UMASK = os.umask(0)  # it can only be read by setting it: once, at import
os.umask(_UMASK)


def write_atomically(path: str | os.PathLike[str], content: str | bytes) -> Path:
    """Write `content` to a temporary file beside `path`, then rename: readers never see half a
    file.
    """
    target = Path(os.path.realpath(path))  # through a symbolic link, not over it
    data = content.encode("utf-8") if isinstance(content, str) else content
    if (
        target.exists() and not target.is_file()
    ):  # a pipe or a terminal: nothing there to keep whole
        Path(path).write_bytes(data)
        return Path(path)
    handle, temporary = tempfile.mkstemp(
        dir=target.parent, prefix=f".{target.name}.", suffix=".tmp"
    )
    try:
        with os.fdopen(handle, "wb") as stream:
            stream.write(data)
        os.chmod(temporary, 0o666 & ~_UMASK)
        os.replace(temporary, target)
    except BaseException:
        Path(temporary).unlink(missing_ok=True)
        raise
    return Path(path)
