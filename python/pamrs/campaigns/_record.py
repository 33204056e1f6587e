"""A recording as it comes: a device that writes down what is read of it and written to it, row by
row, each on the disk's way before the next one.
"""

from __future__ import annotations

import math
import os
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any, TextIO

from pamrs.channels import unit_of
from pamrs.control.live import Clock, Device


class Recorder:
    """A device behind which every row is kept: what was read, and the command that answered it.

    Parameters
    ----------
    device : Device
        The plant.
    path : Path
        The file, a table with units in its headings; made at once, so that a disk that cannot be
        written is known before anything moves.
    channels : collection of str
        What is kept of the readings.
    commands : collection of str
        What is written, by channel.
    plausible : mapping of str to (float, float)
        Lowest and highest value that a channel can have [SI].
    clock : Clock
        Of the loop; a device that tells its own ``time`` [s] is believed.

    Attributes
    ----------
    rows : int
        Kept so far.
    due : mapping of str to float or None
        A reading that is kept with the next command.
    trouble : str
        Why the last reading could not be used; empty where it could.
    """

    def __init__(
        self,
        device: Device,
        path: Path,
        channels: Collection[str],
        commands: Collection[str],
        plausible: Mapping[str, tuple[float, float]],
        clock: Clock,
    ) -> None:
        self.device, self.path, self.clock = device, path, clock
        self.channels, self.commands, self.plausible = channels, tuple(commands), plausible
        self.rows, self.trouble = 0, ""
        self.due: Mapping[str, float] | None = None
        self._file: TextIO = path.open("x", encoding="utf-8", newline="\n")
        self._kept: list[str] = []
        self._began = math.nan

    def read(self) -> Mapping[str, float] | None:
        """A reading that can be, or None."""
        begun = self.clock.now()
        try:
            given = self.device.read()
        except Exception as error:  # whatever a driver raises
            self.trouble = f"read() failed: {type(error).__name__} {error}"
            return None
        took = self.clock.now() - begun
        self.trouble = f"it took {took:.3g} s to answer, or its readings stand still"
        if given is None:
            self.trouble = "it gave no reading"
            return None
        known = ("time", *self.commands, *self.channels)
        for name, value in given.items():
            if name not in known:
                self.trouble = f"its channel {name} is not allowed: one of {', '.join(known)}"
                return None
            low, high = self.plausible.get(name, (-math.inf, math.inf))
            if not (math.isfinite(value) and low <= value <= high):
                allowed = f"{low:.5g} to {high:.5g}" if math.isfinite(low) else "a finite number"
                self.trouble = f"{name} = {value:.5g} is not allowed: {allowed} [SI]"
                return None
        return {"time": begun, **given}

    def write(self, command: Any) -> None:
        """Tell the device, and keep the row that this command answers."""
        self.device.write(command)
        due, self.due = self.due, None
        if due is not None:
            values = command if isinstance(command, Mapping) else {self.commands[0]: command}
            self._keep(due, values)

    def _keep(self, reading: Mapping[str, float], command: Mapping[str, float]) -> None:
        if not self._kept:
            self._kept = [name for name in self.channels if name in reading]
            heads = [*self.commands, *self._kept]
            self._line(["time [s]", *(f"{name} [{unit_of(name)}]" for name in heads)])
            self._began = reading["time"]
        values = [reading["time"] - self._began, *(command[name] for name in self.commands)]
        values += [reading[name] for name in self._kept]
        self._line([f"{value:.9g}" for value in values])
        self.rows += 1

    def _line(self, cells: list[str]) -> None:
        try:
            self._file.write(",".join(cells) + "\n")
            self._file.flush()
        except OSError as error:
            raise OSError(error.errno, os.strerror(error.errno or 0), str(self.path)) from None

    def close(self) -> None:
        """End the file."""
        try:
            self._file.close()
        except OSError:  # what a full disk did not take was reported as it was written
            return
