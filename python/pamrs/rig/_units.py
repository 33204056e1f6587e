"""The units that a rig file is written in."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field

from pamrs.channels import read_in
from pamrs.units import from_si, parse_unit, with_unit

#: A refusal of the core, which knows SI alone, and a range in it.
_REFUSED = re.compile(r"(?P<name>[\w.-]+) = (?P<value>\S+) (?P<why>is not allowed: .*)", re.DOTALL)
_RANGE = re.compile(r"from (\S+) to (\S+) (\S+)")


@dataclass(frozen=True)
class Units:
    """Units in which values of a rig are written: those of its file.

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
            Its standard deviation in SI, written with three figures where there is one.
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

    def retold(self, refusal: str, known: Mapping[str, str]) -> str:
        """Message of the core with the value and its bounds in the unit of the file.

        Parameters
        ----------
        refusal : str
            Its message, in SI.
        known : mapping of str to str
            SI units by the dotted names of the parameters.

        Returns
        -------
        str
            As it was where it is about none of these.
        """
        found = _REFUSED.fullmatch(refusal)
        if found is None or found["name"] not in known:
            return refusal
        name, si = found["name"], known[found["name"]]

        def ends(range_: re.Match[str]) -> str:
            if range_[3] != si:
                return range_[0]
            first, last = (from_si(float(end), self.of(name, si), si) for end in range_.group(1, 2))
            return with_unit(f"from {first:.4g} to {last:.4g}", self.of(name, si))

        value = self.said(name, si, float(found["value"]))
        return f"{name} = {value} {_RANGE.sub(ends, found['why'])}"
