"""Muscles with known parameters and force maps of them, for the tests of fitting."""

import math

import numpy as np

from pamrs import Muscle
from pamrs.fit import ForceMap

REST = 0.2
SHAPE = {
    "rest_length": REST,
    "rest_diameter": 0.02,
    "braid_angle": math.radians(70.0),
    "wall_thickness": 0.0018,
}
PRESSURES = np.array([1e5, 2e5, 3.5e5, 5e5, 6.5e5, 8e5])
CONTRACTIONS = np.linspace(-0.01, 0.26, 11)
TOLERANCE = {
    "rest_diameter": 0.001,
    "braid_angle": math.radians(1.0),
    "rest_length": 0.002,
    "wall_thickness": 2e-4,
}
SLOPES, OFFSETS = [2.5, -1.2, 0.6, 0.3], [9e5, -2.1e5, 4e4, 2.5e4]


def muscle(model="kothera", order=2, **changes):
    """A muscle with known elastic parameters."""
    own = {
        "mooney_rivlin": {"c10": 1.2e5, "c01": 3e4},
        "elbow_linear": {"bladder_modulus": 8e5},
        "gaylord": {},
        "chou_hannaford": {},
    }.get(model, {"modulus_slope": SLOPES[:order], "modulus_offset": OFFSETS[:order]})
    return Muscle(**{**SHAPE, "model": model, **own, **changes})


def grid(*axes):
    """Every combination of the values of some axes, (n,) arrays."""
    return tuple(axis.ravel() for axis in np.meshgrid(*axes, indexing="ij"))


def mapped(pressure, contraction, force, rest=REST, **options):
    """A force map over contractions."""
    length = rest * (1.0 - np.asarray(contraction))
    return ForceMap.from_arrays(
        length=length, pressure=pressure, force=force, rest_length=rest, **options
    )


def remade(data, rows=slice(None), **changes):
    """A force map anew from some rows of another, with other columns or options."""
    columns = {name: getattr(data, name)[rows] for name in ("length", "pressure", "force")}
    return ForceMap.from_arrays(**{**columns, "rest_length": data.rest_length, **changes})


def joined(*maps, **changes):
    """One force map of the rows of several, with their directions."""
    names = ("length", "pressure", "force", "direction")
    columns = {name: np.concatenate([getattr(map_, name) for map_ in maps]) for name in names}
    return ForceMap.from_arrays(**{**columns, "rest_length": maps[0].rest_length, **changes})


def measure(
    of,
    *,
    pressures=PRESSURES,
    contractions=CONTRACTIONS,
    noise=0.0,
    seed=0,
    direction=None,
    rest=REST,
):
    """A force map of a muscle, with Gaussian noise [N]."""
    p, e = grid(pressures, contractions)
    force = of.force(p, e) if direction is None else of.force(p, e, direction=direction)
    force = force + noise * np.random.default_rng(seed).standard_normal(len(p))
    ways = None if direction is None else np.full(len(p), direction)
    length = of.parameters["rest_length"] * (1.0 - e)
    return ForceMap.from_arrays(
        length=length, pressure=p, force=force, rest_length=rest, direction=ways
    )


def loops(of, *, noise=0.0, seeds=(0, 0)):
    """A force map of both branches of a muscle, the contracting ones first."""
    ways = zip((-1.0, 1.0), seeds, strict=True)
    return joined(*(measure(of, direction=way, noise=noise, seed=seed) for way, seed in ways))


def truth(of, fit):
    """The muscle's own values of the fitted numbers."""
    given = of.parameters
    return np.array(
        [
            given["modulus_slope" if name[0] == "m" else "modulus_offset"][int(name[1:]) - 1]
            if name[0] in "mb" and name[1:].isdigit()
            else given[name]
            for name in fit.params
        ]
    )
