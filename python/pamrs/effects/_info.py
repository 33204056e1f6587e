"""What the catalogue knows of an effect and of its parameters."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["EffectInfo", "EffectParameter", "Form", "SameData", "Term"]


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
        Value that switches the effect off (with the other parameters that have one at theirs);
        None for a parameter that gives the effect its shape.
    expected : (low, high) or None
        Where it usually lies; an effect is less probable the further outside it needs the parameter.
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
    """When an effect leaves the very recordings that another one leaves: nothing in them can tell the two apart.

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
class Term:
    """One term of a sum that stands where no name does.

    Attributes
    ----------
    name : str
        Name of its coefficient.
    formula : str
        What the coefficient multiplies, in the symbols of the sum's equation.
    variables : tuple of str
        What it is a function of, in words.
    kind : str
        ``static`` (of where things are), ``odd`` or ``even`` (in the rate of the joint or in the
        opening of the valve, without memory), ``time`` (with a memory that fades in time) or
        ``distance`` (with one that fades over a way).
    """

    name: str
    formula: str
    variables: tuple[str, ...]
    kind: str


@dataclass(frozen=True, slots=True)
class Form:
    """One form of an effect.

    Attributes
    ----------
    name : str
        Its name.
    parameters : tuple of EffectParameter
        Its parameters.
    states : tuple of str
        Names of its states at each block; an only one may have none.
    ports : tuple of str
        Where it acts in the equations of the rig.
    """

    name: str
    parameters: tuple[EffectParameter, ...]
    states: tuple[str, ...] = ()
    ports: tuple[str, ...] = ()


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
        Governing equation; what it looks like in recordings; what it is confused with and what
        separates them.
    forms : tuple of Form
        Its forms; the first one is meant where none is named.
    reference : str
        Where it comes from.
    rivals : tuple of str
        What looks like it in recordings: ids of the catalogue first, then other causes in words. Of
        two effects each names the other.
    catalogue : bool
        Whether it is a name for physics, which a diagnosis may give; a sum of terms is none.
    same_data : SameData or None
        Another effect whose recordings it leaves where a parameter is zero.
    terms : tuple of Term
        Of a sum of terms, in the order of its parameters; behind them stand the shapes of its memories.
    last_only : bool
        Whether it acts on the last block of its kind where none is named, and not on every one.
    on_loads : bool
        Whether it acts on a linear load too.
    supplies : tuple of str
        Kinds of supply that it acts on; empty for all.
    dry_friction : bool
        Whether a motion that does not turn round does not feel it as damping.
    kink : (names, why, of_supplies) or None
        Why it has no linear model: it is there where any of these parameters is not zero, maybe only
        while the pressure of a supply moves.
    at_rest : tuple of (str, str, float)
        How it is changed for a linear model about a state of rest: ``("set", parameter, value)``, or
        ``("out_below", parameter, value)`` where it is left out below a value.
    """

    id: str
    name: str
    block: str
    at: str
    equation: str
    fingerprint: str
    separates: str
    forms: tuple[Form, ...]
    reference: str
    rivals: tuple[str, ...] = ()
    catalogue: bool = True
    same_data: SameData | None = None
    terms: tuple[Term, ...] = ()
    last_only: bool = False
    on_loads: bool = False
    supplies: tuple[str, ...] = ()
    dry_friction: bool = False
    kink: tuple[tuple[str, ...], str, bool] | None = None
    at_rest: tuple[tuple[str, str, float], ...] = ()

    @property
    def parameters(self) -> tuple[EffectParameter, ...]:
        """The parameters of the first form."""
        return self.forms[0].parameters

    def form(self, name: str = "") -> Form:
        """One of its forms.

        Parameters
        ----------
        name : str
            Its name; ``""`` for the first.

        Returns
        -------
        Form

        Raises
        ------
        KeyError
            If it has no such form.
        """
        found = next((form for form in self.forms if name in ("", form.name)), None)
        if found is None:
            raise KeyError(name)
        return found

    @property
    def everywhere(self) -> str:
        """Where it acts when no block is named, in words."""
        if not self.at:
            return "the whole rig"
        return f"the last {self.at}" if self.last_only else f"every {self.at}"

    def dotted(self) -> tuple[str, ...]:
        """Dotted names of the parameters, ``leak_muscle.conductance``."""
        return tuple(f"{self.id}.{parameter.name}" for parameter in self.parameters)

    def neutral(self) -> dict[str, float]:
        """The parameters at which it does nothing; empty for an effect that replaces an equation and has none."""
        return {p.name: p.neutral for p in self.parameters if p.neutral is not None}
