"""``python -m benchmarks.recordings OUT --page PAGE``: what the diagnosis says about the recordings
of others, as one page of budgets.

Seven sealed chambers and four cylinders (Zillen, TU Delft), the base joint of a four-joint arm
(Shaj et al., on the arm of Buechler et al.) and a ventilator's test lung (RespiraWorks). The
recordings are read where they are; nothing of them is written. No key exists: what is known of a
rig is a sentence, and the mark is ``right``, ``partly``, ``wrong`` or ``cannot tell``.
"""

from __future__ import annotations

import argparse
import importlib.util
import json
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

import pamrs
from benchmarks.pages import written
from cases.zillen_cylinders.compare import compare_friction_laws
from cases.zillen_cylinders.laws import fit_cylinder_friction
from cases.zillen_cylinders.record import FrictionRecord, load_friction_folder
from pamrs.diagnosis import DiagnosisSettings
from pamrs.diagnosis.fit import Problem, residuals
from pamrs.diagnosis.prepare import available_blocks, prepare
from pamrs.errors import PamrsError, RecordingError
from pamrs.findings import HEALTHY
from pamrs.recordings import Case
from pamrs.simulation import core_rig
from trial.summary import table

Array = NDArray[np.float64]
Say = Callable[[str], None]

LEAKING = ("Ultimaker_015", "Ultimaker_020")
CHAMBERS = (*LEAKING, "Prusa", "Ultimaker_010", "Ultimaker_006", "Formlabs", "Aluminium")
UNITS = (3.0, 1.5, 6.0)
"""Assumed gauge pressures of the arm's scaled value 1 [bar]; nothing documents it."""
ARM = "pam_arm_shaj"
LUNGS = "respiraworks"
VENTILATOR = "RespiraWorks_Ventilator"
"""Checkout or git directory of the ventilator's authors, in the folder of the recordings."""
KNOWN = {
    "wrong_resistor": ("Rp 5 instead of the noted Rp 20", ("line.discharge_area",)),
    "missing_setting": ("10 cmH2O/(l/s) noted, Rp 20 used", ("line.discharge_area",)),
    "unit_new": ("kPa under a heading of cmH2O", ("kPa",)),
    "unit_old": ("kPa under a heading of cmH2O", ("kPa",)),
    "hose_off": ("the hose is off for a few breaths", ("leak_muscle",)),
    "obstruction": ("the resistor is shut for some seconds", ("tube_flow_restriction",)),
    "flow_drift": ("the zero of the flow meters", ("gauge_drift",)),
}
"""What the authors wrote of the lung's recordings, and the right answers; of others nothing."""
PARTLY = ("line.discharge_area", "line_flow_law", "tube_flow_restriction")
"""Names at the resistor: where it is another one, the place is right and the name is not."""
FRICTION = ("arm.viscous", "arm.coulomb")
WALL = 2.9
"""Tolerances from which a parameter counts as being at its wall, which is at 3."""
DRAWS, SEED = 2000, 20261123
HEAD = (
    "recording",
    "verdict (probabilities)",
    "budget, with intervals of 95 %",
    "values",
    "error: noise / nominal / refitted / named",
    "s",
)


# ------------------------------------------------------------------------- running


def diagnosed(case: Case, say: Say) -> dict[str, Any]:
    """Diagnose a case; its result as plain data, with the seconds of the clock."""
    began = time.perf_counter()
    told: dict[str, Any] = json.loads(pamrs.diagnose(case).to_json())
    told["clock"] = time.perf_counter() - began
    say(f"{case.name}: {told['verdict']}, {told['clock']:.0f} s")
    return told


def converter(folder: Path) -> ModuleType:
    """The module ``convert.py`` of a folder of `cases`."""
    spec = importlib.util.spec_from_file_location(folder.name, folder / "convert.py")
    if spec is None or spec.loader is None:
        raise ValueError(f"{folder}: convert.py is missing")
    module = importlib.util.module_from_spec(spec)
    sys.modules[folder.name] = module
    spec.loader.exec_module(module)
    return module


