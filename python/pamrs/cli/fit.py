"""The command line of fits: ``pamrs fit muscle`` and ``pamrs fit friction``."""

from __future__ import annotations

import math
import shlex
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final, TypeAlias

import typer

from pamrs.cli._shared import (
    GEOMETRY,
    check_writable,
    named_muscle,
    progress,
    quantity,
    write,
)
from pamrs.errors import check_packages

if TYPE_CHECKING:
    from pamrs.fit import ForceMap, FrictionFit, MapFit, ModelComparison, MuscleFit
    from pamrs.rig import Muscle, Rig

__all__ = ["fit_app"]

SCHEMA: Final = "pamrs.muscle_fit/1"
FRICTION_SCHEMA: Final = "pamrs.friction_fit/1"
MAP_SCHEMA: Final = "pamrs.map_fit/1"
_Contents: TypeAlias = dict[Path, str | bytes | Callable[[Path], object]]
_MODULI: Final = {"modulus_slope": "dimensionless"}


class FrictionChoice(StrEnum):
    """Where the friction of the muscle comes from."""

    fit = "fit"
    none = "none"
    muscle = "muscle"


_MuscleName = Annotated[
    str | None,
    typer.Option("--muscle", help="Rig file (TOML) with the muscle, or a name of the library."),
]
_RestLength = Annotated[
    str | None, typer.Option(help='For example "300 mm"; "300 +- 2 mm" with what is known of it.')
]
_RestDiameter = Annotated[str | None, typer.Option(help='For example "20 mm" (outside).')]
_BraidAngle = Annotated[
    str | None, typer.Option(help='For example "65 +- 3 deg", from the circumference.')
]
_WallThickness = Annotated[str | None, typer.Option(help='For example "2 mm".')]
_Where = Annotated[
    list[str] | None, typer.Option(help="COLUMN=VALUE: only these rows; may be repeated.")
]
_Clipped = Annotated[str | None, typer.Option(help='A force that means off the scale, like "0 N".')]
_Picture = Annotated[Path | None, typer.Option("--png", help="Write the summary picture.")]
_Outside = Annotated[
    bool,
    typer.Option("--allow-outside", help="A description's table may lie outside its folder."),
]

# of ``pamrs fit muscle`` alone
_Data = Annotated[
    Path,
    typer.Argument(help="Force map: a table with units in its headings, or a TOML description."),
]
_Model = Annotated[str | None, typer.Option(help="Force model; by default that of the muscle.")]
_Order = Annotated[
    int | None,
    typer.Option(help="Order of the stress polynomial, 4 unless the muscle has moduli."),
]
_Geometry = Annotated[
    str | None,
    typer.Option(help="cylinder, elliptic or elliptic_published; by default the model's own."),
]
_Free = Annotated[
    str | None, typer.Option(help="Geometry to fit too: braid_angle,rest_diameter,...")
]
_Prior = Annotated[
    str | None,
    typer.Option(
        help='What is known of moduli: "modulus_slope=10, modulus_offset=10 MPa"; needs --noise.'
    ),
]
_Noise = Annotated[
    str | None,
    typer.Option(help='Standard deviation of the forces: "5 N", or "0.5 %" of the largest.'),
]
_Levels = Annotated[
    str | None, typer.Option(help="Fit on these pressures only: 200kPa,400kPa,6bar.")
]
_PerLevel = Annotated[bool, typer.Option("--per-level", help="Moduli free at each pressure.")]
_Friction = Annotated[
    FrictionChoice | None,
    typer.Option(
        help=(
            "fit: to the loops, before the moduli; muscle: as the muscle has it; none. By "
            "default fit where the rows have both directions and the muscle no friction."
        )
    ),
]
_Compare = Annotated[bool, typer.Option("--compare", help="Fit every model and rank them.")]
_Report = Annotated[Path | None, typer.Option(help="Write the report, one HTML file.")]
_FittedRig = Annotated[
    Path | None,
    typer.Option(
        help=(
            "Write a rig file with the fitted muscle: that of --muscle, or a new one with the "
            "muscle alone."
        )
    ),
]
_Result = Annotated[Path | None, typer.Option(help=f"Write the result (schema {SCHEMA}).")]

