"""A diagnosis in a process of its own: the page stays quick, and ending it is immediate."""

from __future__ import annotations

import multiprocessing
import shutil
import signal
import sys
import tempfile
import threading
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, Final

from pamrs._writing import write_atomically
from pamrs.errors import PamrsError
from pamrs.report.words import hypothesis_label

RESULT: Final = "result"
"""Folder of the results, in the case folder."""
FILES: Final = ("report.html", "result.json", "model.toml", "experiment.csv")
_MADE: Final = ".result-"  # where they are made, and then moved from
_LINES: Final = 200  # of the progress that are kept
_SCREENED: Final = ": screened: "  # of the line that ranks hypotheses, the first first
_MOST: Final = 3  # of them that are shown
_PATIENCE: Final = 5.0  # s that an ended process gets to be gone


def _work(folder: Path, pipe: Connection) -> None:
    """Diagnose a case, write its results, and send lines, at last an error's text or nothing."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the page, which ends this

    def send(item: object) -> None:
        try:
            pipe.send(item)
        except OSError:  # the page is gone, and nobody waits for this
            sys.exit(1)

    def tell(line: str) -> None:
        send((str(line), getattr(line, "share", None), getattr(line, "left", None)))

    try:
        _diagnose(folder, tell)
    except (PamrsError, OSError) as error:
        send(str(error))
    except Exception as error:
        send(f"the diagnosis failed ({type(error).__name__}: {error}); please report it")
    else:
        send("")


def _diagnose(folder: Path, tell: Any) -> None:
    from pamrs.diagnosis import diagnose
    from pamrs.rig import Rig

    found = diagnose(folder, progress=tell)
    rig, protocol = found.rig, found.next_experiment.protocol
    model = rig.with_case("..").to_toml_text() if isinstance(rig, Rig) else found.model
    target = folder / RESULT
    with tempfile.TemporaryDirectory(prefix=_MADE, dir=folder) as place:
        made = Path(place, RESULT)
        made.mkdir()
        found.report(made / "report.html")
        found.to_json(made / "result.json")
        write_atomically(made / "model.toml", model)
        if protocol is not None:
            write_atomically(made / "experiment.csv", protocol.to_csv())
        target.mkdir(exist_ok=True)
        for name in FILES:
            if (made / name).exists():
                (made / name).replace(target / name)
            else:
                (target / name).unlink(missing_ok=True)


class Run:
    """A diagnosis of a case folder that goes on.

    Parameters
    ----------
    folder : Path
        The case folder; its results are written to ``result`` in it.

    Attributes
    ----------
    lines : list of str
        What it said, the newest last.
    share, left : float or None
        How much is done (0 to 1), and how long it will go on [s].
    error : str
        Why there is no result; empty otherwise.
    running : bool
        Whether it goes on.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self.lines: list[str] = []
        self.share: float | None = 0.0
        self.left: float | None = None
        self.error, self.running = "", True
        context = multiprocessing.get_context("spawn")
        self._pipe, theirs = context.Pipe(duplex=False)
        self._process = context.Process(target=_work, args=(folder, theirs), daemon=True)
        self._process.start()
        theirs.close()
        self._listener = threading.Thread(target=self._listen, daemon=True)
        self._listener.start()

    def _listen(self) -> None:
        outcome: str | None = None
        try:
            while outcome is None:
                item = self._pipe.recv()
                if isinstance(item, str):
                    outcome = item
                else:
                    line, self.share, self.left = item
                    self.lines = [*self.lines[-_LINES:], line]
        except (EOFError, OSError):
            pass
        self._process.join(_PATIENCE)
        for left in self._folder.glob(f"{_MADE}*"):  # of one that was ended
            shutil.rmtree(left, ignore_errors=True)
        if outcome is None:
            code = self._process.exitcode
            outcome = f"the diagnosis ended without a result (exit code {code})"
        self.error, self.running = self.error or outcome, False

    @property
    def leading(self) -> list[str]:
        """The hypotheses in the lead so far, in words, a text for each part of the rig."""
        found: dict[str, str] = {}
        for line in self.lines:
            part, separator, names = line.partition(_SCREENED)
            keys = [one.rpartition(" ")[0] for one in names.split(", ")[:_MOST]]
            if separator and all(keys):
                words = ", ".join(hypothesis_label(key) for key in keys)
                found[part] = f"{part}: in the lead {'is' if len(keys) == 1 else 'are'} {words}"
        return list(found.values())

    def cancel(self) -> None:
        """End it at once; nothing is written then."""
        if self.running:
            self.error = "cancelled"
            self._process.kill()
            self._listener.join(_PATIENCE)
