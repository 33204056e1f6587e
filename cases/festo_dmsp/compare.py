"""Every force model on both Festo maps: all pressures, each pressure from the others, three
pressures for all the rest.

    python cases/festo_dmsp/compare.py out/festo_dmsp

prints the tables of the README beside it and writes a picture of each map.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from pamrs.errors import PamrsError
from pamrs.fit import (
    FitError,
    MeasuredMuscle,
    ModelComparison,
    compare_models,
    fit_muscle,
    load_measured_muscle,
)

HERE = Path(__file__).parent
PUBLISHED = {"DMSP-20-300": 4.4, "DMSP-10-250": 2.35}
FREE = ("braid_angle", "rest_length")
#: The shares of the highest pressure at which the dissertation characterised its muscle (20, 60 and
#: 120 psi).
SHARES = (1 / 6, 1 / 2, 1.0)
TRIPLES = 100


def three(levels: np.ndarray) -> list[int]:
    """The levels nearest to a sixth, half and all of the highest pressure."""
    return [int(np.argmin(np.abs(levels - share * levels[-1]))) for share in SHARES]


def wide_triples(levels: np.ndarray) -> list[list[int]]:
    """Sets of three a person might measure: the highest, one in the middle, one below; at most
    :data:`TRIPLES`, drawn with seed 0.
    """
    top = len(levels) - 1
    share = levels / levels[-1]
    middle, low = np.flatnonzero((share > 0.45) & (share < 0.85)), np.flatnonzero(share < 0.45)
    sets = [[int(a), int(b), top] for a in low for b in middle]
    order = np.random.default_rng(0).permutation(len(sets))[:TRIPLES]
    return [sets[i] for i in order]


def percent(value: float | None) -> str:
    """A fraction in percent, a dash where there is none."""
    return "–" if value is None else f"{100 * value:.2f}"


def table(comparison: ModelComparison) -> str:
    """Largest and rms errors of every model as Markdown."""
    lines = [
        "| model | order | unknowns | all pressures | each from the others | three pressures, "
        "the others |",
        "|---|---|---|---|---|---|",
    ]
    for row in comparison.rows:
        order = row["order"] or ""
        if row["rank"] is None:
            lines.append(f"| {row['model']} | {order} | {row['nvarys']} | not determined | | |")
            continue
        pairs = [(row[f"{kind}max"], row[f"{kind}rms"]) for kind in ("", "lopo_", "subset_")]
        cells = " | ".join(f"{percent(worst)} ({percent(rms)})" for worst, rms in pairs)
        star = " *" if row["recommended"] else ""
        lines.append(f"| {row['model']}{star} | {order} | {row['nvarys']} | {cells} |")
    return "\n".join(lines)


def sizes_of(tolerance: Mapping[str, float]) -> dict[str, float]:
    """What is known of the geometry, without the moduli."""
    return {key: value for key, value in tolerance.items() if not key.startswith("modulus")}


def worst_of(measured: MeasuredMuscle, **settings: Any) -> float:
    """Largest error of a fit on the levels that it has not seen, a fraction."""
    fit = fit_muscle(measured.data, measured.muscle, **settings)
    return (fit.errors_of("held_out") or (0.0, 0.0))[1]


def other_choices(measured: MeasuredMuscle, published: float, settings: dict[str, Any]) -> str:
    """How much the choice of the three pressures, and the width of the moduli's prior, matter:
    largest held-out errors.
    """
    lines = [
        "| model | order | prior | median | nine in ten below | worst | choices below the "
        "published error |",
        "|---|---|---|---|---|---|---|",
    ]
    choices = wide_triples(measured.data.levels)
    for model, order, width in (
        ("kothera", 2, 1),
        ("robinson", 2, 1),
        ("robinson", 3, 1),
        ("robinson", 4, 1),
        ("robinson", 4, 1 / 3),
        ("robinson", 4, 3),
    ):
        tolerance = settings["tolerance"]
        known = {key: value * width for key, value in tolerance.items()} | sizes_of(tolerance)
        own = {**settings, "tolerance": known, "model": model, "order": order}
        found = 100 * np.array([worst_of(measured, levels=levels, **own) for levels in choices])
        values = (np.median(found), np.percentile(found, 90), found.max())
        numbers = " | ".join(f"{value:.2f}" for value in values)
        below = f"{int((found < published).sum())} of {len(choices)}"
        lines.append(f"| {model} | {order} | x {width:.2g} | {numbers} | {below} |")
    return "\n".join(lines)


def what_is_told(measured: MeasuredMuscle, levels: list[int], settings: dict[str, Any]) -> str:
    """What the stated noise and the moduli's prior do to fits on the three levels: largest error on
    the others.
    """
    lines = ["| model | order | nothing | noise | noise and prior |", "|---|---|---|---|---|"]
    sizes = {"free": FREE, "tolerance": sizes_of(settings["tolerance"])}
    for model, order in (
        ("kothera", 2),
        ("robinson", 2),
        ("ferraresi", 2),
        ("robinson", 3),
        ("robinson", 4),
    ):
        cells = []
        for told in (sizes, sizes | {"noise": settings["noise"]}, settings):
            try:
                worst = worst_of(measured, model=model, order=order, levels=levels, **told)
                cells.append(percent(worst))
            except FitError:
                cells.append("not determined")
        lines.append(f"| {model} | {order} | {' | '.join(cells)} |")
    return "\n".join(lines)


def one_map(name: str, out: Path) -> None:
    """Tables and picture of one map."""
    measured = load_measured_muscle(HERE / f"{name}.toml", allow_outside=True)
    data, published = measured.data, PUBLISHED[name]
    chosen = three(data.levels)
    pressures = ", ".join(f"{data.levels[i] / 1e3:g}" for i in chosen)
    largest = float(data.force[data.used].max())
    count = int(data.used.sum())
    print(
        f"\n## {name}\n\n{count} points, largest force {largest:.1f} N; published: within "
        f"{published} %.\nThree pressures: {pressures} kPa. Largest error (rms in brackets), "
        "percent of the largest force.\n"
    )
    print(f"comparing the models on {name} ...", file=sys.stderr)
    nominal = compare_models(data, measured.muscle, levels=chosen)
    print(f"Geometry as stated, nothing known of the moduli:\n\n{table(nominal)}\n")
    constants = dict.fromkeys(("c10", "c01", "bladder_modulus"), 1e7)
    settings: dict[str, Any] = {
        "free": FREE,
        "tolerance": measured.tolerance | constants,
        "noise": measured.noise,
    }
    fitted = compare_models(data, measured.muscle, levels=chosen, **settings)
    print(
        "Braid angle and rest length fitted within their tolerances, moduli with their wide "
        f"prior:\n\n{table(fitted)}\n"
    )
    print(f"trying other sets of three on {name} ...", file=sys.stderr)
    settings["tolerance"] = measured.tolerance
    told = what_is_told(measured, chosen, settings)
    print(f"The same three pressures, with less said:\n\n{told}\n")
    print(
        "Other choices of three (highest, one in the middle, one low), largest error on the rest:\n"
    )
    print(other_choices(measured, published, settings))
    fit = fit_muscle(data, measured.muscle, model="robinson", order=4, levels=chosen, **settings)
    picture = fit.figure(out / f"{name}.png")
    print(f"written: {picture}", file=sys.stderr)


def main() -> int:
    """Both maps; 2 where the measurements are not at hand."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0] if __doc__ else None)
    parser.add_argument("out", type=Path, help="folder for the pictures")
    out = parser.parse_args().out
    out.mkdir(parents=True, exist_ok=True)
    try:
        for name in PUBLISHED:
            one_map(name, out)
    except PamrsError as error:
        print(f"skipped: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
