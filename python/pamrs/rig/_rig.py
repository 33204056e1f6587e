"""Rigs: the nominal model of a test bench, read from TOML with units and tolerances.

A rig is blocks around a gas: supplies, valves, lines and chambers that the air goes through,
muscles, joints and an arm or a load that the force goes through, sensors. Only ``gas`` and
``chamber`` are always there. A block that occurs once needs no name; several of a kind have one
each, and ports say which is connected to which. Everything inside is SI; angles are radians,
pressures gauge.
"""

from __future__ import annotations

import copy
import math
import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from pathlib import Path
from typing import Any, Final

from pamrs._checks import checked_number, checked_table, doubt, one_of, plain, positive, refused
from pamrs._files import read_toml
from pamrs._views import Panels, View
from pamrs._writing import write_atomically
from pamrs.errors import ParameterError, RigError, joined, meant
from pamrs.rig._cautions import cautions_of
from pamrs.rig._muscle import Muscle
from pamrs.rig._ports import Ports, connect, wiring
from pamrs.rig._reader import Content, read_model
from pamrs.rig._switching import (
    Entry,
    full_name,
    kind_of_entry,
    named_entries,
    new_entry,
    placed,
    without,
)
from pamrs.rig._units import Units
from pamrs.rig._writer import core_json, toml_text
from pamrs.rig.schema import BLOCKS, Key, keys_of, qualified, split_name, tables_of

#: By the core, from the ports and from the tables when they are needed; what a rig differs from by
#: numbers only, and what was made of it.
_MADE_AGAIN = ("_compiled", "_connected", "_inputs", "_known", "_origin", "_grown")


