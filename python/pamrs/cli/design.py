"""The command line of design: ``pamrs design joint``."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

import typer

from pamrs import library
from pamrs._checks import refused
from pamrs._writing import check_writable
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
from pamrs.cli.completion import beginning
from pamrs.units import bar_and_psi

if TYPE_CHECKING:
    from pamrs.design import JointDesign, JointProblem

SCHEMA: Final = "pamrs.joint_design/1"

design_app = typer.Typer(help="Find dimensions that meet a requirement.")


@design_app.callback()
def _root() -> None:
    """Find dimensions that meet a requirement."""


@design_app.command("joint")
def _joint(
    muscle: Annotated[
        str,
        typer.Option(
            help="A muscle of the library, or a rig file (TOML) with one.",
            autocompletion=beginning(library.names),
        ),
    ],
    count: Annotated[int, typer.Option(help="Muscles in parallel.")],
    torque: Annotated[str, typer.Option(help='Wanted over the whole range, like "788 ft lbf".')],
    min_angle: Annotated[
        str, typer.Option(help='Like "15 deg"; the muscles are at rest length there.')
    ],
    max_angle: Annotated[str, typer.Option(help='Like "120 deg".')],
    pressure: Annotated[str, typer.Option(help='Gauge pressure, like "190 psi".')],
    bounds: Annotated[
        list[str] | None,
        typer.Option(
            help='LENGTH=LOW:HIGH, like "lu=10:60 mm"; LENGTH is lu, ru, ll or rl; may be repeated.'
        ),
    ] = None,
    max_stroke: Annotated[str, typer.Option(help="Largest stroke over the rest length.")] = "15 %",
    evaluations: Annotated[
        int | None,
        typer.Option(help="Designs tried; 1820 by default, 4000 with --minimise-pressure."),
    ] = None,
    minimise_pressure: Annotated[
        bool,
        typer.Option(
            "--minimise-pressure",
            help="Look for the joint that gives the torque at the least pressure.",
        ),
    ] = False,
    seed: Annotated[int, typer.Option(help="The same seed gives the same result.")] = 0,
    json: Annotated[Path | None, typer.Option(help=json_help(SCHEMA))] = None,
    rig_joint: Annotated[
        Path | None, typer.Option(help="Write the block [joint] of a rig file.")
    ] = None,
) -> None:
    """Find the four lengths of a tendon joint that give a torque over a range of angles
    (dissertation 3.5).
    """
    check_writable(file_of(json), rig_joint)
    from pamrs.design import least_pressure, optimise

    problem = _problem(
        muscle, count, torque, (min_angle, max_angle), pressure, bounds or [], max_stroke
    )
    title = f"{count} {muscle}, {torque} from {min_angle} to {max_angle}"
    heading, found = title, None
    given: dict[str, Any] = {} if evaluations is None else {"evaluations": evaluations}
    with counted("designs") as say:
        if minimise_pressure:
            found = least_pressure(problem, seed=seed, progress=say, **given)
            heading = f"{title}: {_least(problem, found)}"
        found = found or optimise(problem, seed=seed, progress=say, **given)
    contents: Contents = {
        json: _document(title, seed, found) if json else "",
        rig_joint: found.to_toml() if rig_joint else "",
    }
    write(contents, f"{heading}\n{found.summary()}")


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


def _least(problem: JointProblem, found: JointDesign | None) -> str:
    """The least pressure that a search found, with what any joint needs."""
    bound = bar_and_psi(problem.least_possible_pressure())
    least = (
        "no design was found that any pressure makes good enough"
        if found is None
        else f"the least pressure found is {bar_and_psi(found.problem.pressure)}"
    )
    return f"{least}; no joint of any shape could do with less than {bound}"


def _document(title: str, seed: int, found: JointDesign) -> str:
    problem = found.problem
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
        seed=seed,
        design=found,
    )
