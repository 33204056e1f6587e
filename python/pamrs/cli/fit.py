"""The command line of fits: ``pamrs fit muscle`` and ``pamrs fit friction``."""

from __future__ import annotations

import math
import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

import typer

from pamrs._checks import refused
from pamrs._writing import check_writable
from pamrs.cli._shared import (
    GEOMETRY,
    AllowOutside,
    Contents,
    document,
    file_of,
    json_help,
    named_muscle,
    option,
    progress,
    quantity,
    write,
)
from pamrs.errors import FitError, ParameterError, RecordingError

if TYPE_CHECKING:
    from pamrs.fit import CrossValidation, ForceMap, FrictionFit, ModelComparison, MuscleFit
    from pamrs.rig import Muscle, Rig

SCHEMA: Final = "pamrs.muscle_fit/1"
FRICTION_SCHEMA: Final = "pamrs.friction_fit/1"
MAP_SCHEMA: Final = "pamrs.map_fit/1"
_MODULI: Final = {"modulus_slope": "dimensionless"}


class FrictionChoice(StrEnum):
    """Source of the muscle's friction."""

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
_FittedRig = Annotated[
    Path | None,
    typer.Option(
        help=(
            "Write a rig file with the fitted muscle: that of --muscle, or a new one with the "
            "muscle alone."
        )
    ),
]
_Result = Annotated[Path | None, typer.Option(help=json_help(SCHEMA))]

fit_app = typer.Typer(help="Fit models to measurements.")


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
    rig: _FittedRig = None,
    json: _Result = None,
    png: _Picture = None,
    allow_outside: AllowOutside = False,
) -> None:
    """Fit a muscle's force model to measured forces over length and pressure."""
    check_writable(rig, file_of(json), png)
    if per_level and rig is not None:
        raise typer.BadParameter(
            "a rig needs moduli linear in pressure: leave out --per-level or --rig"
        )
    inputs = _inputs(context)
    shape, notes = _shape(context, inputs)
    from pamrs.fit import fit_muscle

    with progress(f"fitting {inputs.data.label}"):
        try:
            start, rubbing, words = _rubbing(inputs, friction, model, shape["levels"])
            moduli = "per_level" if per_level else "linear"
            fit = fit_muscle(inputs.data, start, model=model, order=order, moduli=moduli, **shape)
            comparison = _comparison(inputs.data, start, fit.order, shape) if compare else None
            summary = _summary(fit, comparison, words, notes)
        except FitError as error:
            raise FitError("; ".join([str(error), *inputs.data.notes])) from error
    contents: Contents = {
        json: _document(
            SCHEMA,
            fit.data,
            context,
            issues=fit.data.issues,
            rows=len(fit.data),
            friction=rubbing,
            fit=fit,
            leave_one_pressure_out=_left_out(fit)[0],
            comparison=None if comparison is None else comparison.to_dicts(),
        )
        if json
        else "",
        rig: fit.to_rig(inputs.rig).to_toml_text() if rig else "",
        png: fit.figure,
    }
    write(contents, summary)
    if rig is not None and inputs.rig is None:
        typer.echo(
            f"{rig} is the muscle on a load frame: simulate it with a length, or give it [joint] "
            "and [arm]",
            err=True,
        )


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
    json: Annotated[Path | None, typer.Option(help=json_help(MAP_SCHEMA))] = (None),
    allow_outside: AllowOutside = False,
) -> None:
    """Make a table of forces of measurements alone, monotone in pressure and contraction: a muscle
    that no force model has to fit. Its geometry gives the volume only.
    """
    check_writable(rig, file_of(json))
    inputs = _inputs(context)
    from pamrs.fit import fit_map

    with progress(f"fitting {inputs.data.label}"):
        fit = fit_map(inputs.data, nodes=nodes)
    contents: Contents = {
        json: _document(MAP_SCHEMA, inputs.data, context, fit=fit) if json else "",
        rig: fit.to_rig(inputs.muscle, inputs.rig).to_toml_text() if rig else "",
    }
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
    json: Annotated[Path | None, typer.Option(help=json_help(FRICTION_SCHEMA))] = None,
    allow_outside: AllowOutside = False,
) -> None:
    """Fit the friction c_F = max(c0 + c1 P, floor) of a muscle to its hysteresis loops; of its
    geometry, the rest length is enough.
    """
    check_writable(file_of(json))
    map_ = _loops(context).with_directions()
    from pamrs.fit import fit_friction

    with progress(f"fitting {map_.label}"):
        fit = fit_friction(map_, floor=floor)
    rows = len(map_)
    contents: Contents = {
        json: _document(FRICTION_SCHEMA, map_, context, rows=rows, fit=fit) if json else ""
    }
    write(contents, f"{map_.label}: {fit.fit_report()}")


