"""Scores of predictions: residuals of a new recording under models that were fitted before it."""

from __future__ import annotations

from collections.abc import Sequence

from pamrs.diagnosis.next_experiment._choice import Modelled
from pamrs.diagnosis.next_experiment._differences import (
    errors_of,
    linear,
    measurable,
    misfit,
    problem_of,
)
from pamrs.diagnosis.prepare import prepare
from pamrs.diagnosis.settings import DiagnosisSettings
from pamrs.recordings import Recording


def foretold(
    hypotheses: Sequence[Modelled], recording: Recording, settings: DiagnosisSettings
) -> dict[str, dict[str, float]]:
    """Residuals of each hypothesis in a recording that it was not fitted to, its parameters moved
    no farther than what was known of them before.

    Parameters
    ----------
    hypotheses : sequence of (label, rig, probability)
        Rigs as fitted, with their effects.
    recording : Recording
        Of the same rig; parameters that had another value in it have that.
    settings : DiagnosisSettings
        Settings that it is made ready with.

    Returns
    -------
    dict of str to dict of str to float
        By label what is left of each channel: root mean square in bins of 0.1 s, 1 where noise is
        all [noise levels].

    Raises
    ------
    DiagnosisError
        If the channels of the recording surround no block.
    SimulationError
        If a model leaves the range in which it holds.
    """
    found = {}
    for label, rig, _ in hypotheses:
        own = tuple(name for name in measurable(rig) if name in recording.channels)
        prepared = prepare(recording, rig, settings)
        problem = problem_of(rig, [prepared], own, settings)
        model = linear(problem, rig)
        left = misfit(problem, model, errors_of(problem, model))
        channels = {block.name: block.channel for block in problem.blocks}
        found[label] = {channels[block]: size for (block, _), size in left.rms.items()}
    return found
