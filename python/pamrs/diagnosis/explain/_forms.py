"""A fitted closure as numbers: where it acts, how large it is, what it depends on, with which
memory.
"""

from __future__ import annotations

import math

import numpy as np

from pamrs._arrays import Array
from pamrs.diagnosis.fit import Fit, Problem
from pamrs.diagnosis.prepare import Block, begun
from pamrs.effects import CLOSURE_OF, CLOSURE_TERMS, MEMORY_OF
from pamrs.errors import DiagnosisError
from pamrs.findings import Form
from pamrs.simulation import core_rig, default_step


def forms_of(found: Fit, problem: Problem, baseline: Fit) -> list[Form]:
    """What a fitted closure is a function of, by block.

    The share of a kind of dependence is its inner product with the whole over that of the whole
    with itself, so that shares sum to one even where terms cancel.

    Parameters
    ----------
    found : Fit
        What :func:`pamrs.diagnosis.search.find_closure` returned.
    problem : Problem
        The same problem.
    baseline : Fit
        The fit without the closure.

    Returns
    -------
    list of Form
        One for each block; :func:`pamrs.report.forms.form_sentence` says it.

    Raises
    ------
    DiagnosisError
        If the fit has no closure.
    """
    ids = [effect.id for effect in found.effects]
    if not set(ids) & set(CLOSURE_TERMS):
        raise DiagnosisError(
            f"found.effects = {ids} is not allowed: one of {', '.join(CLOSURE_TERMS)} is needed"
        )
    blocks = [b for b in problem.blocks if b.closure in ids]
    return [_form(found, problem, baseline, block) for block in blocks]


def _form(found: Fit, problem: Problem, baseline: Fit, block: Block) -> Form:
    closure = CLOSURE_OF[block.kind]
    parts = _parts(found, problem, block, closure)
    used = [term for term in CLOSURE_TERMS[closure] if f"{closure}.{term.name}" in found.values]
    whole = np.sum([parts[term.name] for term in used], axis=0)
    power = float(whole @ whole)
    effect = next(own for own in found.rig.effects if own["id"] == closure)
    return Form(
        block=block.name,
        covers=block.covers,
        closure=closure,
        effective=math.sqrt(power / max(1, whole.size)),
        largest=float(np.quantile(np.abs(whole), 0.99)) if whole.size else 0.0,
        taken=_taken(found, baseline, problem, block),
        shares={
            kind: sum(float(parts[t.name] @ whole) for t in used if t.kind == kind) / power
            if power
            else 0.0
            for kind in dict.fromkeys(t.kind for t in used)
        },
        memory={kind: effect["parameters"].get(name) for kind, name in MEMORY_OF.items()},
        terms={
            t.name: (found.values[f"{closure}.{t.name}"], found.std[f"{closure}.{t.name}"])
            for t in used
        },
    )


def _parts(found: Fit, problem: Problem, block: Block, closure: str) -> dict[str, Array]:
    """Each term times its coefficient over all usable rows, along the measured signals."""
    core = core_rig(found.rig, problem.core)
    rows = []
    for prepared in problem.recordings:
        starts = prepared.starts(block.window, block.drives)
        terms = core.closure_terms(
            block.name,
            prepared.driving(mechanical=block.mechanical),
            prepared.dt,
            default_step(prepared.dt, longest=block.step),
            starts,
            begun(block, prepared, starts),
            prepared.n,
        )
        rows.append(terms[found.residuals[block.name, prepared.recording.name].rows])
    every = np.concatenate(rows)
    return {
        t.name: every[:, k] * found.values.get(f"{closure}.{t.name}", 0.0)
        for k, t in enumerate(CLOSURE_TERMS[closure])
    }


def _taken(found: Fit, baseline: Fit, problem: Problem, block: Block) -> float:
    """Share of a block's squared residual beyond its sample noise that the closure removes."""
    left = []
    for model in (baseline, found):
        pairs = [model.residuals[block.name, p.recording.name] for p in problem.recordings]
        left.append(
            sum(
                float(((r.value[r.rows] / r.noise) ** 2).sum()) - float(r.rows.sum()) for r in pairs
            )
        )
    return 1.0 - max(0.0, left[1]) / left[0] if left[0] > 0.0 else 0.0
