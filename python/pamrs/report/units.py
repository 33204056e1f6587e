"""Channels that are likely in another unit than their log says, in words."""

from __future__ import annotations

import math

from pamrs.findings import Misread
from pamrs.report.text import listed
from pamrs.units import in_words


def misread_sentence(entry: Misread, unit: str) -> str:
    """What is likely, and the evidence, in the unit of the log."""
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
    """What to do about it."""
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
