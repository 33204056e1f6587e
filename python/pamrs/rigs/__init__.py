"""Rigs that come with the package, by name; light, so that the command line can list them in its
help.
"""

from __future__ import annotations

import functools
import json
import re
from collections.abc import Callable
from importlib import resources
from typing import TYPE_CHECKING, Final

from pamrs._checks import one_of
from pamrs.errors import ParameterError, meant

if TYPE_CHECKING:
    from pamrs.rig import Muscle, Rig

__all__ = ["bench", "names", "named", "sealed_chamber", "shoulder", "template"]

_BENCH: Final = """schema = "pamrs.rig/1"
name = "bench"
gas = {{ ambient_pressure = {{ value = 101325.0, unit = "Pa" }}, temperature = {{ value = 293.15, \
unit = "K" }} }}
[chamber]
dead_volume = {{ value = {volume!r}, unit = "m3" }}
"""


_FIRST: Final = "shoulder"  # the one that a new rig begins with
_INSIDE: Final = 0.999  # of the range of the muscle that the frame uses


def names() -> list[str]:
    """Names of the rigs that come with the package, the shoulder first, the others by the
    alphabet.
    """
    files = (file.name for file in resources.files(__name__).iterdir())
    found = sorted(name.removesuffix(".toml") for name in files if name.endswith(".toml"))
    return sorted(found, key=lambda name: name != _FIRST)


def _text(name: str) -> str:
    if name not in names():
        raise ParameterError(
            f"rig = {name!r} does not come with the package; {meant(name, names())}"
        )
    return resources.files(__name__).joinpath(f"{name}.toml").read_text(encoding="utf-8")


def named(name: str) -> Rig:
    """A rig of the package by its name.

    Parameters
    ----------
    name : str
        One of :func:`names`.

    Returns
    -------
    Rig

    Raises
    ------
    ParameterError
        If there is no such rig.
    """
    from pamrs.rig import parse_rig

    return parse_rig(_text(name), source=f"{name}.toml")


_BALANCE: Final = (
    'gas = "energy_balance"  # keeps mass; "coefficients" of the literature (3.17) do not',
    'heat_transfer_coefficient = { value = 50.0, unit = "W/(m2 K)", tol = 25.0 }',
)


def _with_energy_balance(text: str) -> str:
    """A rig file whose chambers have an energy balance instead of coefficients."""
    lines: list[str] = []
    inside = False
    for line in text.splitlines():
        if line.startswith("["):
            inside = re.match(r"\[chamber(\.[^\]]+)?\]", line) is not None
        if inside and re.match(r"alpha(_in|_out)?\s*=", line):
            continue
        lines.append(line)
        if inside and line.startswith("["):
            lines += _BALANCE
    return "\n".join(lines) + "\n"


def template(like: str = "shoulder", name: str | None = None, gas: str = "energy_balance") -> str:
    """A rig file to begin with: a rig of the package, and in comments every key that a rig file may
    have.

    The chambers of the packaged rigs have the coefficients of the literature, which make up to 73 %
    of the air that a cycle uses out of nothing; a new rig has an energy balance unless asked
    otherwise.

    Parameters
    ----------
    like : str
        One of :func:`names`.
    name : str, optional
        What the rig is called; ``like`` by default.
    gas : str
        ``energy_balance``, or ``coefficients`` for the rig of the package as it is.

    Returns
    -------
    str
        TOML that can be read as it is.

    Raises
    ------
    ParameterError
        If there is no such rig, the name is empty, or the gas is neither of the two.
    """
    from pamrs.rigs._keys import every_key

    one_of("gas", gas, ("energy_balance", "coefficients"))
    text = _with_energy_balance(_text(like)) if gas == "energy_balance" else _text(like)
    if name is not None:
        if not name.strip():
            raise ParameterError("name is empty: a rig needs a name")
        text = text.replace(f'name = "{like}"', f"name = {json.dumps(name, ensure_ascii=False)}", 1)
    return f"{text.rstrip()}\n\n{every_key()}"


def shoulder() -> Rig:
    """The shoulder joint of the 2014 dissertation: six muscles, spool valve, tank, arm with a
    payload.
    """
    return named("shoulder")


def bench(muscle: Muscle | None = None, name: str = "bench") -> Rig:
    """A bench: one muscle on a load frame that prescribes its length.

    Without a muscle it is the packaged rig ``bench``, with pam_a_1in of the library and tolerances.
    With one, the frame has all lengths that the muscle can have, and the chamber a dead volume of a
    tenth of the muscle's own.

    It has no valve: :func:`pamrs.simulate` takes the length and, where it is held, the pressure.

    Parameters
    ----------
    muscle : Muscle, optional
        The muscle; that of the packaged rig by default.
    name : str
        What to call the rig.

    Returns
    -------
    Rig
    """
    from pamrs.rig import Rig, parse_rig
    from pamrs.rig.schema import keys_of

    if muscle is None:
        text = _text("bench").replace('name = "bench"', f"name = {json.dumps(name)}", 1)
        return parse_rig(text, source="bench.toml")
    rig = parse_rig(_BENCH.format(volume=0.1 * float(muscle.air_volume(0.0))), source="bench")
    low, high = muscle.contraction_range
    rest = float(muscle.parameters["rest_length"])
    frame = {
        "kind": "frame",
        "min_length": rest * (1.0 - _INSIDE * high),
        "max_length": rest * (1.0 - _INSIDE * low),
    }
    own = {key.name: muscle.parameters[key.name] for key in keys_of("muscle", muscle.parameters)}
    cell = {**rig.model["sensors"], "force_gain": 1.0}
    put = {"muscle": {**own, "count": 1}, "load": frame, "sensors": cell}
    return Rig(name, {**rig.model, **put})


def sealed_chamber() -> Rig:
    """A rigid chamber of one decilitre behind a shut valve, with a pressure transducer."""
    return named("sealed_chamber")


def __getattr__(name: str) -> Callable[[], Rig]:
    """Every rig of the package as a function, as ``shoulder``: ``pamrs.rigs.elbow()``."""
    if name.startswith("_") or name not in names():
        raise AttributeError(
            f"module {__name__!r} has no attribute {name!r}; {meant(name, names())}"
        )
    return functools.partial(named, name)


def __dir__() -> list[str]:
    return names()
