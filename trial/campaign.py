"""Campaigns on the independent plant: it answers the commands that `pamrs campaign` asks for, run
by run, beside random multisines and a fixed protocol.

A case begins with one poor free log of 30 s of a concealed plant. `pamrs campaign --step` sees rig
file and log alone, and writes the commands of a run; the plant plays them, and the next call takes
the recording. The same plant is recorded with random multisines as long as those runs, and with a
fixed protocol; `pamrs diagnose` judges those. After 0 to 3 runs each result is right, wrong or
open. Keys are drawn, and their digests written, before any of that; everything that is there is
kept, so that a trial that was stopped goes on.
"""

from __future__ import annotations

import itertools
import json
import math
import multiprocessing
import os
import subprocess
import sys
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from .bench import still
from .cases import Concealed, concealed, make
from .concealed import case_toml, store, stored_key, write
from .design import ROUND, THIRD, Spec, specs
from .drive import FREE
from .excitation import Loop
from .labs import Lab, table
from .marks import HEALTHY, distance_of, family, mark, opened
from .pair.places import SIDES
from .plan import MANIFEST, SCHEMA
from .recording import Array
from .rig_kinds import PAIR
from .rig_kinds import RIGS as RIG_KINDS
from .summary import table as rows_of
from .summary import wilson

RUNS: Final = 3
ARMS: Final = ("campaign", "multisine", "standard")
STANDARD: Final = ("sealed_holds", "slow_triangle", "angle_steps")
STATES: Final = ("right", "wrong", "open")
#: columns of the page, and the entries of a mark that they count
_MARKS: Final = {
    "first names": "leading",
    "sets": "holds",
    "blocks": "located",
    "wrong values": "wrong",
    "false names": "false_name",
}
#: distance to the nearest rival from which the limits call a case decidable [standard deviations]
_DECIDABLE: Final = 4.0
#: share of the highest pressure recorded before above which a run broke its limit of 1.05
_BROKEN: Final = 1.1
RIGS: Final = ("shoulder", "elbow", "hanging_mass", "regulated_joint", PAIR)
#: what happens once in each recording that was planned, and in no other one
_EVENTS: Final = ("external_torque", "payload_change")
_SECONDS: Final = 30.0
_RATE: Final = 100
#: Time after which one call of pamrs is given up [s].
TIMEOUT: Final = 3600.0


def specs_of_campaigns(seed: int, cases: int, rigs: Sequence[str] = RIGS) -> list[Spec]:
    """The first cases: those of the third plan on some rigs, each with one free log."""
    found: list[Spec] = []
    every = 0
    while len(found) < cases:
        every += 4 * ROUND
        found = [spec for spec in specs(seed, every, _SECONDS, THIRD) if _is_taken(spec, rigs)]
    return [
        replace(
            spec,
            name=f"campaign_{k:04d}",
            lab=Lab(_RATE, max(spec.lab.bits, 12), one=True),
            recordings=((FREE, "fit"),),
        )
        for k, spec in enumerate(found[:cases], 1)
    ]


def _is_taken(spec: Spec, rigs: Sequence[str]) -> bool:
    """Whether a case is on one of some rigs, and the same in each of its recordings."""
    return spec.rig in rigs and not any(label.split("/")[0] in _EVENTS for label in spec.forms)


