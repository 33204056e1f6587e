"""What a diagnosis returns: verdict, location, named physics, fit, traces; as text, JSON and pages."""

from __future__ import annotations

import html
import json
import math
import os
import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol, cast

import numpy as np
import numpy.typing as npt

from pamrs._writing import write_atomically
from pamrs.channels import UNITS
from pamrs.report import text as words

__all__ = ["SCHEMA", "VERDICTS", "Diagnosis", "Trace", "schema"]

SCHEMA = "pamrs.diagnosis/1"
"""Name of the JSON schema that `Diagnosis.to_json` follows."""

VERDICTS = ("none", "parameters", "effects", "unlisted")
"""Allowed verdicts."""

FloatArray = npt.NDArray[np.float64]


class ModelFile(Protocol):
    """Anything that can write itself as a model file; normally a `pamrs.rig.Rig`."""

    def to_toml_text(self) -> str:
        """Return the model as TOML."""


def schema() -> dict[str, Any]:
    """Return the JSON Schema of `pamrs.diagnosis/1` as a dictionary."""
    text = Path(__file__).with_name("schema.json").read_text(encoding="utf-8")
    return cast("dict[str, Any]", json.loads(text))


@dataclass
class Trace:
    """One channel of one recording, measured and simulated.

    Parameters
    ----------
    recording, role : str
        Name of the recording; role ``fit`` or ``held_out``.
    channel, unit : str
        Canonical channel and its SI unit.
    time : array_like, shape (n,)
        Time in s.
    measured, before : array_like, shape (n,)
        Measurement and simulation with the nominal model, in `unit`; NaN where masked.
    refit, after : array_like or None, shape (n,)
        Simulation after the refit of parameters only, and with the effect; None becomes NaN.
    residual_before, residual_after : array_like or None, shape (n,)
        Residual of the refitted baseline and of the model with the effect; by default measured minus
        `refit` (or `before` when there is no refit) and measured minus `after`.

    Raises
    ------
    ValueError
        If an array has not the shape of `time`.
    """

    recording: str
    role: str
    channel: str
    unit: str
    time: FloatArray
    measured: FloatArray
    before: FloatArray
    refit: FloatArray | None = None
    after: FloatArray | None = None
    residual_before: FloatArray | None = None
    residual_after: FloatArray | None = None

    def __post_init__(self) -> None:
        self.time = np.asarray(self.time, dtype=np.float64)
        for name in ("measured", "before", "refit", "after", "residual_before", "residual_after"):
            value = getattr(self, name)
            if value is None:
                continue
            array = np.asarray(value, dtype=np.float64)
            if array.shape != self.time.shape or array.ndim != 1:
                raise ValueError(
                    f"trace {self.recording}/{self.channel}: {name} has shape {array.shape}, "
                    f"time has shape {self.time.shape}; both must be the same (n,)"
                )
            setattr(self, name, array)
        nan = np.full(self.time.shape, np.nan)
        baseline = self.before if self.refit is None else self.refit
        self.refit = nan.copy() if self.refit is None else self.refit
        self.after = nan.copy() if self.after is None else self.after
        if self.residual_before is None:
            self.residual_before = self.measured - baseline
        if self.residual_after is None:
            self.residual_after = self.measured - self.after


def _plain(value: Any) -> Any:
    """Turn numpy objects into JSON values, with null for what is not finite."""
    if isinstance(value, Mapping):
        return {str(k): _plain(v) for k, v in value.items()}
    if isinstance(value, np.ndarray):
        return _plain(value.tolist())
    if isinstance(value, np.generic):
        return _plain(value.item())
    if isinstance(value, (str, bool, int)) or value is None:
        return value
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, (Sequence, set, frozenset)):
        return [_plain(v) for v in (sorted(value) if isinstance(value, (set, frozenset)) else value)]
    raise TypeError(f"cannot write a {type(value).__name__} to JSON")


def _pick(entry: Mapping[str, Any], always: Sequence[str], optional: Sequence[str] = ()) -> dict[str, Any]:
    """Keys that the schema knows, `always` filled with None, `optional` only where there is a value."""
    chosen = {key: _plain(entry.get(key)) for key in always}
    chosen.update({key: _plain(entry[key]) for key in optional if entry.get(key) is not None})
    if "unit" in chosen:
        chosen["unit"] = str(chosen["unit"] or "1")
    return chosen


