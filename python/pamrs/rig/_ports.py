"""Connections between the blocks of a rig: its ports, their defaults, and those that are
impossible.

A port is a key that names another block (:data:`pamrs.rig.schema.PORTS`). What a file leaves out
follows from the names: a valve feeds the chamber of its own name, a muscle pulls on the only joint.
What the names do not settle is a problem, never a guess.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Mapping
from typing import Any, Final

from pamrs.rig.schema import BLOCKS, PORTS, Port, kind_of, qualified, tables_of

Ports = dict[str, dict[str, dict[str, str]]]
"""Kind of block -> name -> port -> the block at its other end in full, ``""`` for the inlet of a
line that valves feed."""

_PLURAL: Final = {"supply": "supplies"}
_NEEDS: Final = (("joint", "muscle"), ("joint", "arm"), ("arm", "joint"), ("load", "muscle"))


def connect(model: Mapping[str, Any]) -> tuple[Ports, list[str]]:
    """Connect every port of a model, as given or by default.

    Parameters
    ----------
    model : mapping
        As :attr:`pamrs.Rig.model`; ``model["ports"]`` has what the file gives. Values may be None
        where they are not known.

    Returns
    -------
    ports : dict
        Links base first.
    problems : list of str
        Everything that is not connected or cannot be, one sentence each. With any, ``ports`` is not
        complete.
    """
    connector = _Connector(model)
    connector.whole_blocks()
    connector.inlets()
    connector.valves()
    connector.lines()
    connector.muscles()
    connector.arm()
    problems = connector.problems
    problems += [
        text
        for entry in model.get("effects", ())
        if (text := effect_problem(model, entry["id"], entry.get("at", "")))
    ]
    problems += [text] if (text := hanging_problem(model.get("effects", ()))) else []
    return connector.ports, problems


def bare(block: str, text: str) -> str:
    """Name of a block without its kind, ``""`` for one that has no name."""
    return "" if text == block else text.removeprefix(f"{block}.")


def effect_problem(model: Mapping[str, Any], effect: str, place: str) -> str:
    """Problem of the block on which an effect acts, ``""`` where there is none."""
    from pamrs.effects import EFFECTS

    info = EFFECTS[effect]
    if place and not info.at:
        return f"{effect}: at = {place!r} is not allowed: it acts on the whole rig"
    names = [name for name in tables_of(model, info.at) if name] if info.at else []
    if place and place not in names:
        return f"{effect}: at = {place!r} names no {info.at}{near_name(place, names)}"
    usual = info.at or ("joint" if info.block == "arm" else "")
    needs = info.needs or (((usual, ""),) if usual else ())
    there = {
        qualified(block, name): (block, kind_of(block, table))
        for block in dict.fromkeys(block for block, _ in needs)
        for name, table in tables_of(model, block).items()
        if not place or name == place
    }
    if not needs or any(found in needs or (found[0], "") in needs for found in there.values()):
        return ""
    what = " or ".join(f"a {b}" + (f" of the kind {kind}" if kind else "") for b, kind in needs)
    has = ", ".join(f"{name} is a {kind}" for name, (_, kind) in there.items())
    return f"{effect}: it acts on {what}, and {has or 'the rig has none'}"


def hanging_problem(entries: Iterable[Mapping[str, Any]]) -> str:
    """Problem of an arm on which several masses hang, ``""`` where there is none."""
    from pamrs.effects import ports_of

    hung = [
        f"{entry['id']} at {qualified('joint', entry['at']) if 'at' in entry else 'the last joint'}"
        for entry in entries
        if "hanging" in ports_of(entry)
    ]
    text = f"only one mass of an arm can hang, and {' and '.join(hung)} make {len(hung)}"
    return text if len(hung) > 1 else ""


def wiring(model: Mapping[str, Any], ports: Ports) -> list[str]:
    """One line for each way that the air takes, each way that the force takes and each muscle that
    can push, to be read by a person.
    """
    lines, used = [], set()
    fronts = {qualified("supply", n): e["inlet"] for n, e in ports["supply"].items() if e}
    inner = {qualified("line", name): ends for name, ends in ports["line"].items()}
    for name, ends in ports["valve"].items():
        way = [ends["from"], qualified("valve", name), ends["to"]]
        if ends["to"] in inner:
            way.append(inner[ends["to"]]["to"])
        # a valve also vents what it fills
        lines.append(way if way[-1] == "ambient" else [*way, "ambient"])
    lines += [[ends["from"], name, ends["to"]] for name, ends in inner.items() if ends["from"]]
    lines = [[fronts[way[0]], *way] if way[0] in fronts else way for way in lines]
    for way in lines:
        used.update(way)
    stores = [
        qualified(kind, name) for kind in ("supply", "chamber") for name in tables_of(model, kind)
    ]
    carried = {ends["joint"]: qualified("link", name) for name, ends in ports["link"].items()}
    pulls = []
    for name, ends in ports["muscle"].items():
        own = [qualified("transmission", name)] if name in tables_of(model, "transmission") else []
        moved = [] if ends["joint"] == "load" else [carried.get(ends["joint"], "arm")]
        pulls.append([ends["chamber"], qualified("muscle", name), *own, ends["joint"], *moved])
    chain = [
        part
        for name, ends in ports["link"].items()
        for part in (ends["joint"], qualified("link", name))
    ]
    return [
        *(f"air: {' -> '.join(way)}" for way in lines),
        *(f"air: {name}, shut off" for name in stores if name not in used),
        *(f"pull: {' -> '.join(way)}" for way in pulls),
        *(
            f"push: {qualified('muscle', name)}, each by up to {table['buckling_load']:.4g} N"
            for name, table in tables_of(model, "muscle").items()
            if table["buckling_load"] > 0.0
        ),
        *([f"arm: {' -> '.join(['base', *chain])}"] if chain else []),
    ]


def near_name(given: str, names: Iterable[str], short: Iterable[str] = ()) -> str:
    """Hint on an unknown name: the nearest allowed one, else the allowed ones; ``short`` are other
    ways to say the same names.
    """
    allowed = list(names)
    near = difflib.get_close_matches(given, [*allowed, *short], n=1)
    if near:
        return f"; did you mean {near[0]!r}?"
    return f"; there are: {', '.join(allowed)}" if allowed else "; there is none with a name"


class _Connector:
    """Settles port by port, and notes every problem instead of stopping at the first."""

    def __init__(self, model: Mapping[str, Any]) -> None:
        self.tables = {block: tables_of(model, block) for block in BLOCKS}
        self.given: Mapping[str, Mapping[str, str]] = model.get("ports", {})
        self.ports: Ports = {block: {name: {} for name in self.tables[block]} for block in PORTS}
        self.problems: list[str] = []

    # --------------------------------------------------------------------- one port

    def settle(
        self, block: str, name: str, port: str, defaults: Iterable[str], wanted: Iterable[str] = ()
    ) -> str | None:
        """Other end of a port: the given one, else the first default; None after a problem."""
        label = qualified(block, name)
        info = next(entry for entry in PORTS[block] if entry.name == port)
        text = self.given.get(label, {}).get(port)
        if text is not None:
            end = self.find(f"{label}.{port}", info, text)
        elif (end := next(filter(None, defaults), None)) is None:
            kinds = [*info.kinds, *(word for word in info.words if word in BLOCKS)]
            self.missing(label, port, list(wanted) or kinds)
        if end is not None:
            self.ports[block][name][port] = end
        return end

    def find(self, label: str, port: Port, text: str) -> str | None:
        """The block that a port names, in full."""
        words = [word for word in port.words if word not in BLOCKS or self.tables[word]]
        allowed = [*self.all_of(port.kinds), *words]
        if text in allowed:
            return text
        short = [qualified(kind, text) for kind in port.kinds if text and text in self.tables[kind]]
        if len(short) == 1:
            return short[0]
        if short:
            self.problems.append(f"{label} = {text!r} is not clear: {' or '.join(short)}")
        elif text in ("ambient", "base", *self.all_of(BLOCKS)):
            self.problems.append(f"{label} = {text!r} is not allowed: one of {', '.join(allowed)}")
        else:
            short = [name for kind in port.kinds for name in self.tables[kind] if name]
            what = " and no ".join([*port.kinds, *port.words])
            self.problems.append(
                f"{label} = {text!r} names no {what}{near_name(text, allowed, short)}"
            )
        return None

    def missing(self, label: str, port: str, kinds: list[str]) -> None:
        """Note a port that no default settles."""
        named = {kind: ", ".join(name or kind for name in self.tables[kind]) for kind in kinds}
        there = [f"the {_PLURAL.get(k, k + 's')} {names}" for k, names in named.items() if names]
        if there:
            unfed = label.partition(".")[0] == "line" and port == "from" and self.tables["valve"]
            other = ", or lead a valve to it" if unfed else ""
            self.problems.append(
                f"{label}.{port} is missing: the rig has {' and '.join(there)}; say which{other}"
            )
        else:
            needed = " or ".join(f"[{kind}]" for kind in kinds)
            self.problems.append(f"the block [{label}] needs the block {needed}, which is missing")

    def all_of(self, kinds: Iterable[str]) -> list[str]:
        """Blocks of some kinds in full."""
        return [qualified(kind, name) for kind in kinds for name in self.tables[kind]]

    def same(self, kind: str, name: str) -> str:
        """The block of a kind that has a name, ``""`` if there is none."""
        return qualified(kind, name) if name in self.tables[kind] else ""

    def only(self, kind: str, among: Iterable[str] | None = None, *, of: str = "") -> str:
        """Only block of a kind, ``""`` for none, several, or the partner of another than `of`."""
        names = list(self.tables[kind] if among is None else among)
        partners = {*self.tables["valve"], *self.tables["muscle"]}
        if len(names) != 1 or (of and names[0] and names[0] != of and names[0] in partners):
            return ""
        return qualified(kind, names[0])

    # ------------------------------------------------------------------------- air

    def inlets(self) -> None:
        """Settle the inlets of regulators: a tank or a constant supply feeds each."""
        for name, table in self.tables["supply"].items():
            label = qualified("supply", name)
            if "inlet" not in self.given.get(label, {}):
                continue
            if (kind := kind_of("supply", table)) != "regulator":
                self.problems.append(
                    f"{label}.inlet is not allowed with {kind!r}: only with regulator"
                )
                continue
            front = self.settle("supply", name, "inlet", ())
            if front is None:
                continue
            other = self.tables["supply"][bare("supply", front)]
            if front == label:
                self.problems.append(
                    f"{label}.inlet = {front!r} is not allowed: it is the regulator itself; "
                    "another supply is needed"
                )
            elif kind_of("supply", other) == "regulator":
                self.problems.append(
                    f"{label}.inlet = {front!r} is not allowed: it is a regulator; a tank or a "
                    "constant supply is needed"
                )

    def source(self) -> str:
        """The only supply in front of no regulator, ``""`` if there are more."""
        fronts = [ends.get("inlet") for ends in self.ports["supply"].values()]
        names = [n for n in self.tables["supply"] if qualified("supply", n) not in fronts]
        return self.only("supply", names)

    def valves(self) -> None:
        """Both ends of every valve."""
        own = {
            name: self.given.get(qualified("line", name), {}).get("from")
            for name in self.tables["line"]
        }
        inlets = [name for name, start in own.items() if start is None]
        for name in self.tables["valve"]:
            start = self.settle(
                "valve", name, "from", (self.same("supply", name), self.source()), ("supply",)
            )
            line = qualified("line", name) if name in inlets else ""
            defaults = (
                line,
                self.same("chamber", name),
                self.only("line", inlets, of=name),
                self.only("chamber", of=name),
            )
            end = self.settle("valve", name, "to", defaults)
            self.two_ends("valve", name, start, end)
            fed = next((line for line in own if qualified("line", line) == end), None)
            if fed is not None and own[fed] is not None:
                self.problems.append(
                    f"{qualified('valve', name)}.to = {end!r} is not allowed: {end}.from = "
                    f"{own[fed]!r}, so that no valve feeds it"
                )

    def lines(self) -> None:
        """Both ends of every line."""
        ends = [ports.get("to") for ports in self.ports["valve"].values()]
        for name, table in self.tables["line"].items():
            label = qualified("line", name)
            end = self.settle(
                "line", name, "to", (self.same("chamber", name), self.only("chamber", of=name))
            )
            if "from" not in self.given.get(label, {}):
                if label in ends:
                    self.ports["line"][name]["from"] = ""
                    # its pressure would have no rate
                    if kind_of("line", table) == "orifice" and table.get("inlet_volume") == 0.0:
                        self.problems.append(
                            f"{label}.inlet_volume = 0 is not allowed: more is needed between "
                            "an orifice and the valves that feed it"
                        )
                    continue
                if None in ends and not self.same("supply", name):
                    continue  # the valve of which it is not known where it leads may feed this line
            alone = "" if self.tables["valve"] else self.source()
            start = self.settle("line", name, "from", (self.same("supply", name), alone))
            self.two_ends("line", name, start, end)
            if start is not None and table.get("inlet_volume"):
                self.problems.append(
                    f"{label}.inlet_volume is not allowed: {label} begins at {start}, and only an "
                    "inlet that valves feed has a volume of its own"
                )
            if start is not None and table.get("pressure_zero"):
                self.problems.append(
                    f"{label}.pressure_zero is not allowed: {label} begins at {start}, and only an "
                    "inlet that valves feed has a gauge"
                )

    def two_ends(self, block: str, name: str, start: str | None, end: str | None) -> None:
        """Note a valve or line that leads back to where it begins."""
        if start is not None and start == end:
            self.problems.append(
                f"{qualified(block, name)}: from and to are both {start}; two different ends are "
                "needed"
            )

    # ----------------------------------------------------------------------- force

    def muscles(self) -> None:
        """Chamber and joint of every muscle, and how it pulls on the joint."""
        transmissions, load = self.tables["transmission"], "load" if self.tables["load"] else ""
        for name in self.tables["muscle"]:
            label = qualified("muscle", name)
            chambers = self.same("chamber", name), self.only("chamber", of=name)
            self.settle("muscle", name, "chamber", chambers)
            if self.tables["arm"] and not self.tables["joint"]:
                continue  # the joint that is missing has been noted
            joint = self.settle(
                "muscle", name, "joint", (self.same("joint", name), self.only("joint"), load)
            )
            own = qualified("transmission", name)
            if joint == "load" and name in transmissions:
                self.problems.append(
                    f"the block [{own}] is not allowed: {label} pulls on the load, straight"
                )
            free = [
                qualified("joint", j)
                for j, table in self.tables["joint"].items()
                if kind_of("joint", table) == "free"
            ]
            if joint in free and name not in transmissions:
                self.problems.append(
                    f"{label} pulls on {joint}, which is free: the block [{own}] is missing"
                )
        for name in transmissions:
            if name not in self.tables["muscle"]:
                whose = "without a name, as no muscle is: name it as its muscle"
                if name:
                    hint = near_name(name, filter(None, self.tables["muscle"]))
                    whose = f"named after no muscle{hint}"
                self.problems.append(f"the block [{qualified('transmission', name)}] is {whose}")

    # ------------------------------------------------------------------------- arm

    def whole_blocks(self) -> None:
        """Note blocks that need each other or exclude each other."""
        for block, needs in _NEEDS:
            if self.tables[block] and not self.tables[needs]:
                self.problems.append(
                    f"the block [{block}] needs the block [{needs}], which is missing"
                )
        if self.tables["load"] and (self.tables["joint"] or self.tables["arm"]):
            self.problems.append(
                "the block [load] does not go with [joint] and [arm]: a rig has one or the others"
            )

    def arm(self) -> None:
        """Note what does not fit between arm, joints and links; put the links in order."""
        links, joints = self.tables["link"], self.tables["joint"]
        kind = kind_of("arm", self.tables["arm"][""]) if self.tables["arm"] else None
        if links and not self.tables["arm"]:
            self.problems.append(
                "the block [link] needs the block [arm] with kind = 'planar', which is missing"
            )
        if kind == "one_link":
            if links:
                names = ", ".join(self.all_of(["link"]))
                self.problems.append(
                    f"arm.kind = 'one_link' is not allowed with {names}: 'planar' is needed for "
                    "links"
                )
            if len(joints) > 1:
                self.problems.append(
                    f"arm.kind = 'one_link' is not allowed with the joints {', '.join(joints)}: "
                    "one joint, or 'planar' with a link each"
                )
        elif kind == "planar" and not links:
            self.problems.append(
                "arm.kind = 'planar' needs a block [link] for each joint, and there is none"
            )
        elif kind == "planar":
            self.joints_of_links()
            self.chain()

    def joints_of_links(self) -> None:
        """Give every link its joint, and note joints that have none or several."""
        moved: dict[str, str] = {}
        for name in self.tables["link"]:
            label = qualified("link", name)
            joint = self.settle("link", name, "joint", (self.same("joint", name),))
            if joint in moved:
                self.problems.append(
                    f"{label}.joint = {joint!r} is not allowed: {joint} moves {moved[joint]} "
                    "already"
                )
            elif joint is not None:
                moved[joint] = label
        if all("joint" in ports for ports in self.ports["link"].values()):
            alone = [joint for joint in self.all_of(["joint"]) if joint not in moved]
            self.problems += [
                f"{joint} moves no link: a [link] with joint = {joint!r} is needed"
                for joint in alone
            ]

    def chain(self) -> None:
        """Put the links base first, and note those mounted on the same one or in a circle."""
        before = "base"
        carries: dict[str, str] = {}
        for name in self.tables["link"]:
            label = qualified("link", name)
            on = self.settle("link", name, "on", (before,))
            before = label
            if on in carries:
                self.problems.append(
                    f"{label}.on = {on!r} is not allowed: {on} carries "
                    f"{qualified('link', carries[on])} already"
                )
            elif on is not None:
                carries[on] = name
        if len(carries) < len(self.tables["link"]):
            return
        ordered, place = [], "base"
        while place in carries:
            ordered.append(carries[place])
            place = qualified("link", carries[place])
        around = [qualified("link", name) for name in self.tables["link"] if name not in ordered]
        if around:
            self.problems.append(
                f"{', '.join(around)}: each is on another of them, in a circle; one link of an arm "
                "is on the base"
            )
        else:
            self.ports["link"] = {name: self.ports["link"][name] for name in ordered}
