"""Rigs: the nominal model of a test stand, read from TOML with units and tolerances.

A rig is a chain of blocks (supply, valve, chamber, muscle, joint, arm, sensors) around a gas. Only
``gas`` and ``chamber`` are always there. Everything inside is SI; angles are radians, pressures gauge.
"""

from __future__ import annotations

import copy
import json
import math
import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pamrs.errors import ParameterError, RigError, joined
from pamrs.rig_reader import read_model
from pamrs.rig_schema import BLOCKS, SCHEMA, Key, find_key, keys_of

if TYPE_CHECKING:
    from pamrs.muscle import Muscle

__all__ = ["Parameter", "Rig", "load_rig", "parse_rig"]


@dataclass(frozen=True, slots=True)
class Parameter:
    """One scalar of a rig.

    Attributes
    ----------
    name : str
        Dotted name, ``"valve.discharge_area_max"``.
    value : float
        SI value; only a placeholder where ``known`` is False.
    unit : str
        The SI unit.
    tol : float
        One standard deviation of what the user knows, SI; 0 when the value is taken as exact, infinite
        when it is unknown.
    lower, upper : float
        Bounds of the possible, SI.
    known : bool
        False when the file says ``unknown = true``.
    """

    name: str
    value: float
    unit: str
    tol: float
    lower: float
    upper: float
    known: bool = True


