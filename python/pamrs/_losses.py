"""Records parts of a work that failed, so that the others go on.

Errors that the work expects are handled where they arise; here is what nobody expected: a mistake
of the program, a matrix that cannot be inverted, memory that is not there. Under a test
(``PAMRS_STRICT`` in the environment, which ``conftest.py`` sets) it is raised as it is, so
that a mistake cannot hide in a warning.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Callable
from typing import Final, TypeVar, overload

STRICT: Final = "PAMRS_STRICT"
"""Variable of the environment under which nothing is left out: what fails is raised."""

Found = TypeVar("Found")
Instead = TypeVar("Instead")


def reason(error: BaseException) -> str:
    """Kind and message of an error on one line."""
    message = " ".join(str(error).split())
    kind = type(error).__name__
    return f"{kind}: {message[:300]}" if message else kind


class Losses:
    """Parts of a work that failed and were left out; threads may share one.

    Attributes
    ----------
    sentences : list of str
        One for each, in the order in which they failed.
    """

    def __init__(self) -> None:
        self.sentences: list[str] = []
        self._lock = threading.Lock()

    @overload
    def part(
        self,
        what: str,
        work: Callable[[], Found],
        instead: None = None,
        *,
        through: tuple[type[Exception], ...] = (),
    ) -> Found | None: ...

    @overload
    def part(
        self,
        what: str,
        work: Callable[[], Found],
        instead: Instead,
        *,
        through: tuple[type[Exception], ...] = (),
    ) -> Found | Instead: ...

    def part(
        self,
        what: str,
        work: Callable[[], Found],
        instead: Instead | None = None,
        *,
        through: tuple[type[Exception], ...] = (),
    ) -> Found | Instead | None:
        """Do a part of the work; return its result, or a substitute where it fails.

        Parameters
        ----------
        what : str
            The work, as the sentence that tells of its loss names it.
        work : callable
            Does it.
        instead : object, optional
            Given where it fails.
        through : tuple of type, optional
            Errors that are no loss of a part: they are raised.

        Returns
        -------
        object
        """
        try:
            return work()
        except Exception as error:
            if os.environ.get(STRICT) or isinstance(error, through):
                raise
            self.add(what, error)
            return instead

    def add(self, what: str, error: BaseException) -> None:
        """Note that a part failed and was left out, with the reason."""
        self.tell(f"{what} failed and was left out ({reason(error)}); please report it")

    def tell(self, text: str) -> None:
        """Note a sentence, unless it is noted already."""
        with self._lock:
            if text not in self.sentences:
                self.sentences.append(text)