def arm_case(cases: Path, recordings: Path, out: Path, unit: float) -> Case:
    """The case of the arm's base joint with an assumed unit of pressure [bar], written to `out`."""
    folder, data = out / f"arm_{unit:g}", recordings / ARM / "data" / "PAMData" / "Data2"
    converter(cases / ARM).convert(folder, unit_bar=unit, rate=100.0, data=data)
    return pamrs.load_case(folder)


def lung_tables(cases: Path, repository: Path, out: Path, say: Say) -> tuple[str, str]:
    """Answers and marks of the test lung's recordings; that they are not there, where it is so."""
    if not repository.exists():
        say(f"{repository}: not there, the lung's recordings are left out")
        return "The recordings were not there when this page was made.", ""
    rows: list[tuple[str, ...]] = []
    marks: list[tuple[str, str]] = []
    for name in converter(cases / LUNGS).convert(repository, out / LUNGS):
        try:
            told = diagnosed(pamrs.load_case(out / LUNGS / name), say)
        except PamrsError as error:
            refusal = str(error).partition(": are ")[0].rpartition("nothing was fitted: ")[2]
            rows.append((name, f"refused: {refusal}", "-", "-", "-", "-"))
            marks.append((name, lung_mark(name, None)))
            continue
        (out / f"{name}.json").write_text(json.dumps(told), encoding="utf-8")
        rows.append(_row(name, told))
        marks.append((name, lung_mark(name, told)))
    return table(HEAD, rows), table(("recording", "known, and the mark"), marks)


def shares_of_parameters(case: Case, told: dict[str, Any]) -> dict[str, float]:
    """What friction and the other parameters inside their tolerances take of the held-out error.

    Parameters
    ----------
    case : Case
        With recordings that are held out.
    told : dict
        Its result; ``parameters`` are the refitted values.

    Returns
    -------
    dict of str to float
        ``friction`` and ``other``: shares of the nominal mean square above the noise [1], means
        over both orders of adding them.
    """
    settings = DiagnosisSettings()
    held = [prepare(r, case.rig, settings) for r in case.held_out]
    blocks = list(available_blocks(case.rig, case.channels))
    problem = Problem(blocks, held, core_rig(case.rig), settings)
    values = {name: float(entry["value"]) for name, entry in told["parameters"].items()}
    friction = {n: v for n, v in values.items() if n in FRICTION}
    other = {n: v for n, v in values.items() if n not in FRICTION}

    def left(chosen: dict[str, float]) -> float:
        found = residuals(problem, case.rig.with_parameters(chosen)).values()
        return float(np.mean(np.concatenate([r.value[r.rows] for r in found]) ** 2))

    none, rubbed, rest, both = (left(c) for c in ({}, friction, other, values))
    noise = float(next(iter(told["fit"]["held_out"].values()))["noise"]) ** 2
    return {
        "friction": 0.5 * (none - rubbed + rest - both) / (none - noise),
        "other": 0.5 * (none - rest + rubbed - both) / (none - noise),
    }


# ----------------------------------------------------------------------- cylinders