class _Case:
    """One case at work: its plant, its folders."""

    def __init__(self, out: Path, spec: Spec) -> None:
        self.spec, self.case = spec, out / "cases" / spec.name
        self.work, self.results = out / "work" / spec.name, out / "results" / spec.name
        self._drawn: Concealed | None = None
        self.work.mkdir(parents=True, exist_ok=True)
        self.results.mkdir(parents=True, exist_ok=True)

    @property
    def drawn(self) -> Concealed:
        """What the case conceals; drawn when it is needed."""
        if self._drawn is None:
            self._drawn = concealed(self.spec)
        return self._drawn

    def recorded(self, index: int, drive: Any, own: np.random.Generator) -> str:
        """A run of the plant as a log: of a controller, or of commands."""
        drawn, bench = self.drawn, self.drawn.bench
        plant = bench.plant(bench.par, [*drawn.effects, *drawn.errors])
        sigma = bench.tolerance.get("supply.initial_pressure", 0.0)
        supply = bench.begins(0) + float(own.uniform(-1.0, 1.0)) * sigma
        record = bench.record(plant, drive, supply, index, own)
        rest = float(bench.true.get("muscle", {}).get("rest_length", 0.0))
        return table(record, bench.rig, self.spec.lab, [], rest)[0]

    def played(self, index: int, commands: Path) -> str:
        """Commands of a file, played on the plant."""
        sent = _Sent(commands)
        step = self.drawn.bench.step
        times = np.arange(round(sent.time[-1] / step) + 1) * step
        held = np.searchsorted(sent.time, times + 1e-6, side="right") - 1
        places = SIDES if self.spec.rig == PAIR else ("",)
        columns = [[Loop.quantise(v) for v in sent.of(at)[held].tolist()] for at in places]
        values = np.column_stack(columns) if len(places) > 1 else np.array(columns[0])
        own = np.random.default_rng([self.spec.seed, index, 79])
        return self.recorded(index, still(values), own)

    def driven(self, index: int, name: str, seconds: float) -> str:
        """A course of the trial, with its controller."""
        own = np.random.default_rng([self.spec.seed, index, 81])
        drive = self.drawn.bench.drive(name, own, seconds)
        return self.recorded(index, drive, own)

    def steps(self) -> list[dict[str, Any]]:
        """The steps of the arm that chooses its runs, as far as it went."""
        state = self.work / "campaign" / "campaign.json"
        return json.loads(state.read_text(encoding="utf-8"))["steps"] if state.is_file() else []

    def lengths(self) -> list[float]:
        """How long each run of that arm was, of those that are judged [s]."""
        return [float(step["seconds"]) for step in self.steps() if step["changed"] is not None]

    def result(self, arm: str, count: int) -> Path:
        """Where the result of an arm after some runs is kept."""
        return self.results / f"{arm}_{count}.json"

    def keep(self, arm: str, count: int, found: Path, seconds: float) -> None:
        """Keep a result, with the time at the bench that it took."""
        told = json.loads(found.read_text(encoding="utf-8")) if found.is_file() else None
        write(self.result(arm, count), json.dumps({"seconds": seconds, "result": told}) + "\n")


class _Sent:
    """Commands of a file: times [s], and by their headings volts, or bar of a regulator."""

    def __init__(self, file: Path) -> None:
        head = file.read_text(encoding="utf-8").split("\n", 1)[0]
        self.names = [cell.split(" [")[0] for cell in head.split(",")[1:]]
        self.units = [cell.rpartition("[")[2].rstrip("]") for cell in head.split(",")[1:]]
        rows = np.loadtxt(file, delimiter=",", skiprows=1, ndmin=2)
        self.time, self.values = rows[:, 0], rows[:, 1:]

    def of(self, place: str) -> Array:
        """Command of the valve at a place of a pair, or of the one that there is."""
        at = next(k for k, name in enumerate(self.names) if name.endswith(place))
        return self.values[:, at] * {"Pa": 1.0e-5, "kPa": 1.0e-2}.get(self.units[at], 1.0)


def _pamrs(words: Sequence[str | Path], log: Path) -> int:
    """Run pamrs in a process of its own; what it says goes to a file."""
    with log.open("a", encoding="utf-8") as stream:
        call = [sys.executable, "-m", "pamrs", *map(str, words)]
        try:
            done = subprocess.run(
                call, stdout=stream, stderr=stream, timeout=TIMEOUT, check=False, env=_quiet()
            )
        except subprocess.TimeoutExpired:
            stream.write(f"given up after {TIMEOUT:g} s\n")
            return -1
    return done.returncode


def _quiet() -> dict[str, str]:
    """The environment with one thread for each process."""
    return {**os.environ, "OPENBLAS_NUM_THREADS": "1", "MPLBACKEND": "Agg"}


def _campaign(case: _Case) -> None:
    """The arm that chooses its runs."""
    home, log = case.work / "campaign", case.work / "campaign.log"
    free, rig = case.case / f"{FREE}.csv", case.work / "rig.toml"
    told = (case.case / "rig.toml").read_text(encoding="utf-8")
    if case.spec.rig == "regulated_joint":  # somebody has to say how far it may be set
        most = RIG_KINDS[case.spec.rig].most
        told += f'\n[limits]\nmax_pressure = {{ value = {most}, unit = "Pa" }}\n'
    write(rig, told)
    words: list[str | Path] = ["campaign", rig, "--log", free, "--out", home]
    words += ["--step", "--unattended", "--minutes", "60", "--air", "1e6", "--runs", str(RUNS)]
    ended = case.result("campaign", RUNS).is_file()
    for count in range(RUNS + 1):
        if not ended and _pamrs(words, log):
            break
        steps, lengths = case.steps(), case.lengths()
        if not case.result("campaign", count).is_file():
            # one that ended before says after more runs what it said last
            own = home / f"step_{count:02d}" if 0 < count <= len(lengths) else home
            case.keep("campaign", count, own / "result.json", sum(lengths[:count]))
        ended = ended or len(steps) == len(lengths)
        if not ended:
            folder = home / f"step_{len(steps):02d}"
            log_of_run = case.played(len(steps), folder / "commands.csv")
            write(folder / "recording.csv", log_of_run)
    for count in range(RUNS + 1):  # of a call that failed there is none
        if not case.result("campaign", count).is_file():
            case.keep("campaign", count, case.work / "none", 0.0)