def _rubbing(
    inputs: _MapInputs,
    choice: FrictionChoice | None,
    model: str | None,
    pressures: Sequence[float] | None,
) -> tuple[Muscle, FrictionFit | None, str]:
    """The muscle with the friction asked for, the fit of that to the loops where there is one, and
    what to say of it.

    Unasked, friction is fitted where the rows have both directions and the muscle has none; not for
    the elbow's model, which has a branch of its own for lengthening.
    """
    from pamrs.fit import fit_friction

    data, muscle = inputs.data, inputs.muscle
    if choice is FrictionChoice.none:
        return muscle.without_friction(), None, ""
    loops = data.has_loops
    alone = loops and not muscle.has_friction and (model or muscle.model) != "elbow_linear"
    if choice is FrictionChoice.muscle or (choice is None and not alone):
        return muscle, None, _own_friction(muscle) if loops and muscle.has_friction else ""
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
        words = "the loops do not tell it from their scatter (--friction fit takes it all the same)"
        return muscle, None, f"friction: none, {words}"
    c0, c1 = found.params["friction_coefficient"], found.params["friction_pressure_slope"]
    line = (
        f"c0 = {c0.value:.4g} +- {c0.stderr:.2g}, c1 = {1e6 * c1.value:.4g} +- "
        f"{1e6 * c1.stderr:.2g} 1/MPa"
    )
    words = f"friction, fitted to the loops before the moduli: {line}"
    return found.to_muscle(muscle), found, words


def _own_friction(muscle: Muscle) -> str:
    """The friction law (2.36) that a muscle has, in words."""
    law = ("friction_coefficient", "friction_pressure_slope", "friction_floor")
    c0, c1, floor = (muscle.parameters[name] for name in law)
    numbers = f"c0 = {c0:.4g}, c1 = {1e6 * c1:.4g} 1/MPa"
    return f"friction as the muscle has it: c_F = max(c0 + c1 P, {floor:.4g}), {numbers}"


def _comparison(
    data: ForceMap, muscle: Muscle, order: int | None, shape: dict[str, Any]
) -> ModelComparison:
    """Fits of every model, in orders 1 to 4 and the fit's own, and in the geometry asked for."""
    from pamrs.fit import compare_models

    settings = {key: value for key, value in shape.items() if key != "geometry"}
    if shape["geometry"] is not None:
        muscle = muscle.replace(geometry=shape["geometry"])
    return compare_models(data, muscle, orders=sorted({1, 2, 3, 4, order or 1}), **settings)


# ------------------------------------------------------------------------- inputs


@dataclass(frozen=True)
class _MapInputs:
    """A force map, the muscle it is of, and what is known of both.

    The tolerances are standard deviations of the muscle's parameters in SI, the noise is that of
    the forces [N], and the rig is the one that the muscle is a part of.
    """

    data: ForceMap
    muscle: Muscle
    tolerance: dict[str, float]
    noise: float | None = None
    rig: Rig | None = None


def _shape(context: typer.Context, inputs: _MapInputs) -> tuple[dict[str, Any], list[str]]:
    """Arguments that a fit and a comparison share, and notes on what is not used."""
    from pamrs.rig.muscle_models import ELASTIC_PARAMETERS

    keys = ("model", "geometry", "levels", "free", "prior", "noise")
    model, geometry, levels, free, prior, noise = (context.params[key] for key in keys)
    texts = [] if levels is None else levels.split(",")
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
        "levels": [quantity("levels", text, "pressure")[0] for text in texts] or None,
        "noise": inputs.noise if noise is None else _noise(noise, inputs.data),
    }
    return shape, notes