def cylinder_budget(records: Sequence[FrictionRecord]) -> dict[str, Any]:
    """Budget of the friction of one cylinder; every pressure is predicted from the others.

    Returns
    -------
    dict
        ``before``, ``constant``, ``after``: root mean square of the force that the piston's area
        times the pressure leaves, of what a constant friction leaves, and of what one linear in the
        pressure leaves; ``noise``: that of the means [N]. ``shares``: of the mean square, each with
        an interval of 95 % from drawing pressures with replacement.
    """
    linear = fit_cylinder_friction(records)
    held = {
        law: {
            item.level.name: item
            for item in fit_cylinder_friction(records, law=law).leave_one_pressure_out()
        }
        for law in ("constant", "linear")
    }
    names = sorted(set(held["constant"]) & set(held["linear"]))
    force = np.array([held["linear"][n].level.friction for n in names])
    flat, line = (np.array([held[law][n].error for n in names]) for law in ("constant", "linear"))
    noise = np.array([held["linear"][n].level.stderr for n in names])
    squares = np.column_stack([force, flat, line, noise]) ** 2

    def shares(rows: Array) -> Array:
        whole, constant, with_pressure, floor = rows.mean(axis=0)
        kept = min(floor, with_pressure)
        parts = (whole - constant, constant - with_pressure, with_pressure - kept, kept)
        found: Array = np.array(parts) / whole
        return found

    drawn = np.random.default_rng(SEED).integers(0, len(names), (DRAWS, len(names)))
    ends = np.percentile([shares(squares[row]) for row in drawn], [2.5, 97.5], axis=0)
    words = ("constant friction", "friction that grows with pressure", "unexplained", "noise")
    middle = shares(squares)
    size = np.sqrt(squares.mean(axis=0))
    return {
        "shares": {w: (middle[i], ends[0][i], ends[1][i]) for i, w in enumerate(words)},
        "before": size[0], "constant": size[1], "after": size[2], "noise": size[3],
        "params": {n: (p.value, p.stderr) for n, p in linear.params.items()},
    }  # fmt: skip


def cylinder_rows(folder: Path) -> list[tuple[str, ...]]:
    """A line of the page for each cylinder whose runs are in a folder."""
    found: list[tuple[str, ...]] = []
    for name, records in load_friction_folder(folder).cylinders.items():
        began = time.perf_counter()
        try:
            told, laws = cylinder_budget(records), compare_friction_laws(records)
        except RecordingError as error:
            found.append((name, f"not judged: {error}", "-", "-", "-", "-"))
            continue
        word = "named" if laws.settled else "not settled"
        budget = "; ".join(
            f"{n} {_percent(v)} ({_percent(low)} to {_percent(high)})"
            for n, (v, low, high) in told["shares"].items()
        )
        (f0, s0), (f1, s1) = told["params"]["f0"], told["params"]["f1"]
        values = f"{f0:.2f} ± {s0:.2f} N; {1e5 * f1:.2f} ± {1e5 * s1:.2f} N/bar"
        sizes = [told[n] for n in ("noise", "before", "constant", "after")]
        low, high = laws.range
        law = f"depends on pressure {laws.pressure:.2f} ({low:.2f} to {high:.2f}): {word}"
        errors = " / ".join(f"{v:.2f}" for v in sizes) + " N"
        spent = f"{time.perf_counter() - began:.0f}"
        found.append((name, law, budget, values, errors, spent))
    return found


# --------------------------------------------------------------------------- words


def _percent(share: float) -> str:
    text = f"{100.0 * share:.0f}"
    return f"{'0' if text == '-0' else text} %"


def shown_budget(told: dict[str, Any]) -> str:
    """The budget of a result in words."""
    names = {"parameters": "parameters inside tolerance", "form": "a form without a name"}
    parts = []
    for term in told["budget"]:
        form = f" ({term['form']})" if term["form"] else ""
        word = names.get(term["kind"], term["id"] or term["kind"]) + form
        ends = " to ".join(_percent(v) for v in term["interval"])
        parts.append(f"{word} {_percent(term['share'])} ({ends})")
        if term["kind"] == "unexplained":
            parts[-1] += f", {term['noises']:.2g} noises"
    return "; ".join(parts)