@dataclass(repr=False)
class Diagnosis:
    """Result of `pamrs.diagnose`.

    Attributes
    ----------
    case : str
        Name of the case.
    verdict : str
        ``none``, ``parameters``, ``effects`` or ``unlisted``.
    where : dict
        ``block``, ``channel``, ``intervals`` (pairs in s), ``conditions`` (sentences or dictionaries with a
        ``text``), ``text``; optionally ``recording``, to which the intervals belong.
    effects : list of dict
        What is named (with the verdict ``unlisted`` what comes closest): ``id``, ``probability``, ``name`` (in words), ``parameters``
        {name: {value, std, unit, interval?, identifiable?}}, most probable first; SI, 95 % intervals; optional ``events``, what
        happened in single recordings (``recording``, ``time`` and the effect's other parameters, SI), and ``inclusion``, the share of
        resampled recordings in which the screen would have taken the effect.
    ambiguity : list of list of str
        Sets of names (effects, wrong parameters by dotted name, ``unlisted``, ``parameters``) that the data cannot separate; empty when
        settled.
    probabilities : dict
        Probability of what the case may be told to have: names of all its blocks joined by ``+``, ``none``, ``parameters`` (that moved
        inside their tolerances), or ``unlisted`` (something is missing and nothing has a name). Those of each block are in ``blocks``.
    parameters : dict
        {name: {nominal, value, std, unit, moved_sigmas, identifiable}}, SI.
    fit : dict
        ``channels`` and ``held_out``: {channel: {noise, before, refit, after}} in SI, and ``gap_closed``.
    next_experiment : dict
        ``text``, ``excitation``, ``expected_information_bits``.
    warnings : list of str
        What the user should know before trusting the rest.
    seconds : float
        Wall time.
    text : str
        The verdict in words, several sentences; paragraphs are separated by a blank line.
    rig : Rig or None
        Final model, with what was found.
    traces : list of Trace
        Measured and simulated channels.
    blocks : list of dict
        The verdict of each group of blocks: ``blocks`` (their names), ``verdict``, ``probabilities``, ``effects``,
        ``wrong_parameters``, ``ambiguity``, and ``mismatch``: for each block its ``channel``, ``unit``, and ``fitted`` and ``held_out``
        {before, refit, after: {noises, size, more_than_noise}}, what is more than noise in units of the noise and in SI.
    unexplained : list of dict
        Blocks that keep a mismatch: ``block``, ``channel``, ``unit``, ``noises``, ``size`` (SI), and the ``verdict`` of their group.
    wrong_parameters : list of dict
        Values of the rig file that are wrong: ``name``, ``block``, ``nominal``, ``tolerance``, ``value``, ``std``, ``interval`` (95 %),
        ``unit``, ``moved_sigmas``, ``probability``, and ``held_out`` {channel: {before, refit, after}}, the error as in ``fit``, SI.
    residuals : dict
        {block: {rms, noise, excess, p_value, channel}}, residual of each block's refitted baseline against its noise.
    condition_map : dict or None
        ``x_label``, ``y_label``, ``x_edges`` (m+1,), ``y_edges`` (n+1,), ``z`` and ``z_after`` (n, m): mean
        residual in units of the noise, NaN where there are no data; ``block``.
    timings : dict
        Seconds of each stage, optional.
    tried : list of dict
        Every set of effects that was fitted: ``blocks``, ``effects``, what it leaves of each block's variance in units of the noise's
        (``fitted``, ``held_out``), ``gap_closed``, its ``values``.
    asked : list of dict
        Every lasting effect that acts where the mismatch is: ``id``, ``blocks``, ``promised``, the share of the mismatch that its
        signature could take before any fit, and ``left``, the share that it leaves fitted alone (None where it promised too little).

    Raises
    ------
    ValueError
        If `verdict` is none of the allowed four.
    """

    case: str
    verdict: str
    where: dict[str, Any] = field(default_factory=dict)
    effects: list[dict[str, Any]] = field(default_factory=list)
    ambiguity: list[list[str]] = field(default_factory=list)
    probabilities: dict[str, float] = field(default_factory=dict)
    parameters: dict[str, dict[str, Any]] = field(default_factory=dict)
    fit: dict[str, Any] = field(default_factory=dict)
    next_experiment: dict[str, Any] = field(default_factory=dict)
    warnings: list[str] = field(default_factory=list)
    seconds: float = 0.0
    text: str = ""
    rig: ModelFile | None = None
    traces: list[Trace] = field(default_factory=list)
    blocks: list[dict[str, Any]] = field(default_factory=list)
    unexplained: list[dict[str, Any]] = field(default_factory=list)
    wrong_parameters: list[dict[str, Any]] = field(default_factory=list)
    residuals: dict[str, dict[str, Any]] = field(default_factory=dict)
    condition_map: dict[str, Any] | None = None
    timings: dict[str, float] = field(default_factory=dict)
    tried: list[dict[str, Any]] = field(default_factory=list)
    asked: list[dict[str, Any]] = field(default_factory=list)

    def __post_init__(self) -> None:
        if self.verdict not in VERDICTS:
            raise ValueError(f"verdict is {self.verdict!r}; allowed are {', '.join(VERDICTS)}")

    @property
    def model(self) -> str:
        """The model with the effect, as TOML; empty when there is no model."""
        return "" if self.rig is None else self.rig.to_toml_text()

    @property
    def headline(self) -> str:
        """The verdict in one sentence."""
        return words.headline(self)

    def to_dict(self) -> dict[str, Any]:
        """Return the content of the JSON file: exactly the keys of the schema, null for no number."""
        channels = {
            part: {str(c): _pick(v, ("noise", "before", "refit", "after")) for c, v in (self.fit.get(part) or {}).items()}
            for part in ("channels", "held_out")
        }
        where = _pick(self.where, ("block", "channel"))
        where["intervals"] = _plain(list(self.where.get("intervals") or []))
        where["conditions"] = _plain(list(self.where.get("conditions") or []))
        where["text"] = str(self.where.get("text") or "")
        experiment = self.next_experiment
        return {
            "schema": SCHEMA,
            "verdict": self.verdict,
            "where": where,
            "effects": [
                {
                    "id": str(effect["id"]),
                    "probability": _plain(effect.get("probability")),
                    **({"inclusion": _plain(effect["inclusion"])} if effect.get("inclusion") is not None else {}),
                    "parameters": {
                        str(name): _pick(p, ("value", "std", "unit"), ("interval", "identifiable"))
                        for name, p in (effect.get("parameters") or {}).items()
                    },
                    **({"events": _plain(effect["events"])} if effect.get("events") else {}),
                }
                for effect in self.effects
            ],
            "ambiguity": _plain([list(s) for s in self.ambiguity]),
            "probabilities": _plain(self.probabilities),
            "blocks": _plain(self.blocks),
            "unexplained": _plain(self.unexplained),
            "wrong_parameters": _plain(self.wrong_parameters),
            "parameters": {
                str(name): _pick(p, ("nominal", "value", "std", "unit", "moved_sigmas"), ("identifiable",))
                for name, p in self.parameters.items()
            },
            "fit": {**channels, "gap_closed": _plain(self.fit.get("gap_closed"))},
            "next_experiment": {
                "text": str(experiment.get("text") or ""),
                "excitation": _plain(experiment.get("excitation") or {}),
                "expected_information_bits": _plain(experiment.get("expected_information_bits")),
            },
            "warnings": [str(w) for w in self.warnings],
            "seconds": _plain(self.seconds),
        }

    def to_json(self, path: str | os.PathLike[str] | None = None) -> str:
        """Return the result as strict JSON (schema `pamrs.diagnosis/1`).

        Parameters
        ----------
        path : path, optional
            File to write too; written beside and renamed, so that it is never half there.

        Returns
        -------
        str
            JSON text; NaN and infinities are null.
        """
        text = json.dumps(self.to_dict(), indent=2, ensure_ascii=False, allow_nan=False) + "\n"
        if path is not None:
            write_atomically(path, text)
        return text

    def summary(self) -> str:
        """Return the result as plain text for a terminal, about 20 lines."""
        lines = [f"Diagnosis of {self.case}", *textwrap.wrap(self.headline + ".", 96)]
        where = str(self.where.get("text") or "")
        if where:
            lines += ["", *textwrap.wrap(where, 96, initial_indent="where  ", subsequent_indent=" " * 7)]
        if self.probabilities:
            lines.append("")
            for name, p in words.ranked_probabilities(self, 5):
                lines.append(f"{words.hypothesis_label(name):<38.38} {words.format_probability(p):>7}  {'#' * round(30 * p)}")
        for effect in self.effects:
            lines.append("")
            lines.append(f"{effect.get('name') or words.label(str(effect['id']))}")
            for name, p in (effect.get("parameters") or {}).items():
                if p.get("identifiable", True):
                    value = words.format_uncertain(p.get("value"), p.get("std"), unicode=False)
                    lines.append(f"  {name} = {value} {p.get('unit') or ''}".rstrip())
                else:
                    lines.append(f"  {name}: these recordings do not determine it")
        for wrong in self.wrong_parameters:
            lines += ["", *textwrap.wrap(words.sentence_of(wrong), 96)]
        lines += self._summary_fit()
        for kept in self.unexplained:
            lines += textwrap.wrap(f"Open: {words.kept_sentence(kept)}", 96, subsequent_indent="  ")
        if len(self.ambiguity) > 1:
            sets = "; ".join(words.set_label(s) for s in self.ambiguity)
            lines += ["", *textwrap.wrap(f"Not separable: {sets}.", 96, subsequent_indent="  ")]
        if self.next_experiment.get("text"):
            lines += [
                "",
                *textwrap.wrap(f"Next experiment: {self.next_experiment['text']}", 96, subsequent_indent="  "),
            ]
        for warning in self.warnings[:3]:
            lines += textwrap.wrap(f"Warning: {warning}", 96, subsequent_indent="  ")
        if len(self.warnings) > 3:
            lines.append(f"({len(self.warnings) - 3} more warnings in the report)")
        lines.append(f"{self.seconds:.1f} s")
        return "\n".join(lines)

    def __repr__(self) -> str:
        return f"Diagnosis({self.case!r}: {self.verdict}; {self.headline})"

    @property
    def proof(self) -> str:
        """The recordings on which the gap was measured, in words."""
        return "held-out recordings" if self.fit.get("held_out") else "the fitted recordings (none was held out)"

    def _summary_fit(self) -> list[str]:
        """Error table of the held-out recordings, else of the fitted ones."""
        part = "held_out" if self.fit.get("held_out") else "channels"
        channels = self.fit.get(part) or {}
        if not channels:
            return []
        title = "held-out error" if part == "held_out" else "error (fit)"
        lines = ["", f"{title:<22}{'noise':>11}{'before':>11}{'refit':>11}{'after':>11}"]
        for channel, entry in channels.items():
            sizes = [abs(float(v)) for v in entry.values() if words.is_number(v)]
            unit, factor = words.display_unit(UNITS.get(channel, ""), max(sizes, default=math.nan))
            unit = unit.replace("°", "deg")
            row = f"{channel} [{unit}]" if unit else channel
            for key in ("noise", "before", "refit", "after"):
                value = entry.get(key)
                shown = float(value) * factor if words.is_number(value) else None
                row = (f"{row:<22}" if key == "noise" else row) + f"{words.format_number(shown, unicode=False):>11}"
            lines.append(row)
        gap = self.fit.get("gap_closed")
        if words.is_number(gap):
            lines.append(f"gap to the noise closed on {self.proof}: {100 * float(gap):.0f} %")
        return lines

    def report(self, path: str | os.PathLike[str]) -> Path:
        """Write the report, one HTML file that needs no network.

        Parameters
        ----------
        path : path-like
            The file.

        Raises
        ------
        ImportError
            If matplotlib or jinja2 is missing; names the extra to install.
        """
        from pamrs.report import write_report

        return write_report(self, path)

    def figure(self, path: str | os.PathLike[str]) -> Path:
        """Write one picture of the diagnosis, a PNG of 1600 x 1000 pixels.

        Parameters
        ----------
        path : path-like
            The file.

        Raises
        ------
        ImportError
            If matplotlib is missing; names the extra to install.
        """
        from pamrs.report import write_figure

        return write_figure(self, path)

    def _repr_html_(self) -> str:
        """Short HTML for notebooks."""
        rows = "".join(
            f"<tr><td style='text-align:left'>{html.escape(words.hypothesis_label(name))}</td>"
            f"<td>{html.escape(words.format_probability(p))}</td>"
            f"<td style='text-align:left'><span style='display:inline-block;height:.7em;"
            f"width:{max(0.0, min(1.0, p)) * 12:.2f}em;background:#0072b2'></span></td></tr>"
            for name, p in words.ranked_probabilities(self, 5)
        )
        gap = self.fit.get("gap_closed")
        closed = f"<p>{100 * float(gap):.0f} % of the gap to the noise closed on {self.proof}.</p>" if words.is_number(gap) else ""
        where = html.escape(str(self.where.get("text") or ""))
        return (
            f"<div><p><b>{html.escape(self.headline)}.</b></p><p>{where}</p>"
            f"<table>{rows}</table>{closed}"
            "<p><code>.report(&quot;report.html&quot;)</code> writes the whole story.</p></div>"
        )