@dataclass(frozen=True, eq=False)
class Rig:
    """The model of a test stand; made by :func:`load_rig`, changed only by making another.

    Attributes
    ----------
    name : str
        The rig's name.
    source : str
        Where it was read from, for messages.
    """

    name: str
    _model: dict[str, Any] = field(repr=False)
    _tolerances: dict[str, float] = field(default_factory=dict, repr=False)
    _effect_std: dict[str, dict[str, float]] = field(default_factory=dict, repr=False)
    source: str = field(default="", repr=False)

    def __getstate__(self) -> dict[str, Any]:
        return {name: value for name, value in self.__dict__.items() if name != "_compiled"}  # made again when needed

    # ------------------------------------------------------------------ reading

    @property
    def model(self) -> dict[str, Any]:
        """The nested model as the core takes it: SI values, absent blocks None (a copy)."""
        return copy.deepcopy(self._model)

    @property
    def parameters(self) -> dict[str, Parameter]:
        """All scalar parameters by dotted name, in the order of the blocks."""
        return {name: self.parameter(name) for name, _ in self._scalars()}

    @property
    def effects(self) -> list[dict[str, Any]]:
        """The omitted physics already in the model: ``{"id", "parameters": {name: SI value}}`` each."""
        effects: list[dict[str, Any]] = copy.deepcopy(self._model["effects"])
        return effects

    @property
    def effect_std(self) -> dict[str, dict[str, float]]:
        """Standard deviations of the effects' parameters, where the file gives them: id -> name -> SI."""
        return copy.deepcopy(self._effect_std)

    @property
    def blocks(self) -> tuple[str, ...]:
        """The blocks that this rig has."""
        return tuple(block for block in BLOCKS if self._model[block] is not None)

    @property
    def muscle(self) -> Muscle | None:
        """The rig's muscle as a model of its own, or None when the rig has none."""
        if self._model["muscle"] is None:
            return None
        from pamrs.muscle import Muscle

        return Muscle.from_model(self._model["muscle"])

    def parameter(self, name: str) -> Parameter:
        """One parameter by its dotted name.

        Parameters
        ----------
        name : str
            For example ``"arm.payload"``.

        Returns
        -------
        Parameter

        Raises
        ------
        ParameterError
            If the rig has no such scalar.
        """
        key = self._key(name)
        block = name.partition(".")[0]
        tol = self._tolerances.get(name, 0.0)
        value = float(self._model[block][key.name])
        return Parameter(name, value, key.unit, tol, key.lower, key.upper, not math.isinf(tol))

    def _scalars(self) -> Iterator[tuple[str, Key]]:
        for block in self.blocks:
            for key in keys_of(block, self._model[block]):
                if key.kind in ("scalar", "count"):
                    yield f"{block}.{key.name}", key

    def _key(self, name: str) -> Key:
        key = find_key(name)
        block = name.partition(".")[0]
        if key is None or key.kind not in ("scalar", "count") or key.name not in (self._model.get(block) or {}):
            known = ", ".join(dotted for dotted, _ in self._scalars())
            raise ParameterError(f"rig {self.name!r} has no parameter {name!r}; it has: {known}")
        return key

    # ----------------------------------------------------------------- changing

    def with_parameters(self, values: Mapping[str, float]) -> Rig:
        """A rig with other parameter values.

        Parameters
        ----------
        values : mapping of str to float
            Dotted name -> SI value. Tolerances stay; an unknown parameter that gets a value stays unknown.

        Returns
        -------
        Rig
            A new rig.

        Raises
        ------
        ParameterError
            For an unknown name, or a value outside the bounds of the possible.
        """
        model = self.model
        problems = []
        for name, value in values.items():
            key = self._key(name)
            number = float(value)
            if not (math.isfinite(number) and key.lower <= number <= key.upper):
                problems.append(f"{name} = {number:g} {key.unit} is not allowed: {_range(key)}")
            whole = key.kind == "count"
            if whole and not number.is_integer():
                problems.append(f"{name} = {number:g} is not allowed: a whole number is needed")
                continue
            model[name.partition(".")[0]][key.name] = int(number) if whole else number
        if problems:
            raise ParameterError(joined(f"rig {self.name!r}", problems))
        return Rig(self.name, model, self._tolerances, self._effect_std, self.source)

    def with_effect(
        self,
        effect: str,
        parameters: Mapping[str, float] | None = None,
        *,
        std: Mapping[str, float] | None = None,
    ) -> Rig:
        """A rig with one effect more; an effect of the same id is replaced.

        Parameters
        ----------
        effect : str
            Id of the catalogue, for example ``"leak_muscle"``.
        parameters : mapping of str to float, optional
            SI values; what is left out gets the catalogue's default.
        std : mapping of str to float, optional
            Standard deviations, SI; written to the file as a note of how well each is known.

        Returns
        -------
        Rig
            A new rig.

        Raises
        ------
        ParameterError
            For an unknown effect or parameter, or a value outside its bounds.
        """
        from pamrs.effects_table import EFFECTS

        info = EFFECTS.get(effect)
        if info is None:
            raise ParameterError(f"unknown effect {effect!r}; the catalogue has: {', '.join(sorted(EFFECTS))}")
        given = dict(parameters or {})
        names = [parameter.name for parameter in info.parameters]
        problems = [f"unknown parameter {name!r}; it has: {', '.join(names)}" for name in {*given, *(std or {})} if name not in names]
        chosen: dict[str, float] = {}
        for parameter in info.parameters:
            value = float(given.get(parameter.name, parameter.default))
            if not (math.isfinite(value) and parameter.lower <= value <= parameter.upper):
                problems.append(
                    f"{parameter.name} = {value:g} {parameter.unit} is not allowed: "
                    f"from {parameter.lower:g} to {parameter.upper:g} {parameter.unit}"
                )
            chosen[parameter.name] = value
        if problems:
            raise ParameterError(joined(f"effect {effect!r}", problems))
        base = self.without_effect(effect)
        model = base.model
        model["effects"].append({"id": effect, "parameters": chosen})
        kept = {**base._effect_std, **({effect: {k: float(v) for k, v in std.items()}} if std else {})}
        return Rig(self.name, model, self._tolerances, kept, self.source)

    def without_effect(self, effect: str | None = None) -> Rig:
        """A rig without one effect; an effect that is not there is no error.

        Parameters
        ----------
        effect : str, optional
            Its id; None removes all.

        Returns
        -------
        Rig
        """
        model = self.model
        model["effects"] = [entry for entry in model["effects"] if effect is not None and entry["id"] != effect]
        kept = {k: v for k, v in self._effect_std.items() if effect is not None and k != effect}
        return Rig(self.name, model, self._tolerances, kept, self.source)

    # ------------------------------------------------------------------ writing

    def to_json(self) -> str:
        """The model as JSON text, as the core takes it (SI, radians, gauge pressures)."""
        return json.dumps(self._model)

    def to_toml_text(self) -> str:
        """The rig as TOML in SI units; reading it gives the same numbers to the last bit."""
        lines = [f"schema = {_text(SCHEMA)}", f"name = {_text(self.name)}"]
        for block in self.blocks:
            lines += ["", f"[{block}]"]
            groups: dict[str, list[str]] = {}
            for key in keys_of(block, self._model[block]):
                if len(key.where) == 1:
                    lines.append(f"{key.name} = {self._entry(block, key)}")
                else:
                    groups.setdefault(key.where[0], []).append(f"{key.where[1]} = {self._entry(block, key)}")
            lines += [f"{group} = {{ {', '.join(members)} }}" for group, members in groups.items()]
        for effect in self._model["effects"]:
            lines += ["", "[[effects]]", f"id = {_text(effect['id'])}", "[effects.parameters]"]
            units = _effect_units(effect["id"])
            spread = self._effect_std.get(effect["id"], {})
            for name, value in effect["parameters"].items():
                std = f", std = {_number(spread[name])}" if name in spread else ""
                lines.append(f"{name} = {{ value = {_number(value)}, unit = {_text(units[name])}{std} }}")
        return "\n".join(lines) + "\n"

    def to_toml(self, path: str | os.PathLike[str]) -> Path:
        """Write :meth:`to_toml_text` to a file.

        Parameters
        ----------
        path : path-like
            The file.

        Returns
        -------
        Path
            The file written.

        Raises
        ------
        RigError
            If the file cannot be written.
        """
        from pamrs.writing import write_atomically

        try:
            return write_atomically(path, self.to_toml_text())
        except OSError as error:
            raise RigError(f"{path}: cannot be written ({error.strerror or error})") from error

    def _entry(self, block: str, key: Key) -> str:
        value = self._model[block][key.name]
        if key.kind == "choice":
            return _text(value)
        if key.kind == "count":
            return str(value)
        if key.kind == "vector":
            numbers = "[" + ", ".join(_number(item) for item in value) + "]"
            if key.path:
                return numbers
        tol = self._tolerances.get(f"{block}.{key.name}", 0.0)
        note = "" if tol == 0.0 else (", unknown = true" if math.isinf(tol) else f", tol = {_number(tol)}")
        if key.kind == "vector":
            return f"{{ value = {numbers}, unit = {_text(key.unit)}{note} }}"
        if key.path and not note:
            return _number(value)
        return f"{{ value = {_number(value)}, unit = {_text(key.unit)}{note} }}"


