"""``python -m benchmarks.gallery OUT --pages cases/gallery``: a page for every real recording.

Each page says what the rig is, what is not known of it, what the diagnosis makes of it (verdict and
budget), what would settle what is left open, and which experiment is next. Chambers and the arm are
diagnosed, cylinders and force maps are fitted. The recordings are read where they are; nothing of
them is written but the numbers on the pages.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import pamrs
from benchmarks.real import (
    CHAMBERS,
    LEAKING,
    arm_case,
    cylinder_budget,
    diagnosed,
    shown_budget,
    shown_errors,
    shown_values,
)
from cases.zillen_cylinders.compare import compare_friction_laws
from cases.zillen_cylinders.record import FrictionRecord, load_friction_folder
from pamrs.errors import PamrsError, RecordingError
from pamrs.fit import fit_map, fit_muscle, load_measured_muscle
from trial.summary import table

Say = Callable[[str], None]

MAPS = ("DMSP-20-300", "DMSP-10-250")
UNIT = 3.0
"""Assumed gauge pressure of the arm's scaled value 1 [bar]."""
ORDER = 4
INDEX = """# Real recordings, one page each

Recordings of others, read where they are and no part of this repository. Each page has the rig,
what is not known of it, the budget of the mismatch, what would settle what is left open, and the
next experiment. Made by

```
python -m benchmarks.gallery out/gallery --pages cases/gallery
```

"""


@dataclass(frozen=True)
class Page:
    """One recording: file of its page, title, one line for the index, and the text."""

    file: str
    title: str
    line: str
    text: str


def _page(title: str, **parts: str) -> str:
    """A page of the sections that every one has."""
    names = {
        "rig": "The rig",
        "unknown": "What is not known",
        "found": "What is found",
        "budget": "Budget",
        "settles": "What would settle it",
        "following": "Next experiment",
    }
    lines = [f"# {title}", ""]
    for key, heading in names.items():
        lines += [f"## {heading}", "", parts[key].strip(), ""]
    return "\n".join([*lines, "[All recordings](README.md)"]) + "\n"


def _sentences(given: Sequence[str]) -> str:
    return "\n".join(f"- {text}" for text in given)


def _free(rig: pamrs.Rig) -> list[str]:
    """What the rig file itself says it does not know."""
    unknown = [p.name for p in rig.parameters.values() if not p.known]
    wide = [
        f"{p.name} (to {100.0 * p.tol / abs(p.value):.0f} %)"
        for p in rig.parameters.values()
        if p.known and p.value and p.tol > 0.1 * abs(p.value)
    ]
    found = [f"Unknown to the rig file: {', '.join(unknown)}."] if unknown else []
    return found + ([f"Known roughly: {', '.join(wide)}."] if wide else [])


def _percent(share: float) -> str:
    return f"{100.0 * share:.{0 if share >= 0.1 else 1}f} %"


def _likely(told: dict[str, Any]) -> str:
    ranked = sorted(told["probabilities"].items(), key=lambda item: -item[1])
    return ", ".join(f"{name} {p:.2f}" for name, p in ranked[:3] if p > 0.005)


def _diagnosis(told: dict[str, Any]) -> str:
    values = shown_values(told)
    lines = [
        f"Verdict **{told['verdict']}** ({_likely(told)}).",
        told["where"]["text"] if told.get("where") else "",
        f"Values: {values}." if values != "-" else "",
        f"Error, noise / nominal / refitted / named: {shown_errors(told)}.",
    ]
    lines += [f"The diagnosis warns: {text}." for text in told["warnings"]]
    return _sentences([line for line in lines if line])


def _following(told: dict[str, Any], ours: str) -> str:
    text = told["next_experiment"]["text"]
    return f"The diagnosis: {text}\n\n{ours}"


# ------------------------------------------------------------------------ chambers


