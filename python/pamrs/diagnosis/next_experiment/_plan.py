"""A plan: what some channels can tell of a rig, as data and as a page for a terminal."""

from __future__ import annotations

import textwrap
from dataclasses import dataclass, field
from typing import Any

from pamrs.effects import CATALOGUE, Term
from pamrs.errors import ParameterError
from pamrs.findings import Limit, to_plain
from pamrs.report.sentences import limit_sizes
from pamrs.rig import Units


@dataclass(frozen=True)
class Addition:
    """Gain of one more channel or experiment.

    Attributes
    ----------
    kind, name, text : str
        ``channel`` or ``experiment``, which one, and in words.
    seen : tuple of str
        Effects that are seen only with it.
    separated : tuple of (str, str)
        Pairs that are told apart only with it.
    bits : float
        Gain of half the logarithm of the determinant of the effects' information at their typical
        sizes [bit].
    """

    kind: str
    name: str
    text: str
    seen: tuple[str, ...]
    separated: tuple[tuple[str, str], ...]
    bits: float


@dataclass(frozen=True, repr=False)
class Plan:
    """Limits, blocks and pairs of effects that some channels and experiments show of a rig.

    Attributes
    ----------
    rig : str
        Its name.
    channels : tuple of str
        Measured ones.
    noise : dict of str to float
        Sample noise of each [SI].
    blocks : list of dict
        ``name``, ``channel``, ``drives``, ``covers``, ``why`` its parts are lumped.
    missing : list of dict
        Blocks that would be there with more channels: ``name``, ``covers``, ``needs``.
    experiments : list of dict
        ``name``, ``text``, ``duration`` [s] of those assumed.
    limits : list of Limit
        One for each effect that the rig can have, in the order of the catalogue; one for each place
        of an effect that may act at one of several blocks.
    pairs : list of (str, str, float)
        Effects seen at their typical sizes that are not told apart there, with the cosine of their
        signatures.
    groups : list of tuple of str
        The same, joined.
    additions : list of Addition
        What would add most, first.
    units : Units
        Units of the rig file, which sizes are given in.
    """

    rig: str
    channels: tuple[str, ...]
    noise: dict[str, float]
    blocks: list[dict[str, Any]]
    missing: list[dict[str, Any]]
    experiments: list[dict[str, Any]]
    limits: list[Limit]
    pairs: list[tuple[str, str, float]]
    groups: list[tuple[str, ...]]
    additions: list[Addition] = field(default_factory=list)
    units: Units = field(default_factory=Units)

    @property
    def seen(self) -> tuple[str, ...]:
        """Effects that would be seen at their typical size."""
        return tuple(own.effect for own in self.limits if own.verdict != "not seen")

    def limit(self, effect: str) -> Limit:
        """Limits of one effect: the sizes from which it would be seen, and told from its nearest
        rival.

        Parameters
        ----------
        effect : str
            Its id, with a place where the plan has it at several.

        Returns
        -------
        Limit
            Sizes in SI, and its signature at the typical one.

        Raises
        ------
        ParameterError
            If the plan does not have it.
        """
        found = next((own for own in self.limits if own.effect == effect), None)
        if found is None:
            raise ParameterError(
                f"effect = {effect!r} is not allowed: one of "
                f"{', '.join(own.effect for own in self.limits)}"
            )
        return found

    def separable(self, first: str, second: str) -> bool:
        """True where two effects are both seen and would be told apart.

        Parameters
        ----------
        first, second : str
            Their ids, with places where the plan has them; one id with two places asks whether the
            places can be told apart.
        """
        both = {self.limit(first).effect, self.limit(second).effect}
        return both <= set(self.seen) and not any({a, b} == both for a, b, _ in self.pairs)

    @property
    def not_asked(self) -> tuple[str, ...]:
        """Effects of the catalogue that have no place in this rig, or none that these channels
        surround.
        """
        return tuple(
            e for e in CATALOGUE if e not in {Term.parse(own.effect).id for own in self.limits}
        )

    def to_dict(self) -> dict[str, Any]:
        """The plan as plain values, null for no number."""
        return {
            "schema": "pamrs.plan/1",
            "rig": self.rig,
            "channels": list(self.channels),
            "noise": dict(self.noise),
            "blocks": self.blocks,
            "missing": self.missing,
            "experiments": self.experiments,
            "effects": [
                {"id": term.id, "at": term.at or None, "verdict": own.verdict, **to_plain(own)}
                for own in self.limits
                for term in [Term.parse(own.effect)]
            ],
            "not_asked": list(self.not_asked),
            "pairs": [{"effects": [a, b], "cosine": round(c, 4)} for a, b, c in self.pairs],
            "groups": [list(group) for group in self.groups],
            "additions": [
                {
                    **vars(a),
                    "seen": list(a.seen),
                    "separated": [list(pair) for pair in a.separated],
                    "bits": round(a.bits, 3),
                }
                for a in self.additions
            ],
        }

    def text(self) -> str:
        """The plan as a page for a terminal."""
        lines = [
            f"Plan of a diagnosis of {self.rig}, with {', '.join(self.channels) or 'no channel'}",
            "",
        ]
        lines += ["Blocks that these channels tell apart"]
        wide = max([8, *(len(block["name"]) for block in self.blocks)])
        for block in self.blocks:
            lines.append(
                f"  {block['name']:<{wide}} {', '.join(block['drives']) or '(its start)'} -> "
                f"{block['channel']}"
            )
            lines += _wrapped(
                f"lumps {block['covers']}: {block['why']}" if block["why"] else block["covers"],
                wide + 3,
            )
        lines += [] if self.blocks else ["  none"]
        for block in self.missing:
            needs = ", ".join(block["needs"])
            lines += _wrapped(
                (
                    f"not {block['name']} ({block['covers']}): without {needs} nothing drives or "
                    "shows it"
                ),
                2,
            )
        if self.experiments:
            lines += ["", "Experiments assumed"]
            for experiment in self.experiments:
                lines += _wrapped(
                    f"{experiment['name']}: {experiment['text']} ({experiment['duration']:.0f} s)",
                    2,
                )
        return "\n".join(
            [
                *lines,
                *(self._effects() if self.blocks else ["", "No effect can be seen"]),
                *self._gains(),
            ]
        )

    def _effects(self) -> list[str]:
        """The table of the effects, and what is not told apart."""
        lines = [
            "",
            (
                "Sizes from which effects would be seen, and from which they would be named, after "
                "parameters inside their tolerances and the error of the model took what they can"
            ),
        ]
        head = (
            "effect",
            "",
            "in",
            "recording",
            "at size",
            "seen from",
            "named from",
            "easily confused with",
        )
        rows: list[tuple[str, ...]] = [head]
        for own in self.limits:
            nearest = own.rival if own.block else "(nothing here shows it)"
            where = own.block or "-", own.recording or "-"
            rows.append((own.effect, own.verdict, *where, *limit_sizes(own, self.units), nearest))
        wide = [max(len(row[k]) for row in rows) + 2 for k in range(len(head))]
        lines += [
            "  " + "".join(f"{cell:<{w}}" for cell, w in zip(row, wide, strict=True)).rstrip()
            for row in rows
        ]
        return [
            *lines,
            *(
                ["", f"Not tested with this rig and these channels: {', '.join(self.not_asked)}"]
                if self.not_asked
                else []
            ),
            "",
            "Not told apart: "
            + (
                "; ".join(", ".join(g) for g in self.groups)
                if self.groups
                else "none of those seen"
            ),
        ]

    def _gains(self) -> list[str]:
        """Lines on the channels and experiments that would add most."""
        lines = []
        if self.additions:
            lines += ["", "What would add most"]
            for addition in self.additions:
                gains = [f"shows {', '.join(addition.seen)}"] if addition.seen else []
                gains += (
                    [f"tells {', '.join(f'{a} from {b}' for a, b in addition.separated)}"]
                    if addition.separated
                    else []
                )
                gains += [] if gains else ["sharper, nothing new"]
                lines += _wrapped(
                    (
                        f"{addition.kind} {addition.name}: {'; '.join(gains)} "
                        f"({round(addition.bits):+d} bit)"
                    ),
                    2,
                )
        return lines

    def __repr__(self) -> str:
        return (
            f"Plan({self.rig}: {len(self.blocks)} blocks, {len(self.seen)} of {len(self.limits)} "
            f"effects seen, {len(self.groups)} groups not told apart)"
        )


def _wrapped(text: str, indent: int) -> list[str]:
    return textwrap.wrap(
        text, 130, initial_indent=" " * indent, subsequent_indent=" " * (indent + 2)
    )
