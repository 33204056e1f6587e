"""When commands acted: told of a log beside the loop, and never of a gas that begins warm."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

import pamrs
from pamrs.diagnosis.fit import Problem, with_offsets
from pamrs.diagnosis.fit._offsets import _misfits, _moved_alike, _with_later_commands
from pamrs.diagnosis.prepare import averaged, with_unjudged_starts
from pamrs.recordings import Recording
from pamrs.rig import parse_rig
from tests.diagnosis.asked import diagnosed, problem_of
from tests.diagnosis.noisy import GAUGES, noisy
from tests.diagnosis.stands import WARM, vented

RIG = parse_rig(WARM)


def problem(recordings: Sequence[Recording]) -> Problem:
    all_of = problem_of(RIG, recordings)
    ready = [with_unjudged_starts(all_of.blocks, all_of.core, p) for p in all_of.recordings]
    return replace(all_of, recordings=ready)


@pytest.mark.parametrize("skipped", [0.6, 0.9])
def test_a_gas_that_begins_warm_is_no_offset(skipped: float) -> None:
    """The held-out one begins 17 and 5 K above the room behind an open valve, where its pressure
    stands still: its commands seemed to act 0.26 of a sample late, those of the others 0.2.
    """
    recordings = [vented(RIG, "fit", k) for k in range(2)]
    recordings.append(vented(RIG, "held_out", 2, skipped=skipped))
    every = problem(recordings)
    _, offsets = _moved_alike(every, RIG)
    assert offsets == {}
    missed, count = _misfits(every, RIG)[2]
    assert missed < 1.1 * count  # 4.4 and 1.4 where it has to begin as warm as the room


def beside_the_loop(role: str, seed: int, late: bool = True) -> Recording:
    """Eight seconds of a loop of 200 Hz, logged at 500 Hz: a command is seen at the next sample."""
    rng = np.random.default_rng(seed)
    steps = 5.0 + rng.uniform(0.5, 4.0, 17) * np.tile([1.0, -1.0], 9)[:17]
    rows = np.arange(
        8000
    )  # of a millisecond; the loop sends at odd ones, too, the log has even ones
    command = steps[(rows + 495 + (0 if late else 1)) // 500]
    run = pamrs.simulate(RIG, valve_command=command, sample_time=0.001)
    channels = {"valve_command": command[::2]} | {name: run[name][::2] for name in GAUGES}
    return noisy(f"r{seed}", role, 0.002, channels, GAUGES, [7, seed])


@pytest.mark.parametrize("late", [True, False])
def test_a_log_beside_the_loop_has_its_commands_moved(late: bool) -> None:
    """At odd milliseconds each command acts half a sample before the log sees it."""
    logs = [beside_the_loop(role, k, late) for k, role in enumerate(("fit", "held_out"))]
    fitted, held = (problem([averaged(log, 5)]) for log in logs)
    moved, said = with_offsets([fitted, held], RIG)
    told = [float(re.search(r"act (\S+) of a sample of the log earlier", t)[1]) for t in said]
    assert told == ([pytest.approx(0.5, abs=0.1)] * 2 if late else [])
    for was, now in zip((fitted, held), moved, strict=True):
        (before, count), (after, _) = _misfits(was, RIG)[0], _misfits(now, RIG)[0]
        assert after < 1.1 * count
        assert not late or before > after + 100.0


def test_what_was_moved_is_no_finer_than_a_pressure_tells() -> None:
    """A million samples at 1 kHz were 64 million numbers for each command."""
    (one,) = problem([vented(RIG, "fit", 0)]).recordings
    changes = np.flatnonzero(np.diff(one.held["valve_command"])) + 1
    for share in (0.5, -0.5):
        moved = _with_later_commands(one, np.full(changes.size, share)).held["valve_command"]
        parts = moved.size // one.n
        assert parts == 32  # of 5 ms
        at = np.flatnonzero(np.diff(moved)) + 1
        assert np.array_equal(at, parts * changes + int(share * parts))
        assert set(moved) == set(one.held["valve_command"])


def test_a_diagnosis_says_how_commands_were_moved() -> None:
    found = diagnosed(RIG, beside_the_loop, ("fit", "held_out"))
    assert found.verdict == "none"
    assert sum("of a sample of the log earlier" in text for text in found.warnings) == 2