def _other(case: _Case, arm: str) -> None:
    """An arm whose runs do not depend on what was found, as long as those that were chosen."""
    home, lengths = case.work / arm, case.lengths()
    names, total = [FREE], 0.0
    home.mkdir(exist_ok=True)
    for own in ("rig.toml", f"{FREE}.csv"):
        write(home / own, (case.case / own).read_text(encoding="utf-8"))
    # the free log alone is the same in every arm
    write(case.result(arm, 0), case.result("campaign", 0).read_text(encoding="utf-8"))
    for count in range(1, RUNS + 1):
        kind = STANDARD[count - 1] if arm == "standard" else "multisine"
        seconds = lengths[count - 1] if count <= len(lengths) else _SECONDS
        names.append(f"run_{count}_{kind}")
        total += seconds
        file = home / f"{names[-1]}.csv"
        if not file.is_file():
            index = 10 * (1 + ARMS.index(arm)) + count
            write(file, case.driven(index, kind, seconds))
        if case.result(arm, count).is_file():
            continue
        write(home / "case.toml", case_toml([(name, "fit") for name in names]))
        found = home / f"result_{count}.json"
        _pamrs(["diagnose", home, "--json", found], case.work / f"{arm}.log")
        case.keep(arm, count, found, total)


def run_case(given: tuple[Path, Spec]) -> str:
    """All arms of one case, as far as they are not there."""
    out, spec = given
    case = _Case(out, spec)
    _campaign(case)
    for arm in ARMS[1:]:  # they are as long as the first
        _other(case, arm)
    return spec.name


def trial_of_campaigns(
    out: Path, wanted: Sequence[Spec], jobs: int, say: Callable[[str], None]
) -> None:
    """Write keys, digests and free logs, then run every case in all arms; what is there is kept."""
    manifest = out / MANIFEST
    digests: dict[str, str] = {}
    if manifest.is_file():
        digests = json.loads(manifest.read_text(encoding="utf-8"))["keys"]
    for spec in wanted:
        told = stored_key(out, spec.name, [FREE], digests)
        if told is not None and told["spec"] == json.loads(json.dumps(spec.to_dict())):
            continue
        made = make(spec)
        digests[spec.name] = made.digest()
        text = json.dumps({"schema": SCHEMA, "keys": dict(sorted(digests.items()))}, indent=1)
        write(manifest, text + "\n")
        write(out / "keys" / f"{spec.name}.json", made.key)
        store(made, out / "cases")
        say(f"{spec.name}: concealed")
    work = [(out, spec) for spec in wanted]
    with multiprocessing.get_context("spawn").Pool(min(jobs, len(work))) as pool:
        for name in pool.imap_unordered(run_case, work):
            say(f"{name}: done")


def is_right(key: dict[str, Any], result: dict[str, Any]) -> bool:
    """Whether all that a result names is concealed, and something is named where something with a
    name is; `unlisted` where what is missing has none; nothing where nothing is.
    """
    truth = opened(key)
    said = {family(e["id"]) for e in result["effects"]} if result["verdict"] == "effects" else set()
    said |= {own["name"] for own in result["wrong_parameters"]}
    there = truth.names | set(truth.wrong)
    if there:
        return bool(said) and said <= there
    if truth.unlisted or key["verdict"] == "unlisted":
        return not said and result["verdict"] == "unlisted"
    return not said and result["verdict"] in HEALTHY


def state_of(key: dict[str, Any], result: dict[str, Any] | None) -> str:
    """A result is open where it says that it is not settled, else right or wrong; wrong without."""
    if result is None:
        return "wrong"
    if not result["answer"]["settled"]:
        return "open"
    return "right" if is_right(key, result) else "wrong"


