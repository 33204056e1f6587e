"""What a person sends: pressures that the chains of a rig are to follow, and on a load frame the
length, made into an experiment.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pamrs.experiments._chains import Chain, Range, sent_for
from pamrs.experiments._experiment import (
    Experiment,
    in_mm,
    limited,
    of_commands,
)
from pamrs.experiments._frame import Frame
from pamrs.rig import Rig

__all__ = ["Stand"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Stand:
    """A rig with those of its chains that are moved.

    Attributes
    ----------
    rig : Rig
        The rig.
    chains : list of Chain
        Its chains.
    sample_time : float
        Time between samples [s].
    bandwidth : float
        Of the loops by which commands of valves are found [rad/s].
    frame : Frame or None
        What its load frame may do; None where it has none.
    """

    rig: Rig
    chains: list[Chain]
    sample_time: float
    bandwidth: float
    frame: Frame | None = None

    @property
    def regulated(self) -> bool:
        """Whether its pressures are set by regulators that the rig describes."""
        return self.chains[0].regulator is not None

    @property
    def given(self) -> bool:
        """Whether its pressures are set by a bench that the rig does not describe."""
        return not (self.regulated or self.chains[0].valves)

    def period(self, seconds: float, rise: float) -> float:
        """Period of a triangle over so much pressure [Pa]: so many seconds, or longer where a bench
        cannot set pressures so fast.
        """
        if self.frame is None or not self.given:
            return seconds
        return max(seconds, round(2.02 * rise / self.frame.pressure_rate, 1))

    def driven(
        self,
        name: str,
        text: str,
        excitation: dict[str, Any],
        references: Mapping[str, Array],
        *,
        length: Array | None = None,
        changes: dict[str, float] | None = None,
        initial: dict[str, float] | None = None,
        extra: float = 0.0,
        needs: str = "",
        **options: Any,
    ) -> Experiment:
        """The experiment whose pressures follow references.

        Parameters
        ----------
        name, text, excitation
            As of :class:`Experiment`.
        references : mapping of str to (n,) array
            Gauge pressure [Pa] by the name of each chain.
        length : (n,) array, optional
            Of the muscle on a load frame [m]; held by default, which the text then says.
        changes, initial, needs
            As of :class:`Experiment`.
        extra : float
            What is done by hand, as time [s].
        **options
            ``shut``, ``dither`` and another ``bandwidth``, for the loops that find the commands of
            valves.
        """
        rig = self.rig.with_parameters(changes) if changes else self.rig
        if self.regulated:
            references = {n: np.clip(values, 0.0, None) for n, values in references.items()}
        if self.frame is not None and self.given:
            references, told = self._reachable(self.frame, references)
            text += told
        if self.frame is not None:
            length, text, numbers = _moved(self.frame, length, text, references, self.sample_time)
            excitation = {**excitation, **numbers}
        sent = sent_for(
            rig,
            references,
            length=length,
            sample_time=self.sample_time,
            initial=initial,
            **{"bandwidth": self.bandwidth, **options},
        )
        return of_commands(
            name,
            text,
            excitation,
            sent,
            self.sample_time,
            initial=initial,
            changes=changes,
            extra=extra,
            needs=needs,
        )

    def _reachable(
        self, frame: Frame, references: Mapping[str, Array]
    ) -> tuple[dict[str, Array], str]:
        """References that begin where a muscle pulls and rise and fall as fast as a bench can set
        pressures, and what to say of that.
        """
        found, slower = {}, False
        for name, values in references.items():
            span: Range = frame.spans.alone[name]
            inside = np.clip(values, span.low, span.high)
            found[name] = limited(inside, frame.pressure_rate * self.sample_time)
            slower |= bool(np.abs(found[name] - inside).max() > 0.01 * (span.high - span.low))
        told = f", the pressure by no more than {frame.pressure_rate * 1e-5:.2g} bar/s"
        return found, told if slower else ""


def _moved(
    frame: Frame,
    length: Array | None,
    text: str,
    references: Mapping[str, Array],
    sample_time: float,
) -> tuple[Array, str, dict[str, Any]]:
    """The length that a frame prescribes, what is said of it, and the numbers."""
    if length is None:
        rows = next(iter(references.values())).size
        held = {"length_mm": in_mm(frame.held)}
        return (
            np.full(rows, frame.held),
            f"with the length held at {in_mm(frame.held):g} mm, {text}",
            held,
        )
    inside = np.clip(length, frame.lengths.low, frame.lengths.high)
    return limited(inside, frame.rate * sample_time), text, {}