def chamber_page(name: str, case: pamrs.Case, told: dict[str, Any]) -> Page:
    """The page of one of the sealed chambers."""
    loses = name in LEAKING
    recording = case.recordings[0]
    pressure = recording.channels["muscle_pressure"][recording.mask["muscle_pressure"]]
    fall = 1.0 - float(pressure[-1] / pressure[0])
    settles = [
        "The volume, by filling it with water and weighing: only then a time constant becomes a "
        "conductance.",
        "A second hold from another pressure: the law of the leak (power of the pressure) is then "
        "predicted, not fitted."
        if loses
        else "Holds of the aluminium chamber on another day: the loss of the bench itself, "
        "cooling and drift of the transducer are the same in both, a leak is not.",
        "A thermometer on the wall: cooling after the fill has the same shape as a slow leak.",
    ]
    ours = (
        "Ours: fill to 3 bar and hold, and once more to 7.5 bar, each for ten time constants."
        if loses
        else "Ours: hold for an hour, since a leak goes on while cooling ends within minutes, and "
        "soap the fittings."
    )
    title = f"Sealed chamber {name}"
    return Page(
        f"chamber_{name}.md",
        title,
        f"loses {_percent(fall)} of {pressure[0] / 1e5:.3g} bar in "
        f"{recording.time[-1] - recording.time[0]:.0f} s: {told['verdict']} ({_likely(told)})",
        _page(
            title,
            rig="A chamber filled to about 7.5 bar and shut off, its pressure logged at 10 Hz "
            "(E. Zillen, TU Delft, 2021; CC0). No valve, no muscle: one gauge. "
            "[Rig and case](../zillen_chambers/README.md).",
            unknown=_sentences(
                [
                    *_free(case.rig),
                    "The temperature of the gas, and whether the fittings or the wall lose it.",
                    "Nothing is held out: there is one recording.",
                ]
            ),
            found=_diagnosis(told),
            budget=shown_budget(told) + ".",
            settles=_sentences(settles),
            following=_following(told, ours),
        ),
    )


# ----------------------------------------------------------------------- cylinders


def cylinder_page(name: str, records: Sequence[FrictionRecord]) -> Page:
    """The page of one cylinder."""
    told, laws = cylinder_budget(records), compare_friction_laws(records)
    (f0, s0), (f1, s1) = told["params"]["f0"], told["params"]["f1"]
    word = "named" if laws.settled else "not settled"
    budget = [
        f"{part}: {100 * value:.0f} % ({100 * low:.0f} to {100 * high:.0f})"
        for part, (value, low, high) in told["shares"].items()
    ]
    title = f"Cylinder {name}"
    verdict = (
        f"friction that depends on the pressure: probability {laws.pressure:.2f} "
        f"({laws.range[0]:.2f} to {laws.range[1]:.2f}), {word}"
    )
    return Page(
        f"cylinder_{name}.md",
        title,
        verdict,
        _page(
            title,
            rig="A printed cylinder whose piston is pulled to and fro by a test bench while a "
            "regulator holds 1 to 7 bar; force, position and pressure every 10 to 17 ms "
            "(E. Zillen, TU Delft, 2021; CC0). [Case](../zillen_cylinders/README.md).",
            unknown=_sentences(
                [
                    "The area of the piston and the zero of the load cell: both are fitted.",
                    "Each pressure ran once, and the speed falls as the pressure rises: speed and "
                    "pressure stand for each other.",
                ]
            ),
            found=_sentences(
                [
                    f"{verdict[0].upper()}{verdict[1:]}.",
                    f"Friction {f0:.2f} ± {s0:.2f} N plus {1e5 * f1:.2f} ± {1e5 * s1:.2f} N/bar.",
                    "Error of a pressure predicted by the others, noise / no friction / constant / "
                    f"linear: {told['noise']:.2f} / {told['before']:.2f} / {told['constant']:.2f} "
                    f"/ {told['after']:.2f} N.",
                ]
            ),
            budget=_sentences(budget),
            settles=_sentences(
                [
                    "The same speed at every pressure, then three speeds at one: pressure and "
                    "speed are told apart.",
                    "Each pressure on two days: what differs between them is the seal's state, and "
                    "no law has it.",
                ]
            ),
            following="Strokes of 2, 10 and 40 mm/s at 1, 4 and 7 bar, in random order, twice "
            "(18 runs). `pamrs diagnose` does not take cylinders; `cases/zillen_cylinders` does.",
        ),
    )


