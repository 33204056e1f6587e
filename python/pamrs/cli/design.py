"""The command line of design: ``pamrs design joint``."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import typer

from pamrs._checks import refused
from pamrs._writing import check_writable, write_atomically
from pamrs.cli._shared import (
    Contents,
    counted,
    document,
    exact,
    file_of,
    json_help,
    named_muscle,
    write,
)
from pamrs.units import bar_and_psi

if TYPE_CHECKING:
    from pamrs.design import (
        JointDesign,
        JointProblem,
        MethodComparison,
        ParetoFront,
        PressureSearch,
    )

SCHEMA: Final = "pamrs.joint_design/1"
_METHODS: Final = ("ga", "de", "cma")

design_app = typer.Typer(help="Find dimensions that meet a requirement.")


@design_app.callback()
def _root() -> None:
    """Find dimensions that meet a requirement."""


@design_app.command("joint")
def _joint(
    context: typer.Context,
    muscle: Annotated[
        str, typer.Option(help="A muscle of the library, or a rig file (TOML) with one.")
    ],
    count: Annotated[int, typer.Option(help="Muscles in parallel.")],
    torque: Annotated[str, typer.Option(help='Wanted over the whole range, like "788 ft lbf".')],
    min_angle: Annotated[
        str, typer.Option(help='Like "15 deg"; the muscles are at rest length there.')
    ],
    max_angle: Annotated[str, typer.Option(help='Like "120 deg".')],
    pressure: Annotated[str, typer.Option(help='Gauge pressure, like "190 psi".')],
    method: Annotated[
        str, typer.Option(help="ga (as published), de (differential evolution) or cma (CMA-ES).")
    ] = "ga",
    bounds: Annotated[
        list[str] | None,
        typer.Option(
            help='LENGTH=LOW:HIGH, like "lu=10:60 mm"; LENGTH is lu, ru, ll or rl; may be repeated.'
        ),
    ] = None,
    max_stroke: Annotated[str, typer.Option(help="Largest stroke over the rest length.")] = "15 %",
    evaluations: Annotated[
        int, typer.Option(help="Designs tried in a search; 1820 are 100 generations as published.")
    ] = 1820,
    mutation: Annotated[
        float,
        typer.Option(
            help="Chance of the genetic algorithm that a child gets one length at random."
        ),
    ] = 0.2,
    minimise_pressure: Annotated[
        bool,
        typer.Option(
            "--minimise-pressure",
            help="Repeat at other pressures for the least that does; also by direct search.",
        ),
    ] = False,
    compare: Annotated[
        bool, typer.Option("--compare", help="Also run all methods with ten seeds each.")
    ] = False,
    pareto: Annotated[
        bool, typer.Option("--pareto", help="Also find pressure against size.")
    ] = False,
    seed: Annotated[int, typer.Option(help="The same seed gives the same result.")] = 0,
    png: Annotated[Path | None, typer.Option(help="Write the picture.")] = None,
    json: Annotated[Path | None, typer.Option(help=json_help(SCHEMA))] = None,
    rig_joint: Annotated[
        Path | None, typer.Option(help="Write the block [joint] of a rig file.")
    ] = None,
) -> None:
    """Find the four lengths of a tendon joint that give a torque over a range of angles
    (dissertation 3.5).
    """
    check_writable(png, file_of(json), rig_joint)
    if method not in _METHODS:
        raise typer.BadParameter(f"--method = {method!r} is not allowed: {', '.join(_METHODS)}")

    problem = _problem(
        muscle, count, torque, (min_angle, max_angle), pressure, bounds or [], max_stroke
    )
    found = _found(context, problem)
    title = f"{count} {muscle}, {torque} from {min_angle} to {max_angle}"
    caption = f"{title}: {bar_and_psi(found.design.problem.pressure)}"

    def draw(path: Path) -> None:
        from pamrs.design.figures import summary_png

        picture = summary_png(found.design, caption, comparison=found.comparison, front=found.front)
        write_atomically(path, picture)

    contents: Contents = {
        json: _document(title, found) if json else "",
        rig_joint: found.design.to_toml() if rig_joint else "",
        png: draw,
    }
    write(contents, f"{title}\n{_summary(found)}")


# ------------------------------------------------------------------------- search


@dataclass(frozen=True)
class _Found:
    """The design, and what else was asked for."""

    design: JointDesign
    lowest: PressureSearch | None = None
    strict: JointDesign | None = None
    comparison: MethodComparison | None = None
    front: ParetoFront | None = None


def _found(context: typer.Context, problem: JointProblem) -> _Found:
    """The design, at the least pressure where that is asked for (by repeated searches and by a
    direct one), with the comparison and the front.
    """
    from pamrs.design import (
        Genetic,
        compare_methods,
        least_pressure,
        minimum_pressure,
        optimise,
        pareto_front,
    )

    given = context.params
    method, evaluations, seed = (given[key] for key in ("method", "evaluations", "seed"))
    options = {"evaluations": evaluations, "seed": seed}
    genetic = Genetic(mutation=given["mutation"])
    if given["minimise_pressure"]:
        with counted("pressures") as say:
            lowest = minimum_pressure(problem, method, genetic=genetic, **options, progress=say)
        with counted("designs") as say:
            strict = least_pressure(problem, seed=seed, progress=say)
        found = _Found(lowest.design, lowest, strict)
    else:
        with counted("designs") as say:
            found = _Found(optimise(problem, method, genetic=genetic, **options, progress=say))
    problem = found.design.problem
    if given["compare"]:
        lasting = replace(genetic, tolerance=None)
        with counted("runs") as say:
            runs = compare_methods(problem, evaluations=evaluations, genetic=lasting, progress=say)
        found = replace(found, comparison=runs)
    if given["pareto"]:
        with counted("generations") as say:
            found = replace(found, front=pareto_front(problem, seed=seed, progress=say))
    return found


# ------------------------------------------------------------------------- inputs


def _problem(
    muscle: str,
    count: int,
    torque: str,
    angles: tuple[str, str],
    pressure: str,
    bounds: Sequence[str],
    max_stroke: str,
) -> JointProblem:
    from pamrs.design import JointProblem

    return JointProblem(
        named_muscle(muscle)[0],
        count,
        exact("torque", torque, "torque"),
        exact("min_angle", angles[0], "angle"),
        exact("max_angle", angles[1], "angle"),
        exact("pressure", pressure, "pressure"),
        bounds=_bounds(bounds),
        max_contraction=exact("max_stroke", max_stroke, "dimensionless"),
    )


def _bounds(given: Sequence[str]) -> dict[str, tuple[float, float]]:
    """``lu=10:60 mm`` and so on; the unit of the second number serves for the first where that has
    none.
    """
    from pamrs.design import LENGTHS, SYMBOLS

    names = {**dict(zip(SYMBOLS, LENGTHS, strict=True)), **{name: name for name in LENGTHS}}
    found: dict[str, tuple[float, float]] = {}
    for text in given:
        name, equals, rest = text.partition("=")
        low, colon, high = rest.partition(":")
        key = names.get(name.strip())
        if not equals or not colon or key is None or key in found:
            reason = "LENGTH=LOW:HIGH is needed, like 'lu=10:60 mm', with lu, ru, ll or rl"
            if key in found:
                reason = "given twice"
            raise refused("--bounds", text, reason)
        unit = high.strip().lstrip("+-0123456789.eE").strip()
        bare = not low.strip().lstrip("+-0123456789.eE").strip()
        found[key] = (
            exact("bounds", f"{low} {unit}" if bare else low, "length"),
            exact("bounds", high, "length"),
        )
    return found


# ------------------------------------------------------------------------ outputs


def _summary(found: _Found) -> str:
    """What goes to standard output behind the title."""
    text = found.design.summary()
    if found.lowest is not None:
        text += f"\n\n{found.lowest.summary()}\n{_strict_line(found.strict)}"
    if found.comparison is not None:
        pressure = bar_and_psi(found.design.problem.pressure)
        text += f"\n\nJ in joule at {pressure}\n{found.comparison.table()}"
    if found.front is not None:
        text += f"\n\n{_front_table(found.front)}"
    return text


def _strict_line(design: JointDesign | None) -> str:
    """What the direct search found."""
    if design is None:
        return "strict, direct search: no design was found that any pressure makes good enough"
    assert design.search is not None
    found = f"{bar_and_psi(design.problem.pressure)} gives the torque at every angle"
    return (
        f"strict, direct search: {found} ({design.search.method}, {design.search.evaluations} "
        "evaluations)"
    )


def _front_table(front: ParetoFront) -> str:
    """About a dozen designs of the front."""
    import numpy as np

    from pamrs.design import SYMBOLS

    if not len(front.size):
        return "no design was found that any pressure makes good enough"
    lines = [
        "pressure against size: radius about the axis that holds the tendon's ends",
        f"{'mm':>9}{'bar':>9}" + "".join(f"{s:>9}" for s in SYMBOLS),
    ]
    for index in np.unique(np.linspace(0, len(front.size) - 1, 12).round().astype(int)).tolist():
        numbers = [
            1e3 * front.size[index],
            front.pressure[index] / 1e5,
            *(1e3 * front.lengths[index]),
        ]
        lines.append("".join(f"{number:>9.2f}" for number in numbers))
    return "\n".join(lines)


def _document(title: str, found: _Found) -> str:
    problem = found.design.problem
    keys = ("count", "torque", "min_angle", "max_angle")
    return document(
        SCHEMA,
        title=title,
        problem={
            "muscle": problem.muscle.parameters,
            **{key: getattr(problem, key) for key in keys},
            "bounds": {name: list(pair) for name, pair in problem.bounds.items()},
            "max_contraction": problem.max_contraction,
        },
        design=found.design,
        minimum_pressure=found.lowest,
        least_pressure=found.strict,
        comparison=None if found.comparison is None else found.comparison.rows(),
        front=found.front,
    )