@dataclass(frozen=True, slots=True)
class Parameter:
    """One scalar of a rig.

    Attributes
    ----------
    name : str
        Dotted name, ``"valve.discharge_area_max"`` or, of a block with a name,
        ``"valve.flexor.discharge_area_max"``.
    value : float
        SI value; only a placeholder where ``known`` is False.
    unit : str
        The SI unit.
    tol : float
        One standard deviation of what the user knows, SI; 0 when the value is taken as exact,
        infinite when it is unknown.
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


_DAY: Final = 86400.0  # [s]
_COMPARED: Final = ("name", "_model", "_tolerances", "_effect_std")
"""Attributes that equal rigs have alike; the file they were read from, and comments, may differ."""


@dataclass(frozen=True, eq=False)
class Rig(View):
    """The model of a test bench; made by :func:`load_rig`, changed only by making another.

    Attributes
    ----------
    name : str
        The rig's name.
    source : str
        Where it was read from, for messages.
    units : Units
        The units that its file has, for what is said of its values.

    Examples
    --------
    >>> import pamrs
    >>> rig = pamrs.rigs.shoulder()
    >>> rig.wiring[0]
    'air: supply -> valve -> chamber -> ambient'
    >>> heavy = rig.with_parameters({"arm.payload": 12.0})
    >>> heavy.parameter("arm.payload").value, heavy == rig
    (12.0, False)
    """

    name: str
    _model: dict[str, Any] = field(repr=False)
    _tolerances: dict[str, float] = field(default_factory=dict, repr=False)
    _effect_std: dict[str, dict[str, float]] = field(default_factory=dict, repr=False)
    source: str = field(default="", repr=False)
    _text: str = field(default="", repr=False)  # the file, as its author wrote it
    units: Units = field(default_factory=Units, repr=False)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Rig):
            return NotImplemented
        return all(getattr(self, name) == getattr(other, name) for name in _COMPARED)

    def __hash__(self) -> int:
        return hash(self.name)

    def __getstate__(self) -> dict[str, Any]:
        return {name: value for name, value in self.__dict__.items() if name not in _MADE_AGAIN}

    # ------------------------------------------------------------------ reading

    @property
    def model(self) -> dict[str, Any]:
        """The nested model in SI values (a copy).

        A block is its table, named ones are ``{name: table}``, an absent one is None. ``"ports"``
        has the ports that the file gives, by the full name of the block; :meth:`ports` has all of
        them.
        """
        return copy.deepcopy(self._model)

    def tables(self, block: str) -> dict[str, dict[str, Any]]:
        """The tables of one kind of block, with or without names (a copy).

        Parameters
        ----------
        block : str
            For example ``"valve"``.

        Returns
        -------
        dict
            Name -> SI table, in the order of the file; ``""`` is the name of a block without one.
            Empty when the rig has none.

        Raises
        ------
        ParameterError
            If there is no such kind of block.
        """
        one_of("block", block, BLOCKS)
        return copy.deepcopy(tables_of(self._model, block))

    def ports(self, block: str) -> dict[str, dict[str, str]]:
        """Connections of the blocks of one kind, given in the file or by default.

        Parameters
        ----------
        block : str
            For example ``"valve"``, whose ports are ``from`` and ``to``.

        Returns
        -------
        dict
            Name -> port -> block in full, ``"chamber.flexor"``; links base first. The ``from`` of a
            line that valves feed is ``""``.

        Raises
        ------
        ParameterError
            If there is no such kind of block.
        RigError
            If the blocks do not fit together, which only a rig made by hand can show.
        """
        names = self.tables(block)
        return copy.deepcopy(self._connected.get(block, {name: {} for name in names}))

    @property
    def wiring(self) -> list[str]:
        """The ways of the air and of the force in words, one line each:
        ``"air: supply -> valve -> chamber -> ambient"``.
        """
        return wiring(self._model, self._connected)

    def _panels(self) -> Panels:
        from pamrs.rig import _drawing

        forces = {"force": partial(_drawing.draw_forces, rig=self)} if self.tables("muscle") else {}
        return {"blocks": partial(_drawing.draw_blocks, rig=self), **forces}

    def _numbers(self) -> dict[str, str]:
        facts = {"rig": self.name, "blocks": ", ".join(self.blocks)}
        for name, table in self.tables("muscle").items():
            full = qualified("muscle", name)
            ends = ((key, table[key]) for key in ("rest_length", "rest_diameter"))
            size = " x ".join(self.units.said(f"{full}.{key}", "m", end) for key, end in ends)
            facts[full] = f"{table['model']}, {size}, {table['count']} of them"
        for name, table in self.tables("supply").items():
            full = qualified("supply", name)
            begun = self.units.said(f"{full}.initial_pressure", "Pa", table["initial_pressure"])
            facts[full] = f"{table['kind']}, {begun}"
        facts |= {"effects": ", ".join(full_name(e) for e in self.effects)} if self.effects else {}
        return facts | {"cautions": "; ".join(self.cautions) or "none"}

    @property
    def cautions(self) -> list[str]:
        """Cautions about parts of the rig that are possible and most likely mistakes, one sentence
        each: chambers that no air reaches, valves that never pass air, delays as long as the period
        of the pulses, muscles that push more than rubber bears, whose ``buckling_load`` is missing,
        that are too long or short for their joint, or without a largest pressure, friction of
        exactly zero, measured values without a tolerance. Empty where there are none.
        """
        return cautions_of(self._model, self._connected, self._known, self.units, self._text)

    @cached_property
    def _connected(self) -> Ports:
        ports, problems = connect(self._model)
        if problems:
            raise RigError(joined(f"rig {self.name!r}", problems))
        return ports

    @property
    def parameters(self) -> dict[str, Parameter]:
        """All scalar parameters by dotted name, in the order of the blocks."""
        return dict(self._known)

    @cached_property
    def _known(self) -> dict[str, Parameter]:
        return {name: self.parameter(name) for name, _ in self._scalars()}

    @property
    def effects(self) -> list[dict[str, Any]]:
        """The omitted physics already in the model: ``{"id", "parameters": {name: SI value}}``
        each.

        With ``"at"`` if it acts on one block only, and ``"form"`` if it has another form than the
        first.
        """
        effects: list[dict[str, Any]] = copy.deepcopy(self._model["effects"])
        return effects

    @property
    def model_error(self) -> dict[str, dict[str, float]]:
        """Stated error of the model, from ``[model_error]``: name of a kind of block or of a
        channel -> ``{"share": number}`` or ``{"size": SI value}``, one standard deviation each.
        """
        stated: dict[str, dict[str, float]] = copy.deepcopy(self._model.get("model_error") or {})
        return stated

    @property
    def case(self) -> str:
        """Folder of the case that the model was diagnosed from, relative to that of the file, as it
        says; empty where it says none.
        """
        return str(self._model.get("case", ""))

    @property
    def limits(self) -> dict[str, Any]:
        """Limits of the bench, where the file has them (a copy): ``max_pressure`` [Pa, gauge] and
        ``payloads`` [kg], for experiments that are proposed.
        """
        return copy.deepcopy(self._model.get("limits", {}))

    @property
    def effect_std(self) -> dict[str, dict[str, float]]:
        """Standard deviations of the effects' parameters, where the file gives them: id -> name ->
        SI.

        Of several effects of one id each has the name of its block behind a dot,
        ``"leak_muscle.flexor"``.
        """
        found: dict[str, dict[str, float]] = {}
        for label, entry in named_entries(self):
            if (full := full_name(entry)) in self._effect_std:
                found[label] = dict(self._effect_std[full])
        return found

    @property
    def own(self) -> tuple[str, ...]:
        """Dotted names of the parameters, those of effects included, that have another value in
        each recording, which nobody knows: ``error = "own"`` in the file.
        """
        return tuple(self._model.get("own", ()))

    @property
    def blocks(self) -> tuple[str, ...]:
        """The kinds of block that this rig has."""
        return tuple(block for block in BLOCKS if tables_of(self._model, block))

    @property
    def muscle(self) -> Muscle | None:
        """The rig's muscle as a model of its own, or None when the rig has none.

        Raises
        ------
        ParameterError
            If the rig has several: :meth:`muscle_of` takes the name of one.
        """
        names = list(tables_of(self._model, "muscle"))
        if len(names) > 1:
            raise ParameterError(
                f"rig {self.name!r} has the muscles {', '.join(names)}: take one by "
                "Rig.muscle_of(name)"
            )
        return self.muscle_of(names[0]) if names else None

    def muscle_of(self, name: str = "") -> Muscle:
        """One of the rig's muscles as a model of its own.

        Parameters
        ----------
        name : str
            Its name; ``""`` for the muscle without a name.

        Returns
        -------
        Muscle

        Raises
        ------
        ParameterError
            If the rig has no such muscle.
        """
        tables = tables_of(self._model, "muscle")
        if name not in tables:
            there = ", ".join(map(repr, tables)) or "none"
            raise ParameterError(
                f"name = {name!r}: rig {self.name!r} has no such muscle; it has: {there}"
            )
        return Muscle.from_model(tables[name])

    def parameter(self, name: str) -> Parameter:
        """One parameter by its dotted name.

        Parameters
        ----------
        name : str
            For example ``"arm.payload"``, or ``"chamber.flexor.dead_volume"`` of a block with a
            name.

        Returns
        -------
        Parameter

        Raises
        ------
        ParameterError
            If the rig has no such scalar.
        """
        table, key = self._scalar(self._model, name)
        tol = self._tolerances.get(name, 0.0)
        return Parameter(
            name, float(table[key.name]), key.unit, tol, key.lower, key.upper, not math.isinf(tol)
        )

    def _scalars(self) -> Iterator[tuple[str, Key]]:
        for block in BLOCKS:
            for name, table in tables_of(self._model, block).items():
                for key in keys_of(block, table):
                    if key.kind in ("scalar", "count") and key.name in table:
                        yield f"{qualified(block, name)}.{key.name}", key

    def _scalar(self, model: dict[str, Any], dotted: str) -> tuple[dict[str, Any], Key]:
        """Table of ``model``, of this rig's form, that holds a scalar, and the scalar's key."""
        block, name, own = split_name(dotted)
        table = tables_of(model, block).get(name, {}) if block in BLOCKS else {}
        key = next((key for key in BLOCKS.get(block, ()) if key.name == own and own in table), None)
        if key is None or key.kind not in ("scalar", "count"):
            hint = meant(dotted, [scalar for scalar, _ in self._scalars()])
            raise ParameterError(f"rig {self.name!r} has no parameter {dotted!r}; {hint}")
        return table, key

    # ----------------------------------------------------------------- changing

    def with_parameters(self, values: Mapping[str, float]) -> Rig:
        """A rig with other parameter values.

        Parameters
        ----------
        values : mapping of str to float
            Dotted name -> SI value. Tolerances stay; an unknown parameter that gets a value stays
            unknown. With a count that becomes 0 go the parameters that need it, and with one that
            no longer is they come, at their defaults where nothing is given.

        Returns
        -------
        Rig
            A new rig.

        Raises
        ------
        ParameterError
            For an unknown name, or a value outside the bounds of the possible.
        """
        given = checked_table("values", values)
        model = _opened(self._model, {split_name(name)[:2] for name in given})
        problems, numbers, gone = [], {}, set()
        counts = [name for name in given if self._is_count(name)]  # which say what else there is
        for name in [*counts, *(name for name in given if name not in counts)]:
            value = given[name]
            table, key = self._scalar(model, name)
            whole = key.kind == "count"
            try:
                number = checked_number(name, value, key.lower, key.upper, key.unit, whole=whole)
            except ParameterError as error:
                problems.append(str(error))
                continue
            numbers[name] = number
            table[key.name] = int(number) if whole else number
            if whole:
                gone |= _with_its_keys(name, table)
        if problems:
            raise ParameterError(joined(f"rig {self.name!r}", problems))
        known = {name: tol for name, tol in self._tolerances.items() if name not in gone}
        return replace(self, _model=model, _tolerances=known)._with_origin(self, numbers)

    @staticmethod
    def _is_count(dotted: str) -> bool:
        """True where a dotted name is that of a count."""
        block, _, own = split_name(dotted)
        return any(key.kind == "count" for key in BLOCKS.get(block, ()) if key.name == own)

    # A rig that differs from another one by numbers only is not wired again: the core takes the
    # numbers.

    def _with_origin(self, base: Rig, values: Mapping[str, float]) -> Rig:
        """Note the rig that this one differs from by numbers alone, and these numbers."""
        origin, before = base.__dict__.get("_origin", (base, {}))
        object.__setattr__(self, "_origin", (origin, {**before, **values}))
        return self

    def _with_entry(self, entry: Entry, std: dict[str, dict[str, float]]) -> Rig:
        """Copy of the rig with one effect more, given as an entry of its model."""
        before: list[Entry] = self._model["effects"]
        entries = placed(before, entry)
        full = full_name(entry)
        left = {full_name(old) for old in entries} - {full}
        kept = {name: known for name, known in self._effect_std.items() if name in left}
        model = {**self._model, "effects": entries}
        found = replace(self, _model=model, _effect_std={**kept, **std})
        own = {f"{full}.{name}": value for name, value in entry["parameters"].items()}
        if len(entries) > len(before):
            origin, numbers = self._grown_by(entry)
            object.__setattr__(found, "_origin", (origin, {**numbers, **own}))
            return found
        same = [kind_of_entry(old) for old in before] == [kind_of_entry(new) for new in entries]
        return found._with_origin(self, own) if same else found

    def with_case(self, folder: str) -> Rig:
        """Copy of the rig with a note of the case that it was diagnosed from.

        Parameters
        ----------
        folder : str
            The folder of the case, relative to that of the rig file; empty for no note.

        Returns
        -------
        Rig
            A new rig.
        """
        model = {name: value for name, value in self._model.items() if name != "case"}
        model |= {"case": folder} if folder else {}
        return replace(self, _model=model)

    def _grown_by(self, entry: Entry) -> tuple[Rig, dict[str, float]]:
        """Origin of this rig with an effect more, kept for reuse, and the numbers that differ."""
        origin, before = self.__dict__.get("_origin", (self, {}))
        grown: dict[tuple[str, str, str], Rig] = origin.__dict__.get("_grown", {})
        kind = kind_of_entry(entry)
        if kind not in grown:
            same = {**origin._model, "effects": [*origin._model["effects"], entry]}
            grown[kind] = replace(self, _model=same, _effect_std=origin._effect_std)
            object.__setattr__(origin, "_grown", grown)
        return grown[kind], before

    def with_effect(
        self,
        effect: str,
        parameters: Mapping[str, float] | None = None,
        *,
        std: Mapping[str, float] | None = None,
        at: str = "",
        form: str = "",
    ) -> Rig:
        """A rig with one effect more.

        Several of one id can be there, each at a block of its own and with its own parameters. One
        at the same block is replaced; one that acts everywhere replaces all of its id, and is
        replaced by one at a block. The new one takes its place in the order.

        Parameters
        ----------
        effect : str
            Id of the catalogue, for example ``"leak_muscle"``.
        parameters : mapping of str to float, optional
            SI values; what is left out gets the catalogue's default.
        std : mapping of str to float, optional
            Standard deviations, SI; written to the file as a note of how well each is known.
        at : str, optional
            Name of the one block on which it acts, for example of a chamber; by default it acts on
            every block of its kind.
        form : str, optional
            Name of one of its forms; by default the first.

        Returns
        -------
        Rig
            A new rig.

        Raises
        ------
        ParameterError
            For an unknown effect, form, parameter or block, a value outside its bounds, a rig that
            has nothing on which the effect acts, or a second mass that hangs on an arm.
        """
        entry, known = new_entry(self._model, effect, parameters, std, at, form)
        return self._with_entry(entry, {full_name(entry): known} if known else {})

    def without_effect(self, effect: str | None = None, *, at: str | None = None) -> Rig:
        """A rig without one effect; one that is nowhere is no error while no block is named.

        Parameters
        ----------
        effect : str, optional
            Its id; None removes all.
        at : str, optional
            Only the one at the block of this name, ``""`` for the one that acts everywhere; by
            default wherever it acts.

        Returns
        -------
        Rig

        Raises
        ------
        ParameterError
            If the effect does not act at the block that is named.
        """
        entries = without(self._model["effects"], effect, at)
        if len(entries) == len(self._model["effects"]):
            return self
        left = {full_name(entry) for entry in entries}
        gone = {full_name(entry) for entry in self._model["effects"]} - left
        model = {**self._model, "effects": entries}
        if self.own:
            model["own"] = [n for n in self.own if n.rpartition(".")[0] not in gone]
        kept = {name: std for name, std in self._effect_std.items() if name in left}
        return replace(self, _model=model, _effect_std=kept)

    # ------------------------------------------------------------------ writing

    def to_json(self) -> str:
        """The model as JSON text, as the core takes it: every block in a list, every port in full
        (SI, radians, gauge pressures).

        Returns
        -------
        str

        Raises
        ------
        RigError
            As :meth:`ports`.
        """
        return core_json(self._model, self._connected)

    def to_toml_text(self, *, comments: bool = True) -> str:
        """The rig as TOML; reading it gives the same numbers to the last bit, the same names and
        the same ports.

        Parameters
        ----------
        comments : bool
            A rig that was read keeps the comments, the order and the units of its file; what
            differs from the file is written anew. False: all in SI units and in one order, so that
            equal rigs have equal texts.

        Returns
        -------
        str
        """
        content = Content(self.name, self._model, self._tolerances, self._effect_std, self.units)
        if not comments or not self._text:
            return toml_text(content)
        from pamrs.rig._edited import edited_text

        return edited_text(self._text, content)

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
        try:
            return write_atomically(path, self.to_toml_text())
        except OSError as error:
            raise RigError(f"{path}: cannot be written ({error.strerror or error})") from error


def _with_its_keys(dotted: str, table: dict[str, Any]) -> set[str]:
    """Add the keys that a count needs, at their defaults, or remove them; return the removed."""
    block, name, count = split_name(dotted)
    has, gone = keys_of(block, table), set()
    for key in (key for key in BLOCKS[block] if key.needs == count):
        if key in has:
            table.setdefault(key.name, key.default)
        elif table.pop(key.name, None) is not None:
            gone.add(f"{qualified(block, name)}.{key.name}")
    return gone


def _opened(model: dict[str, Any], tables: set[tuple[str, str]]) -> dict[str, Any]:
    """Model with copies of some of its tables, by block and name; the others are shared."""
    opened = dict(model)
    for block, name in tables:
        content: Any = opened.get(block)
        if not isinstance(content, dict):
            continue
        if content is model.get(block):
            opened[block] = content = copy.copy(content)
        if name in content:
            content[name] = dict(content[name])
    return opened


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
        If the file cannot be read, or with every problem found in it: unknown keys, missing or
        wrong units, values that are not finite or not possible, blocks that do not fit together.
    """
    file = Path(path)
    if file.is_dir():
        file = file / "rig.toml"
    try:
        text = read_toml(file)
    except OSError as error:
        raise RigError(f"{file}: cannot be read ({error.strerror or error})") from error
    except UnicodeDecodeError as error:
        raise RigError(f"{file}: not a text file in UTF-8") from error
    return parse_rig(text, source=str(file))