fit_app = typer.Typer(help="Fit models to measurements.")


@fit_app.callback()
def _root() -> None:
    """Fit models to measurements."""


@fit_app.command("muscle")
def _muscle(
    context: typer.Context,
    data: _Data,
    model: _Model = None,
    order: _Order = None,
    geometry: _Geometry = None,
    muscle: _MuscleName = None,
    rest_length: _RestLength = None,
    rest_diameter: _RestDiameter = None,
    braid_angle: _BraidAngle = None,
    wall_thickness: _WallThickness = None,
    where: _Where = None,
    clipped: _Clipped = None,
    free: _Free = None,
    prior: _Prior = None,
    noise: _Noise = None,
    levels: _Levels = None,
    per_level: _PerLevel = False,
    friction: _Friction = None,
    compare: _Compare = False,
    report: _Report = None,
    rig: _FittedRig = None,
    json: _Result = None,
    png: _Picture = None,
    allow_outside: _Outside = False,
) -> None:
    """Fit a muscle's force model to measured forces over length and pressure."""
    outputs = _Outputs(report=report, rig=rig, json=json, png=png)
    _check_outputs(outputs, per_level=per_level)
    sizes = _stated(rest_length, rest_diameter, braid_angle, wall_thickness)
    inputs = _inputs(data, muscle, sizes, where or [], clipped, allow_outside)
    shape, notes = _shape(inputs, model, geometry, levels, free, prior, noise)
    asked = _Asked(model, order, "per_level" if per_level else "linear", friction, compare)
    summary, contents = _results(inputs, asked, shape, notes, _command(context), outputs)
    write(contents, summary)
    if rig is not None and inputs.rig is None:
        typer.echo(
            (
                f"{rig} is the muscle on a load frame: simulate it with a length, or give it "
                "[joint] and [arm]"
            ),
            err=True,
        )


@dataclass(frozen=True)
class _Asked:
    """How a muscle is to be fitted, beside what a comparison takes too."""

    model: str | None
    order: int | None
    moduli: str
    friction: FrictionChoice | None
    compare: bool


def _check_outputs(outputs: _Outputs, *, per_level: bool) -> None:
    """Refuse files that cannot be written, before any work."""
    report, rig, png = outputs.report, outputs.rig, outputs.png
    check_writable(report, rig, outputs.json, png)
    drawn = ["matplotlib"] if report or png else []
    check_packages("report", *(["jinja2", "markupsafe"] if report else []), *drawn)
    if per_level and rig is not None:
        raise typer.BadParameter(
            "a rig needs moduli linear in pressure: leave out --per-level or --rig"
        )


def _results(
    inputs: _Inputs,
    asked: _Asked,
    shape: dict[str, Any],
    notes: Sequence[str],
    command: str,
    outputs: _Outputs,
) -> tuple[str, _Contents]:
    """What to say of a fit, and every file to write."""
    from pamrs.fit import FitError

    with progress(f"fitting {inputs.data.label}"):
        try:
            fit, comparison, rubbing, words = _fitted(inputs, asked, shape)
            contents = _contents(fit, comparison, rubbing, command, inputs.rig, outputs)
            return _summary(fit, comparison, words, notes), contents
        except FitError as error:
            raise FitError("; ".join([str(error), *inputs.data.notes])) from error


def _fitted(
    inputs: _Inputs, asked: _Asked, shape: dict[str, Any]
) -> tuple[MuscleFit, ModelComparison | None, FrictionFit | None, str]:
    """The fit, every model beside it if that is asked for, and the friction with what to say of
    it.
    """
    from pamrs.fit import fit_muscle

    map_, model = inputs.data, asked.model
    start, rubbing, words = _rubbing(map_, inputs.muscle, asked.friction, model, shape["levels"])
    fit = fit_muscle(map_, start, model=model, order=asked.order, moduli=asked.moduli, **shape)
    comparison = _comparison(map_, start, fit.order, shape) if asked.compare else None
    return fit, comparison, rubbing, words


