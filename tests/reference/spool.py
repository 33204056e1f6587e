"""Spools that are not at once where their command says.

A spool of second order is a mass on a spring, ``y'' = w^2 (x - y) - 2 zeta w y'``, between two
stops at which it loses its speed (Richer & Hurmuzlu, ASME J. Dyn. Syst. Meas. Control 122, 2000),
integrated here adaptively from stop to stop. One that switches is an interval of current after the
other: the spool moves a delay after an interval began, if the interval is longer than that (van
Varseveld & Bone, IEEE/ASME Trans. Mechatronics 2, 1997).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

#: A position over some time: from when to when (s), and what it is then, or at a time.
Piece = tuple[float, float, float | Callable[[float], float]]

POSITIONS = {"fill": 1.0, "vent": -1.0, "closed": 0.0}


def pieces_of(part: Mapping[str, Any], command: Sequence[float], sample_time: float) -> list[Piece]:
    """Normalised position of a valve's spool over a run of held commands (V), the last one left
    out, piece by smooth piece.
    """
    x = [min(max((u - part["null_voltage"]) / part["half_range"], -1.0), 1.0) for u in command[:-1]]
    spool = part.get("spool", "ideal")
    if spool == "second_order":
        return _sprung(part, x, sample_time)
    if spool == "switching":
        return _switched(part, x, sample_time)
    return [(k * sample_time, (k + 1) * sample_time, aim) for k, aim in enumerate(x)]


def _sprung(part: Mapping[str, Any], x: Sequence[float], sample_time: float) -> list[Piece]:
    w, zeta = math.tau * part["natural_frequency"], part["damping_ratio"]
    pieces: list[Piece] = []
    y, rate = x[0], 0.0  # at rest where its first command holds it
    for k, aim in enumerate(x):
        time, end = k * sample_time, (k + 1) * sample_time
        while time < end - 1e-12:
            if abs(y) == 1.0 and rate == 0.0 and aim * y >= 1.0:
                pieces.append((time, end, y))
                break

            def motion(_: float, s: Any, aim: float = aim) -> list[float]:
                return [s[1], w * w * (aim - s[0]) - 2.0 * zeta * w * s[1]]

            def out(_: float, s: Any) -> float:
                return float(abs(s[0]) - 1.0 - 1e-13)

            out.terminal, out.direction = True, 1.0  # type: ignore[attr-defined]
            run = solve_ivp(
                motion,
                (time, end),
                [y, rate],
                method="DOP853",
                rtol=1e-12,
                atol=[1e-13, 1e-13 * w],
                max_step=0.2 / w,
                events=out,
                dense_output=True,
            )
            struck = _grazed(run, out)
            stop = float(run.t[-1]) if struck is None else struck
            pieces.append((time, stop, partial(_along, run.sol)))
            y, rate = (float(v) for v in run.sol(stop))
            time = stop
            if run.status == 1 or struck is not None:
                y, rate = math.copysign(1.0, y), 0.0
    return pieces


def _grazed(run: Any, out: Callable[[float, Any], float]) -> float | None:
    """When a spool first struck a stop and would have turned within the same step, so that no step
    ended beyond it; None if it did not.
    """
    for first, then, was, now in zip(run.t, run.t[1:], run.y[1], run.y[1, 1:], strict=False):
        if was * now < 0.0:
            turn = brentq(lambda t: run.sol(t)[1], first, then, xtol=1e-15)
            if out(turn, run.sol(turn)) > 0.0:
                return float(brentq(lambda t: out(t, run.sol(t)), first, turn, xtol=1e-15))
    return None


def _along(solution: Callable[[float], Any], time: float) -> float:
    return float(solution(time)[0])


def _switched(part: Mapping[str, Any], x: Sequence[float], sample_time: float) -> list[Piece]:
    rest = POSITIONS[part["without_current"]]
    opening, closing = part.get("opening_delay", 0.0), part.get("closing_delay", 0.0)
    last = len(x) * sample_time
    coil = _coil(part, x, sample_time)
    position, began = coil[0][2], 0.0
    pieces: list[Piece] = []

    def move(time: float, to: float) -> None:
        nonlocal position, began
        if time >= last:
            return
        pieces.append((began, time, position))
        position, began = to, time

    for start, end, aim in coil:
        lasted = end - start
        if position not in (aim, rest):
            if lasted <= closing:
                continue
            move(start + closing, rest)
        delay = (
            closing if aim == rest else max(opening, closing if pieces and began >= start else 0.0)
        )
        if position != aim and lasted > delay:
            move(start + delay, aim)
    pieces.append((began, last, position))
    return pieces


def _coil(
    part: Mapping[str, Any], x: Sequence[float], sample_time: float
) -> list[tuple[float, float, float]]:
    """Intervals in which the coils take the spool to one position: from, to (s), where."""
    with_current, rest = part["with_current"], POSITIONS[part["without_current"]]
    last = len(x) * sample_time

    def taken(duty: float) -> float:
        return math.copysign(1.0, duty) if with_current == "either" else POSITIONS[with_current]

    duties = x if with_current == "either" else [max(value, 0.0) for value in x]
    frequency = part.get("carrier_frequency", 0.0)
    found: list[tuple[float, float, float]] = []
    if frequency == 0.0:
        found = [
            (k * sample_time, (k + 1) * sample_time, taken(d) if abs(d) > 0.5 else rest)
            for k, d in enumerate(duties)
        ]
    else:
        phase = part.get("carrier_phase", 0.0)
        for k in range(math.floor(-phase), math.ceil(last * frequency)):
            begin, end = (k + phase) / frequency, (k + 1 + phase) / frequency
            sample = min(max(math.floor(begin / sample_time + 1e-9), 0), len(duties) - 1)
            duty = duties[sample]
            # a full period is one: no rounding error is a gap behind it
            off = end if abs(duty) >= 1.0 else begin + abs(duty) / frequency
            found += [(begin, off, taken(duty)), (off, end, rest)]
    merged: list[tuple[float, float, float]] = []
    for begin, end, aim in found:
        begin, end = max(begin, 0.0), min(end, last)
        if end - begin <= 0.0:
            continue
        if merged and merged[-1][2] == aim:
            merged[-1] = (merged[-1][0], end, aim)
        else:
            merged.append((begin, end, aim))
    first = merged[0]
    merged[0] = (-np.inf, first[1], first[2])  # it has been so for long
    # the last one goes on behind the end
    merged[-1] = (merged[-1][0], np.inf, merged[-1][2])
    return merged