# ---------------------------------------------------------------------- force maps


def map_page(name: str, path: Path) -> Page:
    """The page of a force map: gas alone, a fitted model, and the map itself as the model."""
    measured = load_measured_muscle(path, allow_outside=True)
    data = measured.data
    gas, e, pull, _, _ = data.used_rows()
    alone = pull - measured.muscle.replace(model="gaylord").force(gas, e)
    fit = fit_muscle(
        data,
        measured.muscle,
        model="robinson",
        order=ORDER,
        free=["braid_angle", "rest_length"],
        tolerance=measured.tolerance,
        noise=measured.noise,
    )
    left = fit.leave_one_pressure_out()
    mapped = fit_map(data)
    size, most = float(np.mean(pull**2)), float(pull.max())
    before = float(np.mean(alone**2)) / size
    after = (left.rms * most) ** 2 / size
    fitted = (fit.rms_error * most) ** 2 / size
    title = f"Festo {name}"
    return Page(
        f"muscle_{name}.md",
        title,
        f"static force: order {ORDER} predicts a pressure left out within "
        f"{100 * left.max:.2f} % of the largest force",
        _page(
            title,
            rig="A fluidic muscle on a test bench: static forces over length and pressure "
            "(A. Martens and I. Boblan, Actuators 2017). "
            "[Map and description](../festo_dmsp/README.md).",
            unknown=_sentences(
                [
                    "The way of motion: one force for each length and pressure, so that hysteresis "
                    "is not in it.",
                    f"Forces below zero: {np.sum(~data.used)} of {len(data)} rows are clipped.",
                    "The layers of the hose, and its rest length to 1 %.",
                ]
            ),
            found=_sentences(
                [
                    f"`robinson` of order {ORDER}: {100 * fit.rms_error:.2f} % rms of the largest "
                    f"force; each pressure predicted by the others {100 * left.rms:.2f} % rms, "
                    f"{100 * left.max:.2f} % at most.",
                    f'The map itself as the model (`model = "map"`): rows scatter by '
                    f"{mapped.scatter:.2g} N about it, a pressure predicted by the others by "
                    f"{mapped.between:.3g} N; stated model error {100 * mapped.share:.2g} %.",
                    "The published model of the map's authors: 4.4 % (20 mm), 2.35 % (10 mm) at "
                    "most, on its own data.",
                ]
            ),
            budget=_sentences(
                [
                    f"Of the mean square of the force, gas in a braid leaves {100 * before:.1f} %.",
                    f"The hose's stress of order {ORDER} leaves {100 * fitted:.3f} % of it where "
                    f"it is fitted, {100 * after:.3f} % where a pressure is predicted.",
                ]
            ),
            settles=_sentences(
                [
                    "Both branches of slow cycles, with their direction: `pamrs fit friction`.",
                    "The braid's angle under a microscope: it moves by tolerances to take up what "
                    "the stress does not have.",
                ]
            ),
            following="Cycles over the whole length at 0, 1, 3 and 6 bar, 2 mm/s, force "
            "in both directions, with a load cell that reads below zero.",
        ),
    )


# ----------------------------------------------------------------------------- arm