@fit_app.command("map")
def _map(
    context: typer.Context,
    data: Annotated[
        Path, typer.Argument(help="Force map, recording of a bench, or a TOML description.")
    ],
    muscle: _MuscleName = None,
    rest_length: _RestLength = None,
    rest_diameter: _RestDiameter = None,
    braid_angle: _BraidAngle = None,
    wall_thickness: _WallThickness = None,
    where: _Where = None,
    clipped: _Clipped = None,
    nodes: Annotated[int, typer.Option(help="Contractions of the table.")] = 20,
    rig: Annotated[
        Path | None,
        typer.Option(help="Write the rig with this table as its muscle, and the table's error."),
    ] = None,
    json: Annotated[Path | None, typer.Option(help=f"Write the result (schema {MAP_SCHEMA}).")] = (
        None
    ),
    allow_outside: _Outside = False,
) -> None:
    """Make a table of forces of measurements alone, monotone in pressure and contraction: a muscle
    that no force model has to fit. Its geometry gives the volume only.
    """
    check_writable(rig, json)
    sizes = _stated(rest_length, rest_diameter, braid_angle, wall_thickness)
    inputs = _inputs(data, muscle, sizes, where or [], clipped, allow_outside)
    from pamrs.fit import fit_map

    with progress(f"fitting {inputs.data.label}"):
        fit = fit_map(inputs.data, nodes=nodes)
    contents: _Contents = {}
    if json is not None:
        contents[json] = _map_json(fit, inputs.data, _command(context))
    if rig is not None:
        contents[rig] = fit.to_rig(inputs.muscle, inputs.rig).to_toml_text()
    write(contents, f"{inputs.data.label}: {fit.fit_report()}")


@fit_app.command("friction")
def _friction(
    context: typer.Context,
    data: Annotated[
        Path,
        typer.Argument(
            help="Force map with a column direction, recording of a bench, or a TOML description."
        ),
    ],
    muscle: _MuscleName = None,
    rest_length: _RestLength = None,
    rest_diameter: _RestDiameter = None,
    braid_angle: _BraidAngle = None,
    wall_thickness: _WallThickness = None,
    where: _Where = None,
    clipped: _Clipped = None,
    floor: Annotated[float, typer.Option(help="The least that c_F becomes.")] = 0.01,
    json: Annotated[
        Path | None, typer.Option(help=f"Write the result (schema {FRICTION_SCHEMA}).")
    ] = None,
    png: _Picture = None,
    allow_outside: _Outside = False,
) -> None:
    """Fit the friction c_F = max(c0 + c1 P, floor) of a muscle to its hysteresis loops; of its
    geometry, the rest length is enough.
    """
    check_writable(json, png)
    check_packages("report", *(["matplotlib"] if png else []))
    sizes = _stated(rest_length, rest_diameter, braid_angle, wall_thickness)
    map_ = _loops(data, muscle, sizes, where or [], clipped, allow_outside).with_directions()
    from pamrs.fit import fit_friction

    with progress(f"fitting {map_.label}"):
        fit = fit_friction(map_, floor=floor)
    contents: _Contents = {}
    if json is not None:
        contents[json] = _friction_json(fit, map_, _command(context))
    if png is not None:
        from pamrs._writing import write_atomically
        from pamrs.fit.report import render_friction_png

        contents[png] = lambda path: write_atomically(path, render_friction_png(fit, map_))
    write(contents, f"{map_.label}: {fit.fit_report()}")