def shown_values(told: dict[str, Any]) -> str:
    """The values of what is named, and parameters at their wall."""
    parts = []
    for effect in told["effects"] if told["verdict"] == "effects" else []:
        for name, entry in effect["parameters"].items():
            if entry.get("interval") and entry["identifiable"]:
                low, high = entry["interval"]
                parts.append(
                    f"{name} {entry['value']:.3g} ({low:.3g} to {high:.3g}) {entry['unit']}"
                )
    for name, entry in told["parameters"].items():
        if abs(entry["moved_sigmas"]) >= WALL:
            parts.append(f"{name} at its wall, {entry['moved_sigmas']:+.1f} tolerances")
    return "; ".join(parts) or "-"


def shown_errors(told: dict[str, Any]) -> str:
    """Noise, nominal, refitted and named error of each channel."""
    held = told["fit"]["held_out"]
    parts = []
    for channel, e in (held or told["fit"]["channels"]).items():
        factor, unit = (1e3, "mrad") if "angle" in channel else (1e-3, "kPa")
        sizes = (e[n] * factor for n in ("noise", "before", "refit", "after"))
        parts.append(" / ".join(f"{v:.3g}" for v in sizes) + f" {unit}")
    return "; ".join(parts) + ("" if held else " (fitted)")


def _row(name: str, told: dict[str, Any]) -> tuple[str, ...]:
    ranked = sorted(told["probabilities"].items(), key=lambda item: -item[1])
    likely = ", ".join(f"{n} {p:.2f}" for n, p in ranked[:3] if p > 0.005)
    return (
        name,
        f"{told['verdict']} ({likely})",
        shown_budget(told),
        shown_values(told),
        shown_errors(told),
        f"{told['clock']:.0f}",
    )


def chamber_mark(name: str, told: dict[str, Any]) -> str:
    """What is known of a chamber, and whether the answer agrees."""
    named = [e["id"] for e in told["effects"]] if told["verdict"] == "effects" else []
    if name in LEAKING:
        good = named == ["leak_muscle"]
        return f"loses all its pressure within the recording: **{'right' if good else 'wrong'}**"
    if named:
        return "holds, with a loss that aluminium shows too: **wrong**, a cause is named"
    return (
        "holds, with a loss of 0.4 to 1.4 % that aluminium shows too: **cannot tell**, as it says"
    )


def lung_mark(name: str, told: dict[str, Any] | None) -> str:
    """What the authors wrote of a recording, and whether the answer, None if refused, agrees."""
    known, right = KNOWN.get(name, ("nothing is wrong", ()))
    if told is None:
        return f"{known}: **cannot tell**, refused"
    first = max(told["probabilities"], key=told["probabilities"].get, default="")
    if told["verdict"] == "units":
        first = told["misread"][0]["likely"]
    if first in right or (not right and told["verdict"] in HEALTHY):
        return f"{known}: **right**"
    if first in PARTLY and set(right) & set(PARTLY):
        return f"{known}: **partly**, the resistor by another name"
    if told["laws"]:
        return f"{known}: **wrong**, {told['laws'][0]['name']} is called another"
    if first == "unlisted":
        return f"{known}: **cannot tell**, something without a name"
    return f"{known}: **wrong**, {first} is named first"


# ---------------------------------------------------------------------------- page


def arm_text(told: dict[float, dict[str, Any]], parts: dict[float, dict[str, float]]) -> str:
    """What the budgets of the arm under several units say."""
    size = {u: next(iter(d["fit"]["held_out"].values())) for u, d in told.items()}
    nominal = [1e3 * e["before"] for e in size.values()]
    refit = [1e3 * e["refit"] for e in size.values()]
    hangs = (max(refit) ** 2 - min(refit) ** 2) / nominal[0] ** 2
    inertia = ", ".join(
        f"{d['parameters']['arm.inertia']['value']:.2f} at {u:g} bar" for u, d in told.items()
    )
    split = "; ".join(
        f"{u:g} bar: friction {_percent(p['friction'])}, others {_percent(p['other'])}"
        for u, p in parts.items()
    )
    walls = sorted(
        {
            name
            for d in told.values()
            for name, entry in d["parameters"].items()
            if abs(entry["moved_sigmas"]) >= WALL
        }
    )
    named = [u for u, d in told.items() if d["verdict"] == "effects"]
    verdicts = ", ".join(f"{u:g} bar: {d['verdict']}" for u, d in told.items())
    answer = (
        "**cannot tell**, as it says" if not named else "**wrong**: a guess of the unit names it"
    )
    return written(
        "arm",
        split=split,
        nominal_low=min(nominal),
        nominal_high=max(nominal),
        refit_low=min(refit),
        refit_high=max(refit),
        hangs=_percent(hangs),
        first=next(iter(told)),
        walls=", ".join(walls) or "nothing",
        inertia=inertia,
        verdicts=verdicts,
        answer=answer,
    )


