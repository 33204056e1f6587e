"""A diagnosis of recordings whose channels are in other units than their log says: that, and
nothing else.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from pamrs.diagnosis.explain._block_entries import not_judged
from pamrs.diagnosis.fit import Problem
from pamrs.diagnosis.prepare import Unjudged
from pamrs.diagnosis.result import Diagnosis
from pamrs.diagnosis.search import Reading
from pamrs.findings import ChannelError, FitErrors, Misread, NextExperiment, Where
from pamrs.recordings import Case
from pamrs.report.units import misread_advice, misread_sentence


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
