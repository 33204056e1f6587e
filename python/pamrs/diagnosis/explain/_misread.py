"""A diagnosis of recordings whose channels are in other units than their log says: that, and
nothing else.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from pamrs.diagnosis.explain._block_entries import not_judged
from pamrs.diagnosis.fit import Problem
from pamrs.diagnosis.prepare import Unjudged
from pamrs.diagnosis.result import Diagnosis
from pamrs.diagnosis.search import Reading
from pamrs.findings import ChannelError, FitErrors, Misread, NextExperiment, Where
from pamrs.recordings import Case
from pamrs.units import bar_and_psi

__all__ = ["misread_diagnosis"]


def misread_diagnosis(
    case: Case,
    fitted: Problem,
    reading: Reading,
    unjudged: Sequence[Unjudged],
    errors: Mapping[str, dict[str, ChannelError]],
) -> Diagnosis:
    """The diagnosis of a case whose channels are to be read in another way.

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
    text, advice = _told(reading), _advice(reading)
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
        text=text,
    )
    return Diagnosis(
        case=case.name,
        verdict="units",
        misread=[entry],
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


def _names(reading: Reading) -> str:
    *first, last = reading.channels
    return f"{', '.join(first)} and {last}" if first else last


def _told(reading: Reading) -> str:
    """What is likely, and the evidence."""
    names, many = _names(reading), len(reading.channels) > 1
    verb = "are" if many else "is"
    if reading.offset:
        what = (
            f"{names} {verb} likely {reading.likely} and not {reading.said}: with "
            f"{bar_and_psi(abs(reading.offset))} "
            f"{'taken off' if reading.offset < 0.0 else 'added'}"
        )
    else:
        what = f"{names} {verb} likely in {reading.likely}, not in {reading.said}"
    if math.isfinite(reading.gain):
        return (
            f"{what}, or {'their gauges have' if many else 'its gauge has'} another gain: with "
            f"parameters that move inside their tolerances the values times {reading.gain:.4f} +- "
            f"{reading.std:.1g} fit best, and {reading.likely} over {reading.said} is "
            f"{reading.factors[0]:.4f}"
        )
    what += "" if reading.offset else ": read so,"
    return (
        f"{what} the refitted model leaves {reading.after:.2g} times the variance of the noise "
        f"instead of {reading.before:.2g} times, and a free "
        f"{'offset' if reading.offset else 'factor'} would be the same"
    )


def _advice(reading: Reading) -> str:
    """What to do about it."""
    how = (
        "subtract the ambient pressure"
        if reading.likely == "absolute"
        else "give the values as they are, as gauge pressures"
        if reading.offset
        else f"write {reading.likely}"
        if math.isnan(reading.gain)
        else f"write {reading.likely}, or with its calibration scale = {reading.gain:.4f},"
    )
    return (
        f"No physics was judged, since a wrong unit looks like missing physics: {how} for "
        f"{_names(reading)} (in the heading, or in case.toml), or check the sensor where the log "
        "is right, and diagnose again."
    )