def _rubbing(
    data: ForceMap,
    muscle: Muscle,
    choice: FrictionChoice | None,
    model: str | None,
    pressures: Sequence[float] | None,
) -> tuple[Muscle, FrictionFit | None, str]:
    """The muscle with the friction asked for, the fit of that to the loops where there is one, and
    what to say of it.

    Unasked, friction is fitted where the rows have both directions and the muscle has none; not for
    the elbow's model, which has a branch of its own for lengthening.
    """
    import numpy as np

    from pamrs.errors import RecordingError
    from pamrs.fit import fit_friction
    from pamrs.fit.remarks import friction_words

    given = muscle.parameters
    bare = dict.fromkeys(("friction_coefficient", "friction_pressure_slope", "friction_floor"), 0.0)
    if choice is FrictionChoice.none:
        return muscle.replace(**bare), None, ""
    way = data.direction[data.used]
    loops = bool(np.any(way < 0) and np.any(way > 0))
    alone = (
        loops
        and not any(given[name] for name in bare)
        and (model or muscle.model) != "elbow_linear"
    )
    if choice is FrictionChoice.muscle or (choice is None and not alone):
        law = friction_words(muscle) if loops else ""
        return muscle, None, f"friction as the muscle has it: {law}" if law else ""
    seen = data if pressures is None else data.select(levels=data.level_indices(pressures))
    try:
        found = fit_friction(seen)
    except RecordingError as error:
        if choice is FrictionChoice.fit:
            raise
        return muscle, None, f"friction: not fitted, {error}"
    if choice is None and not found.ndata:
        return muscle, None, f"friction: none, no pressure's c_F is above {found.floor:g}"
    if choice is None and not found.told:
        return (
            muscle,
            None,
            (
                "friction: none, the loops do not tell it from their scatter (--friction fit takes "
                "it all the same)"
            ),
        )
    c0, c1 = found.params["friction_coefficient"], found.params["friction_pressure_slope"]
    line = (
        f"c0 = {c0.value:.4g} +- {c0.stderr:.2g}, c1 = {1e6 * c1.value:.4g} +- "
        f"{1e6 * c1.stderr:.2g} 1/MPa"
    )
    return (
        found.to_muscle(muscle),
        found,
        f"friction, fitted to the loops before the moduli: {line}",
    )


def _comparison(
    data: ForceMap, muscle: Muscle, order: int | None, shape: dict[str, Any]
) -> ModelComparison:
    """Every model, in the orders 1 to 4 and that of the fit, and in the geometry asked for where
    the muscle's own model is meant.
    """
    from pamrs.fit import compare_models

    settings = {key: value for key, value in shape.items() if key != "geometry"}
    if shape["geometry"] is not None:
        muscle = muscle.replace(geometry=shape["geometry"])
    return compare_models(data, muscle, orders=sorted({1, 2, 3, 4, order or 1}), **settings)


# ------------------------------------------------------------------------- inputs


@dataclass(frozen=True)
class _Inputs:
    """A force map, the muscle it is of, and what is known of both.

    The tolerances are standard deviations of the muscle's parameters in SI, the noise is that of
    the forces [N], and the rig is the one that the muscle is a part of.
    """

    data: ForceMap
    muscle: Muscle
    tolerance: dict[str, float]
    noise: float | None = None
    rig: Rig | None = None


def _stated(
    rest_length: str | None,
    rest_diameter: str | None,
    braid_angle: str | None,
    wall_thickness: str | None,
) -> dict[str, str]:
    """The sizes that were given, by their name in :data:`GEOMETRY`."""
    sizes = {
        "rest_length": rest_length,
        "rest_diameter": rest_diameter,
        "braid_angle": braid_angle,
        "wall_thickness": wall_thickness,
    }
    return {name: text for name, text in sizes.items() if text is not None}


def _shape(
    inputs: _Inputs,
    model: str | None,
    geometry: str | None,
    levels: str | None,
    free: str | None,
    prior: str | None,
    noise: str | None,
) -> tuple[dict[str, Any], list[str]]:
    """What a fit and a comparison both take, and notes on what is not used."""
    from pamrs.rig.muscle_models import ELASTIC_PARAMETERS

    pressures = None
    if levels is not None:
        pressures = [quantity("levels", text, "pressure")[0] for text in levels.split(",")]
    names = [name.strip().replace("-", "_") for name in (free or "").split(",") if name.strip()]
    # a description may know of coefficients that another model has
    own = {*GEOMETRY, *ELASTIC_PARAMETERS.get(model or inputs.muscle.model, ())}
    stated = inputs.tolerance.items()
    known = {name: value for name, value in stated if name in own and math.isfinite(value)}
    known |= _prior(prior)
    idle = [name for name in known if name in GEOMETRY and name not in names]
    notes = []
    if idle:
        both = ",".join([*names, *idle])
        notes = [f"tolerance of {', '.join(idle)} is not used: not free (--free {both})"]
    shape = {
        "geometry": geometry,
        "free": names,
        "tolerance": known,
        "levels": pressures,
        "noise": inputs.noise if noise is None else _noise(noise, inputs.data),
    }
    return shape, notes