def _inputs(context: typer.Context) -> _MapInputs:
    """Read the inputs of a fit, from a description or from a table and the options."""
    given, data = context.params, context.params["data"]
    if data.suffix.lower() == ".toml":
        others = ("muscle", *GEOMETRY, "where", "clipped")
        excluded = [key for key in others if given[key] or given[key] == ""]
        if excluded:
            raise ParameterError(
                f"{', '.join(map(option, excluded))} cannot be given: {data} describes its table "
                "and its muscle itself"
            )
        from pamrs.fit import load_measured_muscle

        measured = load_measured_muscle(data, allow_outside=given["allow_outside"])
        return _MapInputs(measured.data, measured.muscle, measured.tolerance, measured.noise)
    start, tolerance, base = _start(given)
    map_ = _table(given, float(start.parameters["rest_length"]))
    return _MapInputs(map_.checked_against(start), start, tolerance, rig=base)


def _table(given: Mapping[str, Any], rest_length: float) -> ForceMap:
    """The map of a table."""
    from pamrs.fit import load_force_map

    clipped = given["clipped"]
    return load_force_map(
        given["data"],
        rest_length=rest_length,
        where=dict(map(_filter, given["where"] or [])) or None,
        clipped=None if clipped is None else quantity("clipped", clipped, "force")[0],
    )


def _loops(context: typer.Context) -> ForceMap:
    """Map of hysteresis loops; only the rest length is needed, other sizes check the forces."""
    given = context.params
    sizes = {name for name in GEOMETRY if given[name] is not None}
    described = given["data"].suffix.lower() == ".toml"
    if described or given["muscle"] is not None or sizes - {"rest_length"}:
        return _inputs(context).data
    if not sizes:
        raise ParameterError(
            "the rest length is missing: give --rest-length (like '300 mm'), or --muscle with a "
            "rig file or a name of the library"
        )
    return _table(given, quantity("rest_length", given["rest_length"], "length")[0])


def _prior(text: str | None) -> dict[str, float]:
    """Standard deviations of moduli, ``NAME=NUMBER UNIT`` with commas between."""
    from pamrs.fit import COEFFICIENTS

    known: dict[str, float] = {}
    for part in [] if text is None else text.split(","):
        name, equals, value = (piece.strip() for piece in part.partition("="))
        if not equals or name not in COEFFICIENTS:
            raise refused(
                "--prior", part.strip(), f"NAME=VALUE with a name of {', '.join(COEFFICIENTS)}"
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
    column, equals, value = text.partition("=")
    if not (column.strip() and equals and value.strip()):
        raise refused("--where", text, "COLUMN=VALUE is needed")
    return column.strip(), value.strip()


def _start(given: Mapping[str, Any]) -> tuple[Muscle, dict[str, float], Rig | None]:
    """Nominal muscle from a name or from options, the tolerances of its geometry, and its rig."""
    from pamrs.rig import Muscle

    values: dict[str, Any] = {}
    tolerance: dict[str, float] = {}
    for name, dimension in GEOMETRY.items():
        if given[name] is not None:
            values[name], spread = quantity(name, given[name], dimension)
            tolerance |= {} if spread is None else {name: spread}
    if given["muscle"] is not None:
        base, known, rig = named_muscle(given["muscle"])
        return base.replace(**values), {**known, **tolerance}, rig
    lacking = [option(name) for name in GEOMETRY if name not in values]
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
    """Text of a fit for standard output."""
    cross, reason = _left_out(fit)
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


def _left_out(fit: MuscleFit) -> tuple[CrossValidation | None, str]:
    """Leave-one-pressure-out, or None and why there is none."""
    try:
        return fit.leave_one_pressure_out(), ""
    except FitError as error:
        return None, str(error)


def _command(context: typer.Context) -> str:
    """The command line that gives this result again."""
    words = ["pamrs", "fit", str(context.info_name), str(context.params["data"])]
    for name, value in context.params.items():
        if value is True:
            words.append(option(name))
        elif isinstance(value, (list, tuple)):
            words += [word for item in value for word in (option(name), str(item))]
        elif value is not None and value is not False and name != "data":
            words += [option(name), str(value)]
    return shlex.join(words)


def _document(schema: str, data: ForceMap, context: typer.Context, **found: Any) -> str:
    """A result with what it was made of."""
    made = {"name": data.label, "source": data.source, "command": _command(context)}
    return document(schema, **made, **found)
