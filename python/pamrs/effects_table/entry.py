"""What the catalogue knows of an effect and of its parameters."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["EffectInfo", "EffectParameter", "SameData"]


@dataclass(frozen=True, slots=True)
class EffectParameter:
    """One parameter of an effect, in SI units.

    Attributes
    ----------
    name, unit : str
        Name and SI unit.
    default : float
        A typical value.
    lower, upper : float
        Bounds of the possible.
    starts : tuple of float
        Values from which a fit starts, small to large.
    meaning : str
        What it is.
    neutral : float or None
        Value that switches the effect off (with the other parameters that have one at theirs); None for a parameter that gives
        the effect its shape.
    expected : (low, high) or None
        Where it usually lies; a diagnosis believes an effect less the further outside it needs the parameter.
    """

    name: str
    unit: str
    default: float
    lower: float
    upper: float
    starts: tuple[float, ...]
    meaning: str
    neutral: float | None = None
    expected: tuple[float, float] | None = None


@dataclass(frozen=True, slots=True)
class SameData:
    """When an effect leaves the very recordings that another one leaves, so that nothing in them can tell the two apart.

    Attributes
    ----------
    effect, parameter : str
        The other effect, and its parameter that is then as large as ``size``.
    size : str
        The own parameter that is the effect's size; the two are the same where it is positive.
    without : str
        The own parameter that would tell the two apart, if it were not zero.
    held : tuple of (str, float)
        Own parameters with the values at which the two are the same.
    told_by : str
        What tells the two apart, since no recording of the same channels does.
    """

    effect: str
    parameter: str
    size: str
    without: str
    held: tuple[tuple[str, float], ...]
    told_by: str


@dataclass(frozen=True, slots=True)
class EffectInfo:
    """One effect of the catalogue.

    Attributes
    ----------
    id, name, block : str
        Public identifier, words, and the block in which it acts.
    at : str
        Kind of the blocks of which it can take one by its name, ``""`` for an effect on the whole rig.
    equation, fingerprint, separates : str
        Governing equation; what it looks like in recordings; what it is confused with and what separates them.
    parameters : tuple of EffectParameter
        Its parameters.
    reference : str
        Where it comes from.
    rivals : tuple of str
        What looks like it in recordings: ids of the catalogue first, then other causes in words. Of two effects each names the other.
    catalogue : bool
        Whether it is a name for physics, which a diagnosis may give; a closure is none.
    same_data : SameData or None
        Another effect whose recordings it leaves where a parameter is zero.
    """

    id: str
    name: str
    block: str
    at: str
    equation: str
    fingerprint: str
    separates: str
    parameters: tuple[EffectParameter, ...]
    reference: str
    rivals: tuple[str, ...] = ()
    catalogue: bool = True
    same_data: SameData | None = None

    @property
    def everywhere(self) -> str:
        """Where it acts when no block is named, in words."""
        if not self.at:
            return "the whole rig"
        return "the last joint" if self.id.startswith("payload_") else f"every {self.at}"

    def dotted(self) -> tuple[str, ...]:
        """Dotted names of the parameters, ``leak_muscle.conductance``."""
        return tuple(f"{self.id}.{parameter.name}" for parameter in self.parameters)

    def neutral(self) -> dict[str, float]:
        """The parameters at which it does nothing; empty for an effect that replaces an equation and has none."""
        return {parameter.name: parameter.neutral for parameter in self.parameters if parameter.neutral is not None}