def _effect_units(effect: str) -> dict[str, str]:
    from pamrs.effects_table import EFFECTS

    return {parameter.name: parameter.unit for parameter in EFFECTS[effect].parameters}


def _text(value: str) -> str:
    return json.dumps(value, ensure_ascii=False)


def _number(value: float) -> str:
    return repr(float(value))


def _range(key: Key) -> str:
    return f"from {key.lower:g} to {key.upper:g} {key.unit}"


def load_rig(path: str | os.PathLike[str]) -> Rig:
    """Read a rig file.

    Parameters
    ----------
    path : path-like
        A TOML file of the schema ``pamrs.rig/1``, or a folder that has a ``rig.toml``.

    Returns
    -------
    Rig
        The rig, in SI units.

    Raises
    ------
    RigError
        If the file cannot be read, or with every problem found in it: unknown keys, missing or wrong
        units, values that are not finite or not possible, blocks that do not fit together.
    """
    file = Path(path)
    if file.is_dir():
        file = file / "rig.toml"
    try:
        text = file.read_text(encoding="utf-8")
    except OSError as error:
        raise RigError(f"{file}: cannot be read ({error.strerror or error})") from error
    except UnicodeDecodeError as error:
        raise RigError(f"{file}: not a text file in UTF-8") from error
    return parse_rig(text, source=str(file))


def parse_rig(text: str, *, source: str = "rig") -> Rig:
    """Read a rig from TOML text; ``source`` names it in messages. See :func:`load_rig`."""
    content = read_model(text, source)
    return Rig(content.name, content.model, content.tolerances, content.effect_std, source)