def parse_rig(text: str, *, source: str = "rig") -> Rig:
    """Read a rig from TOML text; ``source`` names it in messages. See :func:`load_rig`."""
    content = read_model(text, source)
    known = content.tolerances, content.effect_std
    return Rig(content.name, content.model, *known, source, text, content.units)


def check_sample_time(rig: Rig, sample_time: Any, *, inside: int = 1) -> float:
    """A sample time of recordings or runs of a rig [s].

    Parameters
    ----------
    rig : Rig
        The rig.
    sample_time : object
        What was given.
    inside : int, optional
        How many functions inside the one that a user calls asks.

    Returns
    -------
    float

    Raises
    ------
    ParameterError
        If it is not a finite number above zero, a day at most.

    Warns
    -----
    UnitWarning
        If it is a second or longer, which nothing follows that a valve or a muscle moves.
    """
    seconds = positive("sample_time", plain("sample_time", sample_time, "s"))
    if seconds > _DAY:
        raise refused("sample_time", sample_time, f"at most a day is, {_DAY:g} s")
    if seconds >= 1.0 and any(map(rig.tables, ("valve", "joint", "load"))):
        said = f"sample_time = {seconds:g} s: are milliseconds meant? Seconds are wanted, "
        doubt(f"{said}{seconds:g} ms is {1e-3 * seconds:g}", inside=inside + 1)
    return seconds


def payload_of(rig: Rig) -> str:
    """Dotted name of the mass that a rig lifts: the payload of the arm, or of its last link, or the
    mass that hangs.
    """
    if rig.tables("load"):
        return "load.mass"
    links = list(rig.ports("link"))
    return f"{qualified('link', links[-1])}.payload" if links else "arm.payload"