def arm_page(case: pamrs.Case, told: dict[str, Any]) -> Page:
    """The page of the arm's base joint."""
    title = "Base joint of the arm pam_arm_shaj"
    return Page(
        "arm_pam_arm_shaj.md",
        title,
        f"two pressures in, one angle out, unit assumed as {UNIT:g} bar: {told['verdict']} "
        f"({_likely(told)})",
        _page(
            title,
            rig="A light arm of four joints and eight muscles that plays table tennis; the case "
            f"takes its base joint from {len(case.recordings)} short episodes, "
            f"{len(case.held_out)} of them held out (V. Shaj et al., CoRL 2020, on the arm of "
            "D. Buechler et al., 2016; MIT). [Case](../pam_arm_shaj/README.md).",
            unknown=_sentences(
                [
                    f"The unit of the pressures ({UNIT:g} bar for 1 is assumed) and the sample "
                    "rate (100 Hz, by inference).",
                    *_free(case.rig),
                    "Valves, tank and lines: no command and no flow is recorded.",
                ]
            ),
            found=_diagnosis(told),
            budget=shown_budget(told) + ".",
            settles=_sentences(
                [
                    "One sentence of the laboratory: the scale and offset of the transducers, and "
                    "the radius of the pulleys.",
                    "The joint held at one angle while the pressures rise and fall: friction of "
                    "the muscles without that of the joint.",
                    "Episodes of a minute with rests: creep needs longer than 1.2 s.",
                ]
            ),
            following=_following(
                told,
                "Ours: both pressures at 1 bar, one of them stepped by 0.2 bar up and down, ten "
                "seconds each, with 100 g at the end and without.",
            ),
        ),
    )


# --------------------------------------------------------------------------- whole


def pages(cases: Path, recordings: Path, out: Path, say: Say) -> list[Page]:
    """Diagnose and fit everything.

    Parameters
    ----------
    cases : Path
        The folder ``cases``; the recordings that it points to lie beside the project.
    recordings : Path
        Folder of the recordings.
    out : Path
        Gets the case of the arm.
    say : callable
        Told of every recording that is done.

    Raises
    ------
    ValueError
        If the recordings are not there.
    """
    zillen = recordings / "pneumatic_cylinders_zillen"
    if not zillen.is_dir():
        raise ValueError(
            f"{recordings}: the recordings are not there; cases/ says whence they come"
        )
    found: list[Page] = []
    for name in CHAMBERS:
        case = pamrs.load_case(cases / "zillen_chambers" / name, allow_outside=True)
        found.append(chamber_page(name, case, diagnosed(case, say)))
    folder = zillen / "results_pneumatic-actuator" / "data" / "friction"
    for name, records in load_friction_folder(folder).cylinders.items():
        try:
            found.append(cylinder_page(name, records))
        except RecordingError as error:
            say(f"{name}: not judged ({error})")
    found += [map_page(name, cases / "festo_dmsp" / f"{name}.toml") for name in MAPS]
    out.mkdir(parents=True, exist_ok=True)
    case = arm_case(cases, recordings, out, UNIT)
    found.append(arm_page(case, diagnosed(case, say)))
    return found


def write(folder: Path, found: Sequence[Page]) -> None:
    """Write the pages and their index."""
    folder.mkdir(parents=True, exist_ok=True)
    rows = [(f"[{page.title}]({page.file})", page.line) for page in found]
    for page in found:
        (folder / page.file).write_text(page.text, encoding="utf-8")
    index = INDEX + table(("recording", "what it comes to"), rows) + "\n"
    (folder / "README.md").write_text(index, encoding="utf-8")


def main(words: list[str] | None = None) -> int:
    """Run the command line; 0 when the pages are written, 2 when the input is wrong."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.gallery", description="A page for every real recording."
    )
    parser.add_argument("out", type=Path, help="folder for the arm's case")
    parser.add_argument("--cases", type=Path, default=Path("cases"), help="(default: cases)")
    parser.add_argument(
        "--recordings",
        type=Path,
        default=Path("../shared/recordings"),
        help="where they are (default: ../shared/recordings)",
    )
    parser.add_argument("--pages", type=Path, required=True, help="folder of the pages")
    args = parser.parse_args(words)

    def say(text: str) -> None:
        print(text, file=sys.stderr, flush=True)

    try:
        write(args.pages, pages(args.cases, args.recordings, args.out, say))
    except (PamrsError, ValueError, OSError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    print(f"written: {args.pages}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
