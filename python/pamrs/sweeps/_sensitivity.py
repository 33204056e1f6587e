"""Which parameters a result depends on: indices of Sobol and Morris by SALib, on top of a sweep."""

from __future__ import annotations

import importlib
import os
import warnings
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final, Literal

import numpy as np
from numpy.typing import NDArray

from pamrs._checks import one_of, refused, whole
from pamrs.errors import ParameterError, missing_package
from pamrs.rig import Rig
from pamrs.sweeps._axes import Samples
from pamrs.sweeps._draws import Range, ranges
from pamrs.sweeps._sweep import sweep

if TYPE_CHECKING:
    import xarray as xr

Array = NDArray[np.float64]
#: Of Morris' trajectories.
_LEVELS: Final = 4
#: Of the base samples; with fewer, the indices are of other distributions than those asked for.
_LEAST_LEFT: Final = 0.5

#: Method -> the numbers it gives.
METHODS: Final[dict[str, tuple[str, ...]]] = {
    "sobol": ("S1", "S1_conf", "ST", "ST_conf"),
    "morris": ("mu", "mu_star", "mu_star_conf", "sigma"),
}


def sensitivity(
    rig: Rig,
    metrics: Mapping[str, tuple[Any, ...]],
    parameters: Sequence[str] | None = None,
    *,
    within: Literal["tolerance"] | Mapping[str, tuple[float, float]] = "tolerance",
    method: Literal["sobol", "morris"] = "sobol",
    n: int = 256,
    seed: int = 0,
    store: str | os.PathLike[str] = "sensitivity.zarr",
    **runs: Any,
) -> xr.Dataset:
    """How much each parameter has to do with each metric, over what is known of the parameters.

    Parameters
    ----------
    rig : Rig
        The model, with its tolerances.
    metrics : mapping of str to tuple
        As for :func:`sweep`.
    parameters, within
        As for :func:`samples`.
    method : {"sobol", "morris"}
        Shares of the variance (Saltelli 2010; ``n (d + 2)`` runs for d parameters), or elementary
        effects along trajectories (Morris 1991; ``n (d + 1)`` runs), which are cheaper and only
        rank.
    n : int
        Base samples, of Sobol a power of two; or trajectories.
    seed : int
        The same seed gives the same runs, indices and confidence.
    store : path-like
        Of the sweep; the same call goes on where the last one ended.
    **runs
        As for :func:`sweep`: ``sample_time``, ``valve_command``, ``executor`` and so on.

    Returns
    -------
    xarray.Dataset
        Over the dimension ``parameter`` for each metric ``end``: of Sobol ``end.S1`` and
        ``end.ST``, shares of its variance by the parameter alone and with all its interactions; of
        Morris ``end.mu``, ``end.mu_star`` and ``end.sigma``, mean, mean magnitude and scatter of
        the change of the metric, in its unit, over the whole range of the parameter. ``_conf`` is
        half the 95 % interval. NaN for a metric that is the same in all runs. Groups in which a run
        ended are left out; the attributes ``groups`` and ``groups_used`` count them.

    Raises
    ------
    ParameterError
        If an argument is unknown or outside its range, or half of the groups have a run that ended.
    MissingPackageError
        If SALib, zarr or xarray is not installed.
    """
    one_of("method", method, METHODS)
    whole("n", n, 2)
    whole("seed", seed)
    if method == "sobol" and n & (n - 1):
        raise refused("n", n, "a power of two is needed for 'sobol'")
    known = ranges(rig, parameters, within)
    # points of the unit cube; those of a group, of which there are n, are judged together
    cube = np.asarray(_salib("sample", method, len(known), n, seed=seed), dtype=np.float64)
    columns = {p.name: p.values(cube[:, k]) for k, p in enumerate(known)}
    result = sweep(rig, Samples(columns), metrics, store=store, **runs)
    ended = np.isfinite(result["ended_at"].values).reshape(n, -1).any(axis=1)
    if (~ended).mean() <= _LEAST_LEFT:
        raise ParameterError(
            f"{ended.sum()} of {n} groups have a run that ended before its end "
            f"({result.attrs['first_ended']}); narrower ranges are needed"
        )
    kept = np.repeat(~ended, len(cube) // n)
    found = {
        f"{name}.{index}": values
        for name in metrics
        for index, values in _analysed(
            method, cube[kept], np.asarray(result[name].values)[kept], seed
        ).items()
    }
    units = {name: "1" if method == "sobol" else result[name].attrs["units"] for name in metrics}
    return _labelled(found, known, units).assign_attrs(
        method=method,
        runs=result.attrs["runs"],
        runs_ended=result.attrs["runs_ended"],
        groups=int(n),
        groups_used=int((~ended).sum()),
    )


def _salib(step: str, method: str, dimensions: int, *given: Any, seed: int) -> Any:
    """What SALib's function ``sample`` or ``analyze`` of a method answers, without its warnings."""
    problem = {
        "num_vars": dimensions,
        "names": [f"x{k}" for k in range(dimensions)],
        "bounds": [[0.0, 1.0]] * dimensions,
    }
    own: dict[str, Any] = {"sobol": {"calc_second_order": False}, "morris": {"num_levels": _LEVELS}}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            module = importlib.import_module(f"SALib.{step}.{method}")
        except ImportError as error:
            raise missing_package(error, "sensitivity") from error
        return getattr(module, step)(problem, *given, seed=seed, **own[method])


def _analysed(method: str, cube: Array, values: Array, seed: int) -> dict[str, Array]:
    dimensions = cube.shape[1]
    if np.ptp(values) == 0.0:
        return {index: np.full(dimensions, np.nan) for index in METHODS[method]}
    given = (values,) if method == "sobol" else (cube, values)
    # SALib takes a seed of 0 for none
    found = _salib("analyze", method, dimensions, *given, seed=seed or 1)
    return {index: np.asarray(found[index], dtype=np.float64) for index in METHODS[method]}


def _labelled(
    found: dict[str, Array], known: tuple[Range, ...], units: dict[str, str]
) -> xr.Dataset:
    import xarray as xr

    return xr.Dataset(
        {
            name: ("parameter", values, {"units": units[name.rpartition(".")[0]]})
            for name, values in found.items()
        },
        coords={
            "parameter": [p.name for p in known],
            "distribution": ("parameter", [p.words() for p in known]),
        },
    )
