"""The units that a rig file is written in."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field

from pamrs.channels import read_in
from pamrs.units import from_si, parse_unit, with_unit


@dataclass(frozen=True)
class Units:
    """Units in which values of a rig are told: those of its file.

    Attributes
    ----------
    written : dict of str to str
        By the dotted names of the parameters that the file gives.
    """

    written: dict[str, str] = field(default_factory=dict)

    def usual(self, si: str) -> str:
        """The unit that the file has most often for one dimension.

        Parameters
        ----------
        si : str
            The SI unit, which is not counted.

        Returns
        -------
        str
            Where the file has none, the one that laboratories read it in: bar, deg, mm, or SI.
        """
        dimension = parse_unit(si).dimension
        if not any(dimension):
            return si
        found = Counter(
            unit
            for unit in self.written.values()
            if unit != si and parse_unit(unit).dimension == dimension
        )
        return max(found, key=lambda unit: found[unit], default=read_in(si)[0])

    def of(self, name: str, si: str) -> str:
        """The unit of a parameter.

        Parameters
        ----------
        name : str
            Its dotted name.
        si : str
            Its SI unit.

        Returns
        -------
        str
            The one that the file has for it, else the usual one.
        """
        return self.written.get(name) or self.usual(si)

    def said(self, name: str, si: str, value: float, tol: float = 0.0, digits: str = ".4g") -> str:
        """A value of a parameter in its unit.

        Parameters
        ----------
        name : str
            Its dotted name; empty for a value that is none of the file's.
        si : str
            Its SI unit.
        value : float
            In SI.
        tol : float, optional
            Its standard deviation in SI, told with three figures where there is one.
        digits : str, optional
            How numbers are formatted.

        Returns
        -------
        str
            ``"8 ± 0.1 bar"``.
        """
        unit = self.of(name, si)
        spread = f" ± {from_si(tol, unit, si, difference=True):.3g}" if tol else ""
        return with_unit(f"{from_si(value, unit, si):{digits}}{spread}", unit)
