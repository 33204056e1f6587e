"""Result of a diagnosis: verdict, location, named physics, fit, traces; as text, JSON and pages."""

from __future__ import annotations

import dataclasses
import json
import os
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any, Final

from pamrs import __version__, report
from pamrs._views import COLOURS, Panels, View
from pamrs._writing import write_atomically
from pamrs.channels import laboratory_unit
from pamrs.diagnosis.settings import DiagnosisSettings
from pamrs.errors import DiagnosisError
from pamrs.findings import VERDICTS, Findings, ModelFile, Trace, fields_from, to_plain
from pamrs.report import sentences
from pamrs.report.terminal import notebook, summary

__all__ = [
    "READABLE",
    "SCHEMA",
    "VERDICTS",
    "Diagnosis",
    "ModelFile",
    "Trace",
    "load_result",
]

SCHEMA: Final = "pamrs.diagnosis/2"
"""Name and number of what `Diagnosis.to_json` writes."""
READABLE: Final = ("pamrs.diagnosis/1", SCHEMA)
"""Schemas of results that can be read: every key of an earlier one has kept its meaning."""


@dataclass(frozen=True, repr=False)
class Diagnosis(View, Findings):
    """Result of `pamrs.diagnose`.

    Its entries have attributes and can be read by key as well: ``effect.id`` is ``effect["id"]``.

    Attributes
    ----------
    case : str
        Name of the case.
    answer : Answer
        What all of the rest comes to, decided once: ``verdict``, ``settled`` and ``why`` not
        (``missed``, ``sets``, ``probability``, ``units``), the ``block``, the ``names`` that lead
        with their ``probability``, and what the final ``model`` still has ``missed`` by more than
        five noise levels beyond noise and its own error (``block``, None for the whole rig,
        ``channel``, ``unit``, ``size``, ``before``, ``noises``, ``beyond``).
    verdict : str
        ``none``, ``parameters``, ``effects``, ``unlisted``, or ``units`` (channels are read wrong,
        and nothing else is judged).
    misread : list of Misread
        Channels that are likely in another unit, or pressures with another zero, than the log says:
        ``channels``, ``said``, ``likely``, ``factors``, ``offset``, what the refitted baseline
        leaves ``before`` and ``after``, and ``text``.
    faulty : list of Faulty
        Channels that a sensor or logger spoiled, masked or left out, and said first: ``channel``,
        ``kind``, ``text``.
    laws : list of OtherLaw
        Laws that the recordings follow instead of those of the rig file, and under which all
        of the rest is judged: ``name``, ``stated``, ``other``, ``channel``, ``unit``, and errors of
        the refitted baseline ``before`` and ``after``, and the ``noise``.
    where : Where
        ``block``, ``channel``, ``intervals`` (pairs in s), ``conditions`` (``name``, ``share`` of
        the excess and of the ``time``, ``mean``, ``text``), ``text``; optionally ``recording``, to
        which the intervals belong.
    effects : list of EffectFound
        What is named (with another verdict what comes closest): ``id``, ``at`` (the block at which
        it acts, where it is one of several), ``probability``, ``name`` (in words), ``parameters``
        {name: {value, std, unit, interval?, identifiable?}}, most probable first; SI, 95 %
        intervals; ``events``, what happened in single recordings (``recording``, ``time`` and the
        effect's other parameters, SI).
    ambiguity : list of list of str
        Sets of names (effects, wrong parameters by dotted name, ``unlisted``, ``parameters``) that
        the data cannot separate; empty when settled. Here and in ``probabilities``, ``blocks``,
        ``tried`` and ``tested`` an effect at one of several blocks has the block's name behind an
        ``@``: ``leak_muscle@flexor``.
    probabilities : dict
        Probability of each possible answer for the case: names of all its blocks joined by ``+``,
        ``none``, ``parameters`` (that moved inside their tolerances), or ``unlisted`` (something is
        missing and nothing has a name). Those of each block are in ``blocks``.
    parameters : dict of str to ParameterFound
        {name: {nominal, value, std, unit, moved_sigmas, identifiable}}, SI.
    fit : FitErrors
        ``channels`` and ``held_out``: {channel: {noise, before, refit, after}} in SI, and
        ``gap_closed``.
    missing_input : MissingInput or None
        What the refitted model of the answer's block would need to follow the recordings (a torque,
        a force, a mass flow, an error of a reading): ``sentence``, ``argument``, ``share``,
        ``unit``, ``units``, and for each of ``recordings`` ``time``, ``value``, ``std``,
        ``arguments``, with ``law`` what a named effect takes of it; at most 400 points of each.
        None where nothing is missing, or it could not be followed.
    limits : list of Limit
        What the recordings could have shown, one entry for each effect that the rig can have:
        ``effect``, ``block``, ``recording``, ``seen`` and ``distance`` from ``rival`` at the
        ``typical`` value of ``size`` [standard deviations], ``seen_from`` and ``named_from``, SI.
    next_experiment : NextExperiment
        ``text``, ``excitation``, ``expected_information_bits``, ``pairs`` (what tells each two
        hypotheses that are left open apart: ``between``, ``text``, ``experiment``, ``noises``),
        ``instruction`` (what to record, alone), and ``ranking``, ``curves`` and ``protocol`` (its
        commands, ``protocol.to_csv()``) of what was simulated.
    data : list of RecordingUsed
        ``recording``, ``role``, ``source``, ``samples``, ``sample_time``, ``averaged`` (recorded
        samples in each), ``used`` channels, ``unused`` {channel: why} and ``masked`` {channel:
        share}, of each recording that was used.
    inputs : dict of str to str
        SHA-256 of each file that the case was read from, by its name; empty for arrays.
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
    free_traces : list of Trace
        Channels of the recording that the nominal model misses most from its commands alone:
        ``measured``, ``before`` and ``after``.
    blocks : list of BlockVerdict
        The verdict of each group of blocks: ``blocks`` (their names), ``verdict``,
        ``probabilities``, ``effects``, ``wrong_parameters``, ``ambiguity``, and ``mismatch``: for
        each block its ``channel``, ``unit``, and ``fitted`` and ``held_out`` {before, refit, after:
        {noises, size, more_than_noise}}, the residual above the noise, in units of the noise and in
        SI.
    budget : list of BudgetTerm
        What of the nominal model's excess over the noise each term takes on held-out recordings:
        ``block``, ``kind``, ``id``, ``form``, ``share`` with its ``interval``, ``probability``, and
        what the block keeps after it (``noises``, ``size``, ``unit``), ``at`` and ``parameters``.
    unexplained : list of Unexplained
        Blocks with a mismatch that stays unexplained: ``block``, ``channel``, ``unit``, ``noises``,
        ``size`` (SI), the ``verdict`` of their group, its ``share`` of the budget with
        ``interval``, the ``conditions`` under which it is largest, the ``form`` that carries
        over, in words, and the ``role`` of the recordings that show it.
    free_run : list of FreeRun or None
        The whole rig simulated from its commands alone, for each held-out recording (each fitted
        one where none was held out): ``recording``, ``role``, ``seconds``, ``channels`` {channel:
        {unit, before, after, cut_before, cut_after}}, root mean square errors with those of the
        cut chain, SI, and a ``note``. None where no recording has the commands;
        ``free_run_note`` says why.
    wrong_parameters : list of WrongParameter
        Values of the rig file that are wrong: ``name``, ``block``, ``nominal``, ``tolerance``,
        ``value``, ``std``, ``interval`` (95 %), ``unit``, ``moved_sigmas``, ``probability``, and
        ``held_out`` {channel: {before, refit, after}}, the error as in ``fit``, SI.
    measured : list of str
        Channels that every recording has.
    residuals : dict of str to BlockResidual
        {block: {rms, noise, excess, p_value, channel}}, residual of each block's refitted baseline
        against the noise level.
    timings : dict
        Seconds of each stage, optional.
    tried : list of Tried
        Every set of effects that was fitted: ``blocks``, ``effects``, what it leaves of each
        block's variance in units of the noise's (``fitted``, ``held_out``), ``gap_closed``, its
        ``values``.
    considered : list of Considered
        What ``consider`` asked for: ``names``, ``blocks``, ``probability``, and ``left``, the share
        of the mismatch that it leaves (None where a parameter of it stays inside its tolerances).
    tested : list of Tested
        Every persistent effect that acts where the mismatch is: ``id``, ``blocks``,
        ``predicted_gain``, the share of the mismatch that its signature could take before any fit,
        and ``left``, the share that it leaves fitted alone (None where the predicted gain is too
        small).
    settings : DiagnosisSettings
        What it was made with; the JSON holds what differs from the defaults, and ``version``.

    Raises
    ------
    ValueError
        If `verdict` is none of the allowed ones.
    """

    settings: DiagnosisSettings = field(default_factory=DiagnosisSettings)

    @property
    def settled(self) -> float:
        """Probability from which its answers are settled, as its settings have it."""
        return self.settings.settled

    @property
    def headline(self) -> str:
        """The verdict in one sentence."""
        return sentences.headline(self)

    def to_dict(self) -> dict[str, Any]:
        """Return the content of the JSON file: null for no number."""
        names = [
            f.name
            for f in dataclasses.fields(self)
            if f.metadata.get("json", True) and f.name != "settings"
        ]
        fields = {name: to_plain(getattr(self, name)) for name in names}
        made_by = {"settings": self.settings.to_dict(), "version": __version__}
        return {"schema": SCHEMA, "answer": to_plain(self.answer), **fields, **made_by}

    def to_json(self, path: str | os.PathLike[str] | None = None) -> str:
        """Return the result as strict JSON (schema `pamrs.diagnosis/2`).

        Parameters
        ----------
        path : path, optional
            File to write too; written under another name and renamed, so it is never half there.

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
        return summary(self)

    def __repr__(self) -> str:
        return f"Diagnosis({self.case!r}: {self.verdict}; {self.headline})"

    def report(self, path: str | os.PathLike[str]) -> Path:
        """Write the report, one HTML file that needs no network.

        Parameters
        ----------
        path : path-like
            The file.
        """
        return report.write_report(self, path)

    def pdf(self, path: str | os.PathLike[str]) -> Path:
        """Write the first screen of the report, one page of A4.

        Parameters
        ----------
        path : path-like
            The file.
        """
        return report.write_page(self, path)

    def figure(self, path: str | os.PathLike[str]) -> Path:
        """Write one picture of the diagnosis, a PNG of 1600 x 1000 pixels.

        Parameters
        ----------
        path : path-like
            The file.
        """
        return report.write_figure(self, path)

    def _panels(self) -> Panels:
        from pamrs.report.figures import telling_trace

        trace = telling_trace(self)
        shown: Panels = {} if trace is None else {trace.channel: partial(_draw_trace, trace=trace)}
        return shown if self.missing_input is None else shown | self.missing_input._panels()

    def _repr_html_(self) -> str:
        """Short HTML for notebooks, with the recording that shows most."""
        return notebook(self) + self._picture()


def _draw_trace(axes: Any, trace: Trace) -> None:
    """Draw a channel as measured, by the rig file's model, and by the model with what was found."""
    unit, factor = laboratory_unit(trace.channel)
    colours = ("black", *COLOURS[1::-1])
    kinds = ("measured", "before", "after")
    for kind, colour in zip(kinds, colours, strict=True):
        values = factor * getattr(trace, kind)
        axes.plot(trace.time, values, color=colour, lw=1.0, label=_CURVES[kind])
    axes.set_title(f"{trace.recording} ({trace.role})", fontsize="medium")
    axes.set_xlabel("time [s]")
    axes.set_ylabel(f"{trace.channel.replace('_', ' ')} [{unit}]")
    axes.legend(fontsize="small", frameon=False)