def _inputs(
    data: Path,
    muscle: str | None,
    sizes: Mapping[str, str],
    where: Sequence[str],
    clipped: str | None,
    allow_outside: bool,
) -> _Inputs:
    """From a description, or from a table and the options."""
    from pamrs.errors import ParameterError

    if data.suffix.lower() == ".toml":
        given = ["--muscle"] if muscle is not None else []
        given += [f"--{name.replace('_', '-')}" for name in sizes] + (["--where"] if where else [])
        given += ["--clipped"] if clipped is not None else []
        if given:
            raise ParameterError(
                f"{', '.join(given)} cannot be given: {data} describes its table and its muscle "
                "itself"
            )
        from pamrs.fit import load_measured_muscle

        measured = load_measured_muscle(data, allow_outside=allow_outside)
        return _Inputs(measured.data, measured.muscle, measured.tolerance, measured.noise)
    start, tolerance, base = _start(muscle, sizes)
    map_ = _table(data, float(start.parameters["rest_length"]), where, clipped)
    return _Inputs(map_.checked_against(start), start, tolerance, rig=base)


def _table(data: Path, rest_length: float, where: Sequence[str], clipped: str | None) -> ForceMap:
    """The map of a table."""
    from pamrs.fit import load_force_map

    return load_force_map(
        data,
        rest_length=rest_length,
        where=dict(_filter(text) for text in where) or None,
        clipped=None if clipped is None else quantity("clipped", clipped, "force")[0],
    )


def _loops(
    data: Path,
    muscle: str | None,
    sizes: Mapping[str, str],
    where: Sequence[str],
    clipped: str | None,
    allow_outside: bool,
) -> ForceMap:
    """The map of hysteresis loops: friction needs the rest length alone, any other size is for the
    check of the forces.
    """
    from pamrs.errors import ParameterError

    if data.suffix.lower() == ".toml" or muscle is not None or set(sizes) - {"rest_length"}:
        return _inputs(data, muscle, sizes, where, clipped, allow_outside).data
    if not sizes:
        raise ParameterError(
            "the rest length is missing: give --rest-length (like '300 mm'), or --muscle with a "
            "rig file or a name of the library"
        )
    return _table(data, quantity("rest_length", sizes["rest_length"], "length")[0], where, clipped)


def _prior(text: str | None) -> dict[str, float]:
    """Standard deviations of moduli, ``NAME=NUMBER UNIT`` with commas between."""
    from pamrs.errors import ParameterError
    from pamrs.fit import COEFFICIENTS

    known: dict[str, float] = {}
    for part in [] if text is None else text.split(","):
        name, equals, value = (piece.strip() for piece in part.partition("="))
        if not equals or name not in COEFFICIENTS:
            raise ParameterError(
                f"--prior = {part.strip()!r} is not allowed: NAME=VALUE with a name of "
                f"{', '.join(COEFFICIENTS)}"
            )
        known[name] = quantity(
            "prior",
            f"{value} 1" if name == "modulus_slope" else value,
            _MODULI.get(name, "pressure"),
        )[0]
    return known


def _noise(text: str, data: ForceMap) -> float:
    """Standard deviation of the forces [N]; a percentage is of the largest used force."""
    if not text.strip().endswith("%"):
        return quantity("noise", text, "force")[0]
    return quantity("noise", text, "dimensionless")[0] * float(data.force[data.used].max())


def _filter(text: str) -> tuple[str, str]:
    from pamrs.errors import ParameterError

    column, equals, value = text.partition("=")
    if not (column.strip() and equals and value.strip()):
        raise ParameterError(f"--where = {text!r} is not allowed: COLUMN=VALUE is needed")
    return column.strip(), value.strip()


def _start(
    muscle: str | None, sizes: Mapping[str, str]
) -> tuple[Muscle, dict[str, float], Rig | None]:
    """The nominal muscle, what is known of it, and the rig that it is of."""
    from pamrs.errors import ParameterError
    from pamrs.rig import Muscle

    values: dict[str, Any] = {}
    tolerance: dict[str, float] = {}
    for name, text in sizes.items():
        values[name], spread = quantity(name, text, GEOMETRY[name])
        if spread is not None:
            tolerance[name] = spread
    if muscle is not None:
        base, known, rig = named_muscle(muscle)
        return base.replace(**values), {**known, **tolerance}, rig
    lacking = [f"--{name.replace('_', '-')}" for name in GEOMETRY if name not in values]
    if lacking:
        raise ParameterError(
            f"the geometry of the muscle is missing: give {', '.join(lacking)} (like --rest-length "
            "'300 mm'), or --muscle with a rig file or a name of the library"
        )
    return Muscle(**values), tolerance, None