def page(cases: Path, recordings: Path, out: Path, say: Say, units: Sequence[float] = UNITS) -> str:
    """Diagnose everything and return the page.

    Parameters
    ----------
    cases : Path
        The folder ``cases``; the recordings that it points to lie beside the project.
    recordings : Path
        Folder of the recordings.
    out : Path
        Gets the arm's cases and every result as JSON.
    say : callable
        Told of every case that is done.
    units : sequence of float
        Units of pressure that are assumed for the arm [bar].

    Raises
    ------
    ValueError
        If the recordings are not there.
    """
    zillen = recordings / "pneumatic_cylinders_zillen"
    if not zillen.is_dir() or not (recordings / ARM).is_dir():
        raise ValueError(
            f"{recordings}: the recordings are not there; cases/ says whence they come"
        )
    out.mkdir(parents=True, exist_ok=True)
    chambers, arms, parts = {}, {}, {}
    for name in CHAMBERS:
        case = pamrs.load_case(cases / "zillen_chambers" / name, allow_outside=True)
        chambers[name] = diagnosed(case, say)
    for unit in units:
        case = arm_case(cases, recordings, out, unit)
        arms[unit] = diagnosed(case, say)
        parts[unit] = shares_of_parameters(case, arms[unit])
    for key, told in [*chambers.items(), *((f"arm_{u:g}_bar", d) for u, d in arms.items())]:
        (out / f"{key}.json").write_text(json.dumps(told), encoding="utf-8")
    lungs, lungs_known = lung_tables(cases, recordings / VENTILATOR, out, say)
    rubbing = cylinder_rows(zillen / "results_pneumatic-actuator" / "data" / "friction")
    known = [(name, chamber_mark(name, told)) for name, told in chambers.items()]
    return written(
        "recordings",
        chambers=table(HEAD, [_row(n, d) for n, d in chambers.items()]),
        known=table(("chamber", "known, and the mark"), known),
        cylinders=table(("cylinder", *HEAD[1:4], "held-out error", "s"), rubbing),
        arms=table(("assumed unit", *HEAD[1:]), [_row(f"{u:g} bar", d) for u, d in arms.items()]),
        arm=arm_text(arms, parts),
        lungs=lungs,
        lungs_known=lungs_known,
    )


def main(words: list[str] | None = None) -> int:
    """Run the command line; 0 when the page is written, 2 when the input is wrong."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.recordings", description="Budgets of the recordings of others."
    )
    parser.add_argument("out", type=Path, help="folder for the arm's cases and the results")
    parser.add_argument("--cases", type=Path, default=Path("cases"), help="(default: cases)")
    parser.add_argument(
        "--recordings",
        type=Path,
        default=Path("../shared/recordings"),
        help="where they are (default: ../shared/recordings)",
    )
    parser.add_argument("--page", type=Path, required=True, help="the page")
    args = parser.parse_args(words)

    def say(text: str) -> None:
        print(text, file=sys.stderr, flush=True)

    try:
        text = page(args.cases, args.recordings, args.out, say)
        args.page.write_text(text, encoding="utf-8")
    except (PamrsError, ValueError, OSError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    print(f"written: {args.page}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
