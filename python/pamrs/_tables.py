"""Results as tables of other libraries: Datasets of xarray and DataFrames of pandas, with units.

Each class says which columns it has; both libraries are imported when they are asked for.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from pamrs.channels import unit_of
from pamrs.errors import missing_package

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr


class Columns(NamedTuple):
    """Content of a table.

    Attributes
    ----------
    axes : dict of str to array_like
        Coordinates by the name of their dimension.
    values : dict of str to (tuple of str, array_like)
        Dimensions and values of each column.
    units : dict of str to str
        SI units of coordinates and columns, where there is one.
    """

    axes: Mapping[str, Any]
    values: Mapping[str, tuple[tuple[str, ...], Any]]
    units: Mapping[str, str]


def over_time(time: Any, channels: Mapping[str, Any], units: Mapping[str, str]) -> Columns:
    """Columns of channels over time [s]; `units` are those of names that are no channels."""
    own = {name: unit_of(name) for name in channels} | dict(units)
    values = {name: (("time",), values) for name, values in channels.items()}
    return Columns({"time": time}, values, {"time": "s", **own})


class Tabular:
    """Base of results that convert to tables of xarray and pandas."""

    def _columns(self) -> Columns:
        """Columns of the result, given by a subclass."""
        raise NotImplementedError

    def to_xarray(self) -> xr.Dataset:
        """All columns as a Dataset, SI units in ``attrs["units"]`` of each.

        Returns
        -------
        xarray.Dataset
            A variable for each column over its dimensions.

        Raises
        ------
        MissingPackageError
            If xarray is not installed.
        """
        try:
            import xarray as xr
        except ImportError as error:
            raise missing_package(error, "io") from error
        axes, values, units = self._columns()
        attributes = {name: {"units": unit} for name, unit in units.items()}
        return xr.Dataset(
            {name: (dims, of, attributes.get(name)) for name, (dims, of) in values.items()},
            {name: ((name,), of, attributes.get(name)) for name, of in axes.items()},
        )

    def to_pandas(self) -> pd.DataFrame:
        """All columns as a DataFrame, SI units by column in ``attrs["units"]``.

        Returns
        -------
        pandas.DataFrame
            Indexed by its dimension (``time`` [s]), or by several of them.

        Raises
        ------
        MissingPackageError
            If pandas is not installed.
        """
        try:
            import pandas as pd
        except ImportError as error:
            raise missing_package(error, "io") from error
        axes, values, units = self._columns()
        used = [name for name in axes if any(name in dims for dims, _ in values.values())]
        lengths = tuple(len(axes[name]) for name in used)

        def whole(dims: tuple[str, ...], of: Any) -> Any:
            shape = [len(axes[name]) if name in dims else 1 for name in used]
            return np.broadcast_to(np.reshape(of, shape), lengths).ravel()

        index: Any = pd.MultiIndex.from_product([axes[name] for name in used], names=used)
        if len(used) == 1:
            index = pd.Index(axes[used[0]], name=used[0])
        frame = pd.DataFrame({name: whole(*one) for name, one in values.items()}, index=index)
        frame.attrs["units"] = dict(units)
        return frame
