"""Every number that steers a verdict, in one place.

A setting has a unit, a reason and an origin; ``settings_table()`` lists them all. They are passed
to :func:`pamrs.diagnose` and stored in its result, so that an answer says what it rests on.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from pamrs._checks import checked_table
from pamrs.diagnosis.settings._after import NextExperimentSettings, PlanSettings, WarningSettings
from pamrs.diagnosis.settings._data import (
    NoiseSettings,
    OverlapSettings,
    PlausibilitySettings,
    PrepareSettings,
)
from pamrs.diagnosis.settings._judgement import EvidenceSettings, VerdictSettings
from pamrs.diagnosis.settings._models import (
    ClosureSettings,
    FitSettings,
    ScreenSettings,
    TransientSettings,
)
from pamrs.diagnosis.settings._search import (
    BelowNoiseSettings,
    ReadingSettings,
    SearchSettings,
    WrongParameterSettings,
)
from pamrs.diagnosis.settings._setting import SettingsGroup
from pamrs.errors import ParameterError

__all__ = [
    "BelowNoiseSettings",
    "ClosureSettings",
    "DiagnosisSettings",
    "EvidenceSettings",
    "FitSettings",
    "NextExperimentSettings",
    "NoiseSettings",
    "OverlapSettings",
    "PlanSettings",
    "PlausibilitySettings",
    "PrepareSettings",
    "ScreenSettings",
    "ReadingSettings",
    "SearchSettings",
    "Setting",
    "SettingsGroup",
    "TransientSettings",
    "VerdictSettings",
    "WarningSettings",
    "WrongParameterSettings",
    "settings_table",
]


@dataclass(frozen=True)
class DiagnosisSettings:
    """The numbers that a diagnosis rests on, by step.

    Attributes
    ----------
    prepare : PrepareSettings
        Recordings made ready for the cut chain.
    plausibility : PlausibilitySettings
        What recordings cannot be.
    overlap : OverlapSettings
        When two recordings hold the same samples.
    noise : NoiseSettings
        When a residual is more than noise.
    fit : FitSettings
        Fits of parameters and effects.
    transients : TransientSettings
        Effects with times of their own.
    screen : ScreenSettings
        Scores of effects before any fit.
    readings : ReadingSettings
        Other units of columns.
    search : SearchSettings
        Hypotheses that are fitted.
    below_noise : BelowNoiseSettings
        Effects below the noise.
    wrong_parameters : WrongParameterSettings
        Values of the rig file that are wrong.
    evidence : EvidenceSettings
        Weights of hypotheses.
    closures : ClosureSettings
        Forms of what has no name.
    verdict : VerdictSettings
        From probabilities to a verdict.
    next_experiment : NextExperimentSettings
        What to record next.
    plan : PlanSettings
        What could be seen, before there are data.
    warnings : WarningSettings
        What the result warns of.
    seed : int
        Seed of every random draw (noise levels, dither, resamples), so that a diagnosis repeats.

    Raises
    ------
    ParameterError
        If a value has the wrong type or is outside its range.

    Examples
    --------
    >>> from pamrs.diagnosis.settings import DiagnosisSettings
    >>> careful = DiagnosisSettings().with_values({"evidence.most_probability": 0.9})
    >>> careful.evidence.most_probability
    0.9
    """

    prepare: PrepareSettings = field(default_factory=PrepareSettings)
    plausibility: PlausibilitySettings = field(default_factory=PlausibilitySettings)
    overlap: OverlapSettings = field(default_factory=OverlapSettings)
    noise: NoiseSettings = field(default_factory=NoiseSettings)
    fit: FitSettings = field(default_factory=FitSettings)
    transients: TransientSettings = field(default_factory=TransientSettings)
    screen: ScreenSettings = field(default_factory=ScreenSettings)
    readings: ReadingSettings = field(default_factory=ReadingSettings)
    search: SearchSettings = field(default_factory=SearchSettings)
    below_noise: BelowNoiseSettings = field(default_factory=BelowNoiseSettings)
    wrong_parameters: WrongParameterSettings = field(default_factory=WrongParameterSettings)
    evidence: EvidenceSettings = field(default_factory=EvidenceSettings)
    closures: ClosureSettings = field(default_factory=ClosureSettings)
    verdict: VerdictSettings = field(default_factory=VerdictSettings)
    next_experiment: NextExperimentSettings = field(default_factory=NextExperimentSettings)
    plan: PlanSettings = field(default_factory=PlanSettings)
    warnings: WarningSettings = field(default_factory=WarningSettings)
    seed: int = 20140501

    def __post_init__(self) -> None:
        for name, group in _GROUPS.items():
            value = getattr(self, name)
            if not isinstance(value, group):
                raise ParameterError(
                    f"DiagnosisSettings.{name} is a {type(value).__name__}; a {group.__name__} is "
                    "needed"
                )
        seed = self.seed
        if isinstance(seed, bool) or not isinstance(seed, int) or seed < 0:
            raise ParameterError(
                f"DiagnosisSettings.seed = {seed!r} is not allowed: a whole number, 0 or more"
            )

    def to_dict(self) -> dict[str, Any]:
        """The values by group and name, as JSON has them."""
        found: dict[str, Any] = {name: getattr(self, name).to_dict() for name in _GROUPS}
        return {**found, "seed": self.seed}

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> DiagnosisSettings:
        """Settings from their values; what is left out keeps its default.

        Parameters
        ----------
        values : mapping
            As :meth:`to_dict` gives them, or ``settings`` of a diagnosis' JSON.

        Raises
        ------
        ParameterError
            For a name that is not a setting, or a value that is not allowed.
        """
        given: dict[str, Any] = {}
        for name, value in checked_table("settings", values).items():
            if name != "seed" and name not in _GROUPS:
                raise ParameterError(
                    f"settings has {name!r}, which is not allowed: one of {', '.join(_GROUPS)}, "
                    "seed"
                )
            if name != "seed" and not isinstance(value, Mapping):
                raise ParameterError(
                    f"settings.{name} is a {type(value).__name__}; a table of values is needed"
                )
            given[name] = value if name == "seed" else _GROUPS[name].from_dict(value)
        return cls(**given)

    def with_values(self, values: Mapping[str, Any]) -> DiagnosisSettings:
        """The same settings with some other values.

        Parameters
        ----------
        values : mapping of str to value
            By dotted name, ``evidence.softness``, or ``seed``.

        Raises
        ------
        ParameterError
            For a name that is not a setting, or a value that is not allowed.
        """
        changed = self.to_dict()
        for name, value in checked_table("values", values).items():
            group, _, own = name.partition(".")
            if name == "seed":
                changed["seed"] = value
            elif group in _GROUPS and own in changed[group]:
                changed[group][own] = value
            else:
                known = ", ".join(changed[group]) if group in _GROUPS else ", ".join(_GROUPS)
                raise ParameterError(f"settings has no {name!r}: one of {known}")
        return DiagnosisSettings.from_dict(changed)


_GROUPS: dict[str, type[SettingsGroup]] = {
    "prepare": PrepareSettings,
    "plausibility": PlausibilitySettings,
    "overlap": OverlapSettings,
    "noise": NoiseSettings,
    "fit": FitSettings,
    "transients": TransientSettings,
    "screen": ScreenSettings,
    "readings": ReadingSettings,
    "search": SearchSettings,
    "below_noise": BelowNoiseSettings,
    "wrong_parameters": WrongParameterSettings,
    "evidence": EvidenceSettings,
    "closures": ClosureSettings,
    "verdict": VerdictSettings,
    "next_experiment": NextExperimentSettings,
    "plan": PlanSettings,
    "warnings": WarningSettings,
}


@dataclass(frozen=True)
class Setting:
    """One setting, described.

    Attributes
    ----------
    name : str
        Dotted name, ``evidence.softness``.
    default : object
        Its value where nothing else is said.
    unit, reason, origin : str
        Unit, what it decides, and where the value comes from.
    """

    name: str
    default: object
    unit: str
    reason: str
    origin: str


def settings_table() -> Iterator[Setting]:
    """Every setting with its default, unit, reason and origin, in the order of the steps."""
    for name, group in _GROUPS.items():
        for own in dataclasses.fields(group):
            told = own.metadata
            described = (told["unit"], told["reason"], told["origin"])
            yield Setting(f"{name}.{own.name}", own.default, *described)
    yield Setting(
        "seed",
        DiagnosisSettings().seed,
        "1",
        "seed of every random draw, so that a diagnosis repeats",
        "arbitrary: any other one is as good",
    )