_CURVES: Final = {"measured": "measured", "before": "your model", "after": "with what was found"}


#: What a file does not keep.
_LIVE: Final = frozenset(
    f.name for f in dataclasses.fields(Diagnosis) if not f.metadata.get("json", True)
)


class _Read(Diagnosis):
    """A result that was read from a file: what the file does not keep is an error."""

    __hash__ = None  # type: ignore[assignment]

    def _repr_html_(self) -> str:
        return notebook(self)

    def __getattribute__(self, name: str) -> Any:
        if name in _LIVE:
            raise DiagnosisError(
                f"{name} is not kept in the file of a result: run pamrs.diagnose on the case again"
                + (" (or load the model that --model wrote)" if name == "rig" else "")
            )
        return super().__getattribute__(name)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Diagnosis):
            return NotImplemented
        return self.to_json() == other.to_json()


_NEEDED: Final = ("verdict", "where", "effects", "probabilities", "parameters", "fit")


def load_result(path: str | os.PathLike[str]) -> Diagnosis:
    """Read a result that `Diagnosis.to_json` or ``pamrs diagnose --json`` wrote.

    Parameters
    ----------
    path : path-like
        The file, or a folder with a ``result.json``.

    Returns
    -------
    Diagnosis
        With everything that JSON has: attributes, `summary()`, `headline`, `to_json()`. Of what it
        has not (`rig`, `traces`, `residuals`, `measured`, `timings`, `tried`,
        `tested`, and with these report and pictures) a DiagnosisError says what to do.

    Raises
    ------
    DiagnosisError
        If the file cannot be read, is no result, or is of a schema that is not known.

    Examples
    --------
    >>> import pamrs
    >>> pamrs.load_result("out/result.json").headline  # doctest: +SKIP
    'Missing is a leak of the muscle'
    """
    file = Path(path)
    if file.is_dir():
        file = file / "result.json"
    try:
        content = json.loads(file.read_text(encoding="utf-8"))
    except OSError as error:
        raise DiagnosisError(f"{file}: cannot be read ({error.strerror})") from None
    except (ValueError, RecursionError) as error:
        raise DiagnosisError(f"{file}: is not the JSON of a result ({error})") from None
    given = content.get("schema") if isinstance(content, dict) else None
    if given not in READABLE:
        raise DiagnosisError(
            f"{file}: schema = {given!r} is not allowed: {' or '.join(READABLE)} is needed"
        )
    missing = [key for key in _NEEDED if key not in content]
    if missing:
        raise DiagnosisError(f"{file}: is no complete result ({', '.join(missing)} is missing)")
    settings = content.pop("settings", {})
    try:
        values = {"case": file.absolute().parent.name} | fields_from(Diagnosis, content)
        return _Read(**values, settings=DiagnosisSettings.from_dict(settings))
    except (TypeError, ValueError, AttributeError) as error:
        raise DiagnosisError(f"{file}: is no complete result ({error})") from None
