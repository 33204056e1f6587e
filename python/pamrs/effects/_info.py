"""Entries of the catalogue: an effect, its forms and its parameters."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field


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
        Where it usually lies; an effect is less probable the further outside it needs the
        parameter.
    prior : (mean, standard deviation) or None
        What is known of it before any data.
    role : str
        What it is to a fit and a search: ``size`` (scales the effect), ``shape`` (tried from its
        starts), ``choice`` (either end of its range, not fitted), ``held`` (at its default);
        ``time``, ``duration`` and ``rise`` of an event; ``place`` (where on ``channel`` a contact
        begins) and ``side`` (from below or above it); ``threshold`` (a level of ``channel`` at
        which something switches: no fit can move it; the first switches on, the second off). Empty:
        ``size`` where zero is neutral, else ``shape``.
    role_sealed : str
        The same in a rig without a valve; empty where it is the same.
    channel : str
        Kind of the measured channel in which a place or a threshold lies.
    repeats : str
        Parameter of which it is another one (``torque`` of ``torque_2``); held unless an event
        needs it.
    tried : float or None
        Value that a search gives it while it looks for the time of an event, or scans another
        parameter.
    scan : (low, high, count) or None
        Values that are tried one by one, evenly in their logarithm, before any is fitted: a
        resonance has to be met.
    same_everywhere : bool
        Whether it is the same in all recordings, whatever else is not.
    time_constant : bool
        Whether recordings must last as long as it, or so, to tell it.
    own : bool
        Whether it is another one in each recording, and is found again in a held-out one.
    restricts : bool
        Whether the effect falls with its inverse square (a pressure loss with a conductance).
    like : str
        Parameter of the rig, as ``block.key``, in parts of which it is tried; an area stands for
        the conductance of its opening.
    needed_in : tuple of str
        Kinds of block of the cut chain in which the effect acts only while this parameter is not
        zero.
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
    prior: tuple[float, float] | None = None
    role: str = ""
    role_sealed: str = ""
    channel: str = ""
    repeats: str = ""
    tried: float | None = None
    scan: tuple[float, float, int] | None = None
    same_everywhere: bool = False
    time_constant: bool = False
    own: bool = False
    restricts: bool = False
    like: str = ""
    needed_in: tuple[str, ...] = ()

    def role_in(self, *, sealed: bool) -> str:
        """Role in a fit, in a rig with a valve or in a sealed one; never empty."""
        if self.repeats:
            return "held"
        usual = self.role or ("size" if self.neutral == 0.0 else "shape")
        return (self.role_sealed or usual) if sealed else usual


@dataclass(frozen=True, slots=True)
class SameData:
    """Condition under which an effect gives exactly the recordings of another one: nothing in them
    can distinguish the two.

    Attributes
    ----------
    effect, form, parameter : str
        The other effect, its form, and its parameter that is then as large as ``size``.
    size : str
        The own parameter that is the effect's size; the two are the same where it is positive.
    without : str
        The own parameter that would tell the two apart, if it were not zero.
    held : tuple of (str, float)
        Own parameters with the values at which the two are the same.
    held_at : str
        Kind of block that the held parameters act on; they say nothing in a rig that has none.
    told_by : str
        What tells the two apart, since no recording of the same channels does.
    """

    effect: str
    form: str
    parameter: str
    size: str
    without: str
    held: tuple[tuple[str, float], ...]
    held_at: str
    told_by: str


@dataclass(frozen=True, slots=True)
class ClosureTerm:
    """One term of a sum that is fitted where no named effect explains the data.

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
class Words:
    """Words in which a sum of terms is described.

    Attributes
    ----------
    what, letter : str
        What it is the sum of, and the letter for it.
    symbols : str
        What the symbols of its terms stand for.
    odd_in : str
        What its odd terms turn their sign with.
    """

    what: str
    letter: str
    symbols: str
    odd_in: str


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
    equation : str
        Its governing equation.
    """

    name: str
    parameters: tuple[EffectParameter, ...]
    states: tuple[str, ...] = ()
    ports: tuple[str, ...] = ()
    equation: str = ""

    @property
    def transient(self) -> bool:
        """True where the form acts at times of its own, with a phase or with a size of its own in
        each recording, so that all recordings cannot share its parameters.
        """
        return self.periodic or self.own or any(p.role == "time" for p in self.parameters)

    @property
    def own(self) -> bool:
        """True where the form acts all the time with a size of its own in each recording."""
        return any(parameter.own for parameter in self.parameters)

    @property
    def periodic(self) -> bool:
        """True where the form repeats with a frequency; its phase differs from recording to
        recording.
        """
        return any(p.scan is not None and p.unit == "Hz" for p in self.parameters)

    @property
    def shared(self) -> tuple[str, ...]:
        """Names of the parameters that are the same in all recordings, whatever else is not."""
        return tuple(p.name for p in self.parameters if p.same_everywhere)


@dataclass(frozen=True, slots=True)
class BenchUnit:
    """Unit in which a parameter is stated on a bench.

    Attributes
    ----------
    parameter, form : str
        The parameter, and the form of the effect for which it holds; empty for all others.
    unit : str
        ``l/min at 3 bar``.
    factor : float
        Value in it over that in SI.
    mixed_by : str
        Parameter that is 0 where `factor` holds and 1 where `mixed` does; linear between.
    mixed : float
        The other factor.
    """

    parameter: str
    unit: str
    factor: float
    form: str = ""
    mixed_by: str = ""
    mixed: float = 0.0


@dataclass(frozen=True, slots=True)
class EffectInfo:
    """One effect of the catalogue.

    Attributes
    ----------
    id, name, block : str
        Public identifier, words, and the block in which it acts.
    at : str
        Kind of the blocks of which it can take one by its name, ``""`` for an effect on the whole
        rig.
    equation, fingerprint, separates : str
        Governing equation of the first form; what it looks like in recordings; what it is confused
        with and what separates them.
    forms : tuple of Form
        Its forms; the first one is meant where none is named.
    reference : str
        Where it comes from.
    rivals : tuple of str
        What looks like it in recordings: ids of the catalogue first, then other causes in words. Of
        two effects each names the other.
    catalogue : bool
        Whether it is a name for physics, which a diagnosis may give; a sum of terms is none.
    same_data : tuple of SameData
        Other effects whose recordings it leaves where a parameter is zero, each in rigs that have
        what that one acts on; of several in one rig the first.
    terms : tuple of ClosureTerm
        Of a sum of terms, in the order of its parameters; the shapes of its memories follow.
    label : str
        Short name for tables and figures; the id in words by default.
    stated_by : tuple of str
        Parameters of the rig that say the same: where the file gives one of them a tolerance, it is
        fitted, and the effect is not looked for.
    like_values : tuple of str
        Parameters of the rig with nearly the same law, by block and key, whatever the block is
        called: one that the file has as exactly zero may be what is missing.
    acts_in : tuple of str
        Kinds of block of the cut chain in which it acts (``supply``, ``chamber``, ``arm``), where
        these are others than those of its block.
    experiment : str
        What to record to tell it from what looks like it, with numbers; empty where ``separates``
        says it.
    shares : str
        What it has in common with others, as the end of "the model leaves out": ``a leak``.
    most : dict of str to str
        Parameters that a rig bounds: ``pull`` of a muscle, ``pull per pressure``, or ``drift`` of a
        reading.
    bench : str
        What to do on the bench to see it or to be rid of it.
    bench_units : tuple of BenchUnit
        Units of its parameters on a bench, where these are not the usual ones.
    excitation : tuple of (str, value)
        The same for a program: ``kind`` and numbers with their unit in the name.
    last_only : bool
        Whether it acts on the last block of its kind where none is named, and not on every one.
    on_loads : bool
        Whether it acts on a linear load too.
    supplies : tuple of str
        Kinds of supply that it acts on; empty for all.
    frees_mass : bool
        Whether the mass of a chamber's gas is a state of its own with it, in place of the chamber's
        coefficients.
    dry_friction : bool
        Whether a motion that does not turn round does not feel it as damping.
    kink : (names, why, of_supplies) or None
        Why it has no linear model: it is there where any of these parameters is not zero, maybe
        only while the pressure of a supply moves.
    at_rest : tuple of (str, str, float)
        How it is changed for a linear model about a state of rest: ``("set", parameter, value)``,
        or ``("out_below", parameter, value)`` where it is left out below a value.
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
    same_data: tuple[SameData, ...] = ()
    terms: tuple[ClosureTerm, ...] = ()
    label: str = ""
    stated_by: tuple[str, ...] = ()
    like_values: tuple[str, ...] = ()
    most: Mapping[str, str] = field(default_factory=dict, hash=False)
    acts_in: tuple[str, ...] = ()
    experiment: str = ""
    shares: str = ""
    bench: str = ""
    bench_units: tuple[BenchUnit, ...] = ()
    excitation: tuple[tuple[str, str | int | float | tuple[float, ...]], ...] = ()
    last_only: bool = False
    on_loads: bool = False
    supplies: tuple[str, ...] = ()
    frees_mass: bool = False
    dry_friction: bool = False
    kink: tuple[tuple[str, ...], str, bool] | None = None
    at_rest: tuple[tuple[str, str, float], ...] = ()

    @property
    def parameters(self) -> tuple[EffectParameter, ...]:
        """The parameters of the first form."""
        return self.forms[0].parameters

    def form(self, name: str = "") -> Form:
        """Form of the effect by its name.

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

    def on_bench(self, parameter: str, form: str = "") -> BenchUnit | None:
        """Unit of a parameter of a form on a bench; None for the usual unit."""
        own = {u.form: u for u in self.bench_units if u.parameter == parameter}
        return own.get(form, own.get(""))

    @property
    def everywhere(self) -> str:
        """Words for the blocks on which the effect acts when none is named."""
        if not self.at:
            return "the whole rig"
        return f"the last {self.at}" if self.last_only else f"every {self.at}"

    @property
    def needs(self) -> tuple[tuple[str, str], ...]:
        """Blocks of which a rig must have one, each with its kind (empty: any); empty for the usual
        one.
        """
        if self.on_loads:
            return (("load", "mass"), ("joint", ""))
        if self.frees_mass:
            return (("chamber", "coefficients"),)
        if self.at == "line":
            return (("line", "orifice"),)
        return tuple(("supply", kind) for kind in self.supplies)

    @property
    def transient(self) -> bool:
        """True where the first form is transient; see :attr:`Form.transient`."""
        return self.forms[0].transient

    @property
    def lasting(self) -> tuple[Form, ...]:
        """Forms that act all the time, with the same parameters in all recordings."""
        return tuple(form for form in self.forms if not form.transient)

    @property
    def own(self) -> bool:
        """True where the first form has a size of its own in each recording."""
        return self.forms[0].own

    @property
    def leading(self) -> EffectParameter:
        """The parameter that scales it: the first that is a size."""
        return next(p for p in self.parameters if p.role_in(sealed=False) == "size")

    def with_role(self, role: str) -> tuple[EffectParameter, ...]:
        """Parameters of the first form with a role, in their order."""
        return tuple(p for p in self.parameters if p.role == role)

    def dotted(self) -> tuple[str, ...]:
        """Dotted names of the parameters, ``leak_muscle.conductance``."""
        return tuple(f"{self.id}.{parameter.name}" for parameter in self.parameters)

    def neutral(self) -> dict[str, float]:
        """The parameters at which it does nothing; empty for an effect that replaces an equation
        and has none.
        """
        return {p.name: p.neutral for p in self.parameters if p.neutral is not None}