# ------------------------------------------------------------------------ outputs


def _summary(
    fit: MuscleFit, comparison: ModelComparison | None, friction: str, notes: Sequence[str]
) -> str:
    """What goes to standard output."""
    from pamrs.fit.remarks import cross_validation

    cross, reason = cross_validation(fit)
    lines = [
        fit.fit_report().rstrip("\n"),
        *(f"  note: {note}" for note in notes),
        *([f"  {friction}"] if friction else []),
    ]
    if cross is None:
        lines.append(f"  leave one pressure out: not possible, {reason}")
    else:
        numbers = f"rms {100 * cross.rms:.2f} %, max {100 * cross.max:.2f} %"
        lines.append(f"  leave one pressure out: {numbers} of the map's largest force")
    text = "\n".join(lines) + "\n"
    return text if comparison is None else f"{text}\n{comparison.to_text()}"


@dataclass(frozen=True)
class _Outputs:
    """The files to write."""

    report: Path | None
    rig: Path | None
    json: Path | None
    png: Path | None


def _contents(
    fit: MuscleFit,
    comparison: ModelComparison | None,
    friction: FrictionFit | None,
    command: str,
    base: Rig | None,
    files: _Outputs,
) -> _Contents:
    """Every file to write with its content, or what draws it: what is text comes first."""
    from pamrs.fit import report as pages

    contents: _Contents = {}
    if files.json is not None:
        contents[files.json] = _json(fit, comparison, friction, command)
    if files.rig is not None:
        contents[files.rig] = fit.to_rig(base).to_toml_text()
    if files.png is not None:
        contents[files.png] = lambda path: pages.write_figure(fit, path, comparison)
    if files.report is not None:
        contents[files.report] = lambda path: pages.write_report(
            fit, path, comparison, command=command
        )
    return contents


def _command(context: typer.Context) -> str:
    """The command line that gives this result again."""
    words = ["pamrs", "fit", str(context.info_name), str(context.params["data"])]
    for name, value in context.params.items():
        option = f"--{name.replace('_', '-')}"
        if value is True:
            words.append(option)
        elif isinstance(value, (list, tuple)):
            words += [word for item in value for word in (option, str(item))]
        elif value is not None and value is not False and name != "data":
            words += [option, str(value)]
    return shlex.join(words)


def _json(
    fit: MuscleFit, comparison: ModelComparison | None, friction: FrictionFit | None, command: str
) -> str:
    import json

    from pamrs.fit.remarks import cross_validation

    cross, _ = cross_validation(fit)
    document = {
        "schema": SCHEMA,
        "name": fit.data.label,
        "source": fit.data.source,
        "command": command,
        "issues": fit.data.issues,
        "rows": len(fit.data),
        "friction": None if friction is None else friction.to_dict(),
        "fit": fit.to_dict(),
        "leave_one_pressure_out": None if cross is None else cross.to_dict(),
        "comparison": None if comparison is None else comparison.to_dicts(),
    }
    return json.dumps(document, indent=1, allow_nan=False) + "\n"


def _friction_json(fit: FrictionFit, data: ForceMap, command: str) -> str:
    import json

    document = {
        "schema": FRICTION_SCHEMA,
        "name": data.label,
        "source": data.source,
        "command": command,
        "rows": len(data),
    }
    return json.dumps({**document, "fit": fit.to_dict()}, indent=1, allow_nan=False) + "\n"


def _map_json(fit: MapFit, data: ForceMap, command: str) -> str:
    import json

    document = {
        "schema": MAP_SCHEMA,
        "name": data.label,
        "source": data.source,
        "command": command,
    }
    return json.dumps({**document, "fit": fit.to_dict()}, indent=1, allow_nan=False) + "\n"