def scored(out: Path, names: Sequence[str]) -> dict[str, list[dict[str, Any]]]:
    """By arm and number of runs: states, marks as (right, asked), and the time at the bench."""
    found: dict[str, list[dict[str, Any]]] = {arm: [] for arm in ARMS}
    keys = {n: json.loads((out / "keys" / f"{n}.json").read_text(encoding="utf-8")) for n in names}
    for arm, count in itertools.product(ARMS, range(RUNS + 1)):
        states, decidable, seconds, own = [], [], [], []
        for name, key in keys.items():
            file = out / "results" / name / f"{arm}_{count}.json"
            if not file.is_file():
                continue
            told = json.loads(file.read_text(encoding="utf-8"))
            states.append(state_of(key, told["result"]))
            own.append(mark(key, told["result"]))
            seconds.append(float(told["seconds"]))
            if (distance_of(key, told["result"]) or 0.0) >= _DECIDABLE:
                decidable.append(states[-1])
        row: dict[str, Any] = {state: states.count(state) for state in STATES}
        row["decidable"] = decidable.count("right"), len(decidable)
        row["decidable wrong"] = decidable.count("wrong"), len(decidable)
        for column, entry in _MARKS.items():
            asked = [value for one in own if (value := getattr(one, entry)) is not None]
            row[column] = sum(map(bool, asked)), len(asked)
        inside = [held for one in own for held in one.inside]
        row["intervals"] = sum(inside), len(inside)
        row["seconds"] = float(np.mean(seconds)) if seconds else math.nan
        found[arm].append(row)
    return found


def highest(out: Path, names: Sequence[str]) -> list[float]:
    """By case: highest pressure of the runs that were asked for, as a share of the highest one
    that was recorded before; a run is planned to at most 1.05.
    """
    found = []
    for name in names:
        runs = sorted((out / "work" / name / "campaign").glob("step_*/recording_*.csv"))
        before = _most(out / "cases" / name / f"{FREE}.csv")
        ratios = [most / before[n] for file in runs for n, most in _most(file).items()]
        found += [max(ratios)] if ratios else []
    return found


def _most(log: Path) -> dict[str, float]:
    """Highest pressure of each muscle of a log, in its own unit."""
    head, *rows = log.read_text(encoding="utf-8").splitlines()
    places = {n: k for k, n in enumerate(head.split(",")) if n.startswith("muscle_pressure")}
    cells = [row.split(",") for row in rows]
    return {name: max(float(row[k]) for row in cells if row[k]) for name, k in places.items()}


def page(found: dict[str, list[dict[str, Any]]], cases: int, ratios: Sequence[float] = ()) -> str:
    """The scores as tables, with how far pressures of the campaign went above what was recorded."""
    every = [((arm, str(n)), row) for arm, rows in found.items() for n, row in enumerate(rows)]
    states = rows_of(
        ("arm", "runs", *STATES, "right, 95 %", "d >= 4: right", "wrong", "s at the bench"),
        [
            (*place, *(str(row[state]) for state in STATES), _interval(row))
            + (_share(row["decidable"]), _share(row["decidable wrong"]), f"{row['seconds']:.0f}")
            for place, row in every
        ],
    )
    columns = (*_MARKS, "intervals")
    marks = rows_of(
        ("arm", "runs", *columns),
        [(*place, *(_share(row[column]) for column in columns)) for place, row in every],
    )
    over = f"{max(ratios):.2f}" if ratios else "none"
    broken = sum(ratio > _BROKEN for ratio in ratios)
    return (
        f"# Campaigns on the independent plant, {cases} cases\n\n{states}\n\n{marks}\n\n"
        "Highest pressure of the runs of a campaign, as a share of the highest one recorded "
        f"before: {over}; above {_BROKEN:g} in {broken} of {len(ratios)} cases.\n"
    )


def _share(counts: tuple[int, int]) -> str:
    return f"{counts[0]}/{counts[1]}"


def _interval(row: dict[str, Any]) -> str:
    """Share of the cases that are right, as an interval of 95 %."""
    cases = sum(row[state] for state in STATES)
    return "{:.2f} to {:.2f}".format(*(wilson(row["right"], cases) if cases else (0.0, 1.0)))


def draw(found: dict[str, list[dict[str, Any]]], file: Path) -> None:
    """Shares that are right, and wrong, over the runs, as SVG."""
    import matplotlib as mpl
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6.4, 4.2), layout="constrained")
    axes = figure.subplots()
    for arm, colour in zip(ARMS, ("#0072b2", "#d55e00", "#9ca3af"), strict=True):
        rows = found[arm]
        whole = [max(1.0, sum(row[state] for state in STATES)) for row in rows]
        for state, style in (("right", "-"), ("wrong", ":")):
            shares = [row[state] / n for row, n in zip(rows, whole, strict=True)]
            axes.plot(range(len(rows)), shares, "o" + style, color=colour, label=f"{arm}, {state}")
    axes.set(xlabel="runs after the free log", ylabel="share of cases", ylim=(-0.03, 1.03))
    axes.set_xticks(range(RUNS + 1))
    axes.legend(frameon=False, fontsize="small")
    axes.grid(alpha=0.3)
    with mpl.rc_context({"svg.hashsalt": "campaign", "svg.fonttype": "none"}):
        figure.savefig(file, format="svg", metadata={"Date": None})
