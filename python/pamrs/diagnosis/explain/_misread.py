"""Diagnosis of recordings whose channels are in other units than their log says."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

from pamrs.diagnosis.explain._block_entries import not_judged
from pamrs.diagnosis.fit import Problem
from pamrs.diagnosis.prepare import Unjudged
from pamrs.diagnosis.result import Diagnosis
from pamrs.diagnosis.search import Reading
from pamrs.findings import ChannelError, FitErrors, Misread, NextExperiment, Where
from pamrs.recordings import Case
from pamrs.report.words import listed
from pamrs.units import in_words


def misread_diagnosis(
    case: Case,
    fitted: Problem,
    reading: Reading,
    unjudged: Sequence[Unjudged],
    errors: Mapping[str, dict[str, ChannelError]],
) -> Diagnosis:
    """Diagnosis of a case whose channels are to be read in another unit.

    Parameters
    ----------
    case : Case
        The case.
    fitted : Problem
        Recordings to fit, as their log is said to be.
    reading : Reading
        The way to read them, with its fits.
    unjudged : sequence of Unjudged
        Blocks that could not be judged in any case.
    errors : mapping of str to dict
        Errors of each channel, by the role of the recordings (``fit``, ``held_out``).
    """
    why = "the unit of what surrounds it is settled first"
    blocks = [Unjudged(block.name, block.covers, why) for block in fitted.blocks]
    most = fitted.settings.most_probability
    channels = list(reading.channels)
    entry = Misread(
        channels=channels,
        said=reading.said,
        likely=reading.likely,
        factors=list(reading.factors),
        offset=reading.offset,
        before=reading.before,
        after=reading.after,
        text="",
        gain=reading.gain,
        std=reading.std,
    )
    unit = fitted.recordings[0].recording.said.get(channels[0], "")
    text, advice = misread_sentence(entry, unit), misread_advice(entry)
    return Diagnosis(
        case=case.name,
        verdict="units",
        misread=[replace(entry, text=text)],
        where=Where(channel=channels[0], text=advice),
        probabilities={"units": most, "unlisted": 1.0 - most},
        blocks=[not_judged(block) for block in (*blocks, *unjudged)],
        fit=FitErrors(errors["fit"], errors["held_out"]),
        next_experiment=NextExperiment(text=f"None yet. {advice}"),
        text=f"{text[:1].upper()}{text[1:]}.\n\n{advice}",
        rig=case.rig,
        measured=list(case.channels),
        settings=fitted.settings,
    )


def misread_sentence(entry: Misread, unit: str) -> str:
    """Sentence with the likely unit and its evidence, in the unit of the log."""
    names, many = listed(entry.channels), len(entry.channels) > 1
    verb = "are" if many else "is"
    if entry.offset:
        what = (
            f"{names} {verb} likely {entry.likely} and not {entry.said}: with "
            f"{in_words(unit, 'pressure', abs(entry.offset))} "
            f"{'taken off' if entry.offset < 0.0 else 'added'}"
        )
    else:
        what = f"{names} {verb} likely in {entry.likely}, not in {entry.said}"
    if math.isfinite(entry.gain):
        return (
            f"{what}, or {'their gauges have' if many else 'its gauge has'} another gain: with "
            f"parameters that move inside their tolerances the values times {entry.gain:.4f} +- "
            f"{entry.std:.1g} fit best, and {entry.likely} over {entry.said} is "
            f"{entry.factors[0]:.4f}"
        )
    what += "" if entry.offset else ": read so,"
    return (
        f"{what} the refitted model leaves {entry.after:.2g} times the variance of the noise "
        f"instead of {entry.before:.2g} times, and a free "
        f"{'offset' if entry.offset else 'factor'} would be the same"
    )


def misread_advice(entry: Misread) -> str:
    """Sentence that says how to correct a wrong unit."""
    how = f"write {entry.likely}"
    if entry.likely == "absolute":
        how = "subtract the ambient pressure"
    elif entry.offset:
        how = "give the values as they are, as gauge pressures"
    elif not math.isnan(entry.gain):
        how += f", or with its calibration scale = {entry.gain:.4f},"
    return (
        f"No physics was judged, since a wrong unit looks like missing physics: {how} for "
        f"{listed(entry.channels)} (in the heading, or in case.toml), or check the sensor where "
        "the log is right, and diagnose again."
    )
