"""Standard output and error that lose nothing silently, and send nothing that a file hides in a
name.

A stream that takes nothing (closed, a full disk, a reader that is gone) ends no work: what it was
to say goes to the other stream, and the exit code says so at the end.
"""

from __future__ import annotations

import contextlib
import io
import os
import sys
from collections.abc import Iterator
from typing import IO, Any

from pamrs._files import shown


class _Guarded(io.TextIOBase):
    """A text stream whose errors are kept, and in which control characters are shown.

    Attributes
    ----------
    inner : file or None
        The stream itself; None where it is closed.
    lost : str
        Why something could not be written; empty where all was.
    """

    def __init__(self, inner: IO[str] | None, name: str) -> None:
        super().__init__()
        self.inner, self.name, self.lost = inner, name, ""
        self.other: _Guarded | None = None

    @property
    def encoding(self) -> str:  # type: ignore[override]
        """Encoding of the inner stream, ``utf-8`` where it has none."""
        return getattr(self.inner, "encoding", None) or "utf-8"

    @property
    def errors(self) -> str:  # type: ignore[override]
        """Error handler: characters that cannot be encoded are shown by their number."""
        return "backslashreplace"

    def isatty(self) -> bool:
        """True where the inner stream is a terminal."""
        return self.inner is not None and self.inner.isatty()

    def fileno(self) -> int:
        """File number of the inner stream; an error where it is closed."""
        if self.inner is None:
            raise io.UnsupportedOperation("fileno")
        return self.inner.fileno()

    def writable(self) -> bool:
        """True always: writing is never refused."""
        return True

    def write(self, text: str) -> int:
        """Write text; where this stream takes none, to the other stream."""
        encoding = self.encoding
        safe = shown(text, lines=True).encode(encoding, "backslashreplace").decode(encoding)
        if not self._sent(safe) and self.other is not None:
            self.other._sent(safe)
        return len(text)

    def flush(self) -> None:
        """Do nothing: text is sent as it is written."""

    def _sent(self, text: str) -> bool:
        """Write a text to the inner stream; True where that worked."""
        if self.lost:
            return False
        try:
            if self.inner is None:
                self.lost = "it is closed"
                return False
            self.inner.write(text)
            self.inner.flush()
        except (OSError, ValueError) as error:
            self.lost = getattr(error, "strerror", None) or str(error)
            self._drop()
        return not self.lost

    def _drop(self) -> None:
        """Discard the buffered rest, which the end of the process would try to write again."""
        with contextlib.suppress(OSError, ValueError):
            nowhere = os.open(os.devnull, os.O_WRONLY)
            os.dup2(nowhere, self.fileno())
            os.close(nowhere)


@contextlib.contextmanager
def guarded() -> Iterator[list[str]]:
    """Guard standard output and error while it is open.

    Yields
    ------
    list of str
        Filled at the end: what could not be written, and why.
    """
    if sys.stdout is None or sys.stderr is None:
        _fill()
    before = sys.stdout, sys.stderr
    out, err = _Guarded(before[0], "standard output"), _Guarded(before[1], "standard error")
    out.other = err
    lost: list[str] = []
    sys.stdout, sys.stderr = out, err
    try:
        yield lost
    finally:
        sys.stdout, sys.stderr = before
        lost += [f"{one.name} ({one.lost})" for one in (out, err) if one.lost]


def _fill() -> None:
    """Occupy the numbers of closed standard streams, so that no file is opened under them."""
    while (number := os.open(os.devnull, os.O_RDWR)) <= 2:  # noqa: PLR2004
        pass
    os.close(number)


def terminal() -> Any:
    """Inner stream of standard error, for output that moves the cursor."""
    return sys.stderr.inner if isinstance(sys.stderr, _Guarded) else sys.stderr
