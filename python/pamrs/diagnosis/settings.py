"""Settings of a diagnosis that a user may have a reason to change, with unit, reason and origin.

They are passed to :func:`pamrs.diagnose`; its result holds those that differ from the defaults.
All other numbers that steer a verdict are constants of the modules that use them. A reason that
names no page of docs/decisions and no source is a judgement.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from typing import Any

from pamrs._checks import checked_table
from pamrs.errors import ParameterError
from pamrs.findings import SETTLED

__all__ = ["DiagnosisSettings"]

_TINY = 1e-300  # least value of what has to be above zero


def _setting(
    default: float, unit: str, reason: str, origin: str, least: float = 0.0, most: float = math.inf
) -> Any:
    """One setting: default, SI unit (``count``: a whole number), why, from where, its range."""
    meta = {"about": reason, "unit": unit, "origin": origin, "least": least, "most": most}
    return dataclasses.field(default=default, metadata=meta)


@dataclasses.dataclass(frozen=True, kw_only=True)
class DiagnosisSettings:
    """The numbers of a diagnosis that a user may change.

    ``dataclasses.fields(DiagnosisSettings)`` gives reason (``about``), unit, origin and range
    (``least``, ``most``) of each as its ``metadata``.

    Raises
    ------
    ParameterError
        If a value has the wrong type or is outside its range; names the setting, its value and
        what is allowed.

    Examples
    --------
    >>> from pamrs.diagnosis.settings import DiagnosisSettings
    >>> careful = DiagnosisSettings(most_probability=0.9)
    >>> careful.to_dict()
    {'most_probability': 0.9}
    """

    # recordings made ready
    smoothing_time: float = _setting(
        0.06,
        "s",
        "length of the filter (local cubics) for measured signals that drive a block, at least "
        "seven samples: longer smears steps, shorter leaves noise in the slopes",
        "docs/decisions/0022; judgement for recordings of 200 Hz",
        least=_TINY,
    )
    needed_sample_time: float = _setting(
        0.01,
        "s",
        "sample time that tanks, fed chambers, joints and loads need",
        "docs/decisions/0057: the same verdicts as with every sample of 500 and 1000 Hz",
        least=_TINY,
    )
    ample_samples: int = _setting(
        1000,
        "count",
        "samples that a recording keeps at least where it is averaged to the sample time that the "
        "fastest block needs: a short one is used as it is",
        "judgement: ten seconds of what is needed",
        least=32,
    )
    most_samples: int = _setting(
        500_000,
        "count",
        "samples of a case, averaged where they can be, that are diagnosed at all",
        "docs/decisions/0057: some five minutes",
        least=32,
    )
    least_block_share: float = _setting(
        0.2,
        "1",
        "share of usable samples below which a block is left out of the diagnosis",
        "judgement",
        most=1.0,
    )
    begun_temperature_error: float = _setting(
        5.0,
        "K",
        "error of the temperature at which a thermometer says that a gas begins: windows of the "
        "pressure in which so much would be seen are freed of it; and how far from that of the "
        "room one without a thermometer has to begin before it is taken not to have been at rest",
        "judgement: a thermocouple is off by two kelvins, and late (docs/decisions/0003)",
        least=_TINY,
    )
    # what recordings cannot be
    most_pressure: float = _setting(
        1e7,
        "Pa",
        "gauge pressure of air that no muscle sees",
        "judgement: Pa under a heading in bar is far above it",
        least=_TINY,
    )
    least_room: float = _setting(
        250.0,
        "K",
        "ambient temperature below which a recording is none of a room",
        "judgement: a cold store; degC with an offset of a sensor are below it",
        least=_TINY,
    )
    most_room: float = _setting(
        330.0,
        "K",
        "ambient temperature above which a recording is none of a room",
        "judgement: next to an oven; degF under a heading in K are above it",
        least=_TINY,
    )
    most_room_change: float = _setting(
        15.0,
        "K",
        "difference of a measured ambient temperature from that of the rig file from which it may "
        "be another one: an input that nothing is connected to reads 0 degC, 20 K below a usual "
        "room",
        "judgement",
        least=_TINY,
    )
    range_margin: float = _setting(
        0.05, "1", "share of its range by which a joint or a load may leave it", "judgement"
    )
    fastest_joint: float = _setting(
        200.0,
        "rad/s",
        "rate of a joint that one sample in a hundred may exceed",
        "judgement: degrees under a heading in rad exceed it",
        least=_TINY,
    )
    longest_sample_time: float = _setting(
        0.25,
        "s",
        "sample time at which the motion of a joint or load can still be followed",
        "judgement",
        least=_TINY,
    )
    lost_command_share: float = _setting(
        0.1,
        "1",
        "share of the time that a logger may lose a valve's command for; more is how the "
        "controller is",
        "judgement",
        most=1.0,
    )
    # when a residual is more than noise
    noise_margin: float = _setting(
        1.1,
        "1",
        "factor by which the variance must exceed its noise level before it counts: noise levels "
        "are estimates",
        "docs/decisions/0022, 55 healthy cases",
        least=1.0,
    )
    noise_chance: float = _setting(
        0.005,
        "1",
        "chance of noise exceeding the limit of a block that is accepted: one in 200",
        "docs/decisions/0022",
        least=_TINY,
        most=0.5,
    )
    noise_replicates: int = _setting(
        10,
        "count",
        "realisations of the sensors' noise that give a noise level and its scatter",
        "docs/decisions/0022",
        least=2,
    )
    usual_error: float = _setting(
        0.01,
        "1",
        "error that each block of a model is taken to have where the rig file states none for it: "
        "one standard deviation of a smooth curve, as a share of what the block does, of a gauge a "
        "tenth of it; 0 takes models to be perfect",
        "docs/decisions/0095",
        most=0.5,
    )
    # fits
    most_tolerances: float = _setting(
        3.0,
        "tolerances",
        "how far a baseline parameter may move: farther out it would stand for missing physics, "
        "or for a wrong rig file",
        "docs/decisions/0014: with six, an inertia far out hid a mounting that gives way",
        least=_TINY,
    )
    fit_evaluations: int = _setting(
        12, "count", "evaluations of a fit at the most", "judgement", least=1
    )
    baseline_evaluations: int = _setting(
        30,
        "count",
        "evaluations of a fit of baseline parameters alone at the most: what it leaves undone "
        "looks like missing physics",
        "docs/decisions/0022",
        least=1,
    )
    effect_evaluations: int = _setting(
        8, "count", "evaluations of a first fit of effects at the most", "judgement", least=1
    )
    # units of columns
    gauge_error: float = _setting(
        0.005,
        "1",
        "share by which a gauge's slope, or its zero in parts of the offset, may be off: a free "
        "factor need not be nearer to the one of the list",
        "usual class of industrial gauges: 0.5 % of the range",
    )
    # hypotheses that are fitted
    most_singles: int = _setting(
        5, "count", "single effects that are fitted", "docs/decisions/0013", least=1
    )
    most_terms: int = _setting(
        5, "count", "effects of a set", "judgement: more have no proof", least=1
    )
    most_polished: int = _setting(
        4,
        "count",
        "hypotheses that are fitted to their end",
        "docs/decisions/0022: two to four seconds each",
    )
    file_log_odds: float = _setting(
        4.6,
        "log odds",
        "log odds against a parameter outside its tolerances where the baseline explains all",
        "docs/decisions/0025: one file in a hundred",
    )
    # weights of hypotheses
    parameter_price: float = _setting(
        0.5,
        "log odds",
        "price of a parameter of an effect",
        "docs/decisions/0014: tuned on seed 501",
    )
    name_price: float = _setting(
        3.0,
        "log odds",
        "price of each effect and each wrong parameter",
        "docs/decisions/0014: tuned on seed 501",
    )
    wrong_price: float = _setting(
        1.5,
        "log odds",
        "price of a rig file that is wrong about a parameter, besides the logarithm of how many "
        "times it is outside its tolerances",
        "docs/decisions/0025",
    )
    drift_share: float = _setting(
        0.02,
        "1",
        "share of the pressure below which a drift that no other recording confirms may be the "
        "bench's own",
        "docs/decisions/0014: the aluminium control of the chambers has one",
    )
    drift_probability: float = _setting(
        0.45,
        "1",
        "largest probability of a name for a drift that no other recording confirms",
        "docs/decisions/0014",
        least=_TINY,
        most=1.0,
    )
    most_probability: float = _setting(
        0.985, "1", "largest probability of a name", "docs/decisions/0014", least=_TINY, most=1.0
    )
    # from probabilities to a verdict
    settled: float = _setting(
        SETTLED,
        "1",
        "probability from which an answer is settled",
        "docs/decisions/0014: odds of three to one",
        least=_TINY,
        most=1.0,
    )
    named: float = _setting(
        0.5,
        "1",
        "probability above which a name is given even where unlisted is more probable than each "
        "set of names that has it",
        "docs/decisions/0004",
        most=1.0,
    )
    in_set: float = _setting(
        0.05,
        "1",
        "probability from which a hypothesis belongs to the set that is left",
        "judgement",
        most=1.0,
    )
    spread_factor: float = _setting(
        2.0,
        "1",
        "factor of the standard deviations of what no prior holds, beyond what pieces of the "
        "recordings tell: for equations that are not quite the rig's",
        "docs/decisions/0041: 78 intervals of 95 % of six read seeds of the second plan held in "
        "78 %, twice as wide in 95 %",
        least=1.0,
    )
    # what to record next
    simulated_from: float = _setting(
        0.03,
        "1",
        "probability from which a hypothesis of a diagnosis is simulated",
        "judgement",
        most=1.0,
    )
    sensor_effort: float = _setting(900.0, "s", "what one more sensor costs, as time", "judgement")
    effective_samples: float = _setting(
        10.0,
        "1",
        "independent samples that a block's residual over one recording counts as: errors of a "
        "model are correlated, and thousands of samples do not know a thousandth of a noise",
        "judgement",
        least=_TINY,
    )
    length_rate: float = _setting(
        1.0 / 60.0,
        "m/s",
        "fastest change of the length on a load frame of which no recording shows a faster",
        "data sheets of electromechanical testing machines: 500 to 3000 mm/min",
        least=_TINY,
    )
    pressure_rate: float = _setting(
        2e5,
        "Pa/s",
        "fastest change of a pressure that a bench sets, of which no recording shows a faster",
        "judgement: a proportional regulator of 100 l/min fills 0.3 l by 5 bar/s",
        least=_TINY,
    )
    seed: int = _setting(
        20140501,
        "1",
        "seed of every random draw (noise levels, dither), so that a diagnosis repeats",
        "arbitrary: any other one is as good",
    )

    def __post_init__(self) -> None:
        for field in dataclasses.fields(self):
            object.__setattr__(self, field.name, _checked(field, getattr(self, field.name)))

    def to_dict(self) -> dict[str, Any]:
        """The values that differ from their defaults, by name."""
        values = {field: getattr(self, field.name) for field in dataclasses.fields(self)}
        return {field.name: value for field, value in values.items() if value != field.default}

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> DiagnosisSettings:
        """Settings from their values; what is left out keeps its default.

        Parameters
        ----------
        values : mapping of str to float
            As :meth:`to_dict` gives them, or ``settings`` of a diagnosis' JSON.

        Raises
        ------
        ParameterError
            For a name that is not a setting, or a value that is not allowed.
        """
        known = [field.name for field in dataclasses.fields(cls)]
        given = checked_table("settings", values)
        for name in given:
            if name not in known:
                raise ParameterError(
                    f"settings has {name!r}, which is not allowed: one of {', '.join(known)}"
                )
        return cls(**given)


def _checked(field: dataclasses.Field[Any], value: Any) -> float:
    """Value of a setting, checked for its kind and range."""
    meta, whole = field.metadata, isinstance(field.default, int)
    number = isinstance(value, (int, float)) and not isinstance(value, bool)
    if (
        not number
        or not math.isfinite(value)
        or (whole and value != int(value))
        or not meta["least"] <= value <= meta["most"]
    ):
        limit = f", at most {meta['most']:g}" if math.isfinite(meta["most"]) else ""
        raise ParameterError(
            f"DiagnosisSettings.{field.name} = {value!r} is not allowed: a "
            f"{'whole' if whole else 'finite'} number, at least {meta['least']:g}{limit} "
            f"[{meta['unit']}]"
        )
    return int(value) if whole else float(value)
