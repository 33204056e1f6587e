"""A campaign as a folder: what was proposed, foretold, played and found, step by step, so that the
same command goes on after any stop.
"""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from pamrs._arrays import Array
from pamrs._writing import write_atomically
from pamrs.campaigns._bench import Commands
from pamrs.campaigns._budget import Cost
from pamrs.campaigns._choice import ProposedRun, unseen
from pamrs.channels import unit_of
from pamrs.diagnosis import Diagnosis
from pamrs.diagnosis.next_experiment import measurable
from pamrs.errors import CaseError, SimulationError
from pamrs.experiments import protocol_of
from pamrs.findings import Protocol, to_plain
from pamrs.recordings import OwnValue, Recording, load_recording
from pamrs.report.words import hypothesis_label
from pamrs.rig import Rig, load_rig

SCHEMA: Final = "pamrs.campaign/1"
_FILE: Final = "campaign.json"
_MOST_ROWS: Final = 600  # of a prediction
_MOST_RIVALS: Final = 6  # probabilities that a step keeps


@dataclass
class Step:
    """One experiment of a campaign.

    Attributes
    ----------
    number : int
        From 1 on.
    name, text, why : str
        Its kind, what is done, and what it is to tell.
    numbers : dict
        Levels and times of it.
    repeats : bool
        Whether it was played before.
    seconds, litres : float
        What one run takes [s], [l].
    changes : dict of str to float
        Parameters of the rig that a person changed for it [SI].
    rivals : list of dict
        What predicted it: ``label``, ``probability``, ``model`` (its file).
    before : dict or None
        What was known before, as :func:`short_form`.
    bits : float or None
        What it was expected to tell [bit].
    spent : list of float
        What each of its runs took [s], those that were stopped included.
    recordings : list of str
        Files, from the folder of the campaign; the last one is complete where ``finished``.
    finished : bool
        Whether it was played to its end.
    scores : dict of str to dict of str to float
        What every rival left of each channel [noise levels].
    after : dict or None
        What was known with it.
    changed : bool or None
        Whether it changed anything; None until it was judged.
    withdrawn : str
        Why it may not be played any more; empty where it may, or was.
    """

    number: int
    name: str
    text: str
    why: str
    numbers: dict[str, Any]
    repeats: bool
    seconds: float
    litres: float
    changes: dict[str, float] = field(default_factory=dict)
    rivals: list[dict[str, Any]] = field(default_factory=list)
    before: dict[str, Any] | None = None
    bits: float | None = None
    spent: list[float] = field(default_factory=list)
    recordings: list[str] = field(default_factory=list)
    finished: bool = False
    scores: dict[str, dict[str, float]] = field(default_factory=dict)
    after: dict[str, Any] | None = None
    changed: bool | None = None
    withdrawn: str = ""

    @property
    def telling(self) -> str:
        """The channel in which what the rivals left differs most; empty before they are scored."""
        every = list(self.scores.values())
        common = set.intersection(*map(set, every)) if every else set()

        def spread(channel: str) -> float:
            left = [own[channel] for own in every]
            return max(left) - min(left)

        return max(sorted(common), key=spread, default="")

    @property
    def cost(self) -> Cost:
        """Cost so far."""
        share = sum(self.spent) / self.seconds if self.seconds > 0.0 else 0.0
        return Cost(sum(self.spent), len(self.spent), self.litres * min(share, len(self.spent)))


class Folder:
    """The files of a campaign.

    Parameters
    ----------
    path : Path
        Made if it is not there.
    rig : Rig
        The nominal model: a folder holds the campaign of one.

    Attributes
    ----------
    steps : list of Step
        In their order.
    shows : dict of str to list of str, or None
        Experiments that show an effect at its usual size.
    ended : dict
        ``why`` and ``text``; empty while it goes on.

    Raises
    ------
    CaseError
        If the folder holds the campaign of another rig, or files that no campaign wrote and one
        would write over, or a file of it cannot be read.
    """

    def __init__(self, path: Path, rig: Rig) -> None:
        self.path, self.rig = path, rig
        self.steps: list[Step] = []
        self.shows: dict[str, list[str]] | None = None
        self.ended: dict[str, str] = {}
        path.mkdir(parents=True, exist_ok=True)
        file, model = path / _FILE, path / "rig.toml"
        if not file.exists():
            written = ("rig.toml", "result.json", "step_*")
            theirs = next((own.name for name in written for own in path.glob(name)), "")
            if theirs:
                raise CaseError(
                    f"out = {path} is not allowed: it holds {theirs} and no {_FILE}, so no "
                    "campaign made it; a new folder is needed"
                )
            write_atomically(model, rig.to_toml_text())
            self.save()
            return
        try:
            found = json.loads(file.read_text(encoding="utf-8"))
            if found["schema"] != SCHEMA:
                raise ValueError(f"schema = {found['schema']!r}; {SCHEMA!r} is needed")
            self.steps = [Step(**step) for step in found["steps"]]
            self.shows, self.ended = found["shows"], found["ended"]
        except (ValueError, KeyError, TypeError) as error:
            raise CaseError(f"{file}: is no campaign ({error})") from None
        same = load_rig(model).to_toml_text(comments=False) == rig.to_toml_text(comments=False)
        if not same:
            raise CaseError(
                f"{path}: holds the campaign of another rig, {model}; give that rig, or another "
                "folder"
            )

    def save(self) -> None:
        """Write what is known, whole or not at all."""
        content = {
            "schema": SCHEMA,
            "rig": self.rig.name,
            "ended": self.ended,
            "shows": self.shows,
            "steps": [to_plain(asdict(step)) for step in self.steps],
        }
        write_atomically(self.path / _FILE, json.dumps(content, indent=1, allow_nan=False) + "\n")

    def home(self, step: Step) -> Path:
        """The folder of a step."""
        return self.path / f"step_{step.number:02d}"

    @property
    def open(self) -> Step | None:
        """The step that was proposed, and neither judged nor withdrawn yet."""
        last = self.steps[-1] if self.steps else None
        return last if last and last.changed is None and not last.withdrawn else None

    @property
    def spent(self) -> Cost:
        """Cost of all runs."""
        return sum((step.cost for step in self.steps), Cost())

    @property
    def played(self) -> list[tuple[str, dict[str, Any]]]:
        """Name and numbers of what was played to its end."""
        return [(step.name, step.numbers) for step in self.steps if step.finished]

    def recordings(self) -> list[Recording]:
        """Recordings of complete runs, in their order."""
        return [self.recording(step) for step in self.steps if step.finished and step.recordings]

    def recording(self, step: Step, path: Path | None = None) -> Recording:
        """The complete run of a step, as it is kept or from another file."""
        ambient = float(self.rig.tables("gas")[""]["ambient_pressure"])
        name = f"{step.number:02d} {step.name}"
        file = path or self.path / step.recordings[-1]
        found = load_recording(file, name=name, ambient_pressure=ambient)
        changed = {
            name: OwnValue(value, self.rig.parameter(name).value)
            for name, value in step.changes.items()
        }
        return replace(found, parameters=changed)

    def next_file(self, step: Step, ending: str = ".csv") -> Path:
        """Path of the next recording of a step."""
        home, count = self.home(step), 1
        while (path := home / f"recording_{count}{ending}").exists():
            count += 1
        return path

    def sent(self, step: Step) -> Path:
        """The file that has the commands of a step."""
        return self.home(step) / "commands.csv"

    def protocol(self, step: Step) -> Protocol | None:
        """The commands of a step, as they were written down; None where it is done by hand."""
        file = self.sent(step)
        if not file.exists():
            return None
        time, *others = columns_of(file).items()
        columns = {head.partition(" [")[0]: values for head, values in others}
        return Protocol(step.name, time[1], columns, {name: unit_of(name) for name in columns})

    def propose(
        self, proposal: ProposedRun, cost: Cost, commands: Commands, before: dict[str, Any] | None
    ) -> Step:
        """Write down an experiment with what every rival predicts of it, before it is played."""
        one = proposal.experiment
        step = Step(
            len(self.steps) + 1,
            one.name,
            one.text,
            proposal.why,
            to_plain(one.excitation),
            proposal.repeats,
            cost.seconds,
            cost.litres,
            dict(one.changes),
            before=before,
            bits=proposal.bits,
        )
        home = self.home(step)
        home.mkdir(exist_ok=True)
        protocol = protocol_of(one)
        if protocol is not None:
            write_atomically(self.sent(step), protocol.to_csv())
        step.rivals = self._foretell(home, proposal)
        write_atomically(home / "sheet.md", sheet(step, proposal, commands))
        self.steps.append(step)
        self.save()
        return step

    def _foretell(self, home: Path, proposal: ProposedRun) -> list[dict[str, Any]]:
        """Write the models of all rivals, and what each shows in this experiment."""
        predicted, heads = list[dict[str, Any]](), ["time [s]"]
        columns: list[Array] = []
        heard = [n for n in measurable(self.rig) if n not in proposal.experiment.commands]
        for k, (label, rig, probability) in enumerate(proposal.rivals, 1):
            file = home / f"rival_{k}.toml"
            write_atomically(file, rig.to_toml_text())
            predicted.append({"label": label, "probability": probability, "model": file.name})
            try:
                run = proposal.experiment.simulate(rig)
            except SimulationError:  # it leaves the range of its model: that is seen as well
                continue
            every = max(1, len(run.time) // _MOST_ROWS)
            columns = columns or [run.time[::every]]
            for name in (name for name in heard if name in run):
                heads.append(
                    f"{name} [{unit_of(name)}] if {hypothesis_label(label)}".replace(",", ";")
                )
                columns.append(run[name][::every])
        if columns:
            rows = [",".join(f"{value:.6g}" for value in row) for row in np.column_stack(columns)]
            write_atomically(home / "foretold.csv", "\n".join([",".join(heads), *rows]) + "\n")
        return predicted

    def rivals(self, step: Step) -> list[tuple[str, Rig, float]]:
        """The models that predicted a step."""
        home = self.home(step)
        return [
            (own["label"], load_rig(home / own["model"]), own["probability"]) for own in step.rivals
        ]


def columns_of(file: Path) -> dict[str, Array]:
    """The columns (n,) of a table that was written here, by their headings."""
    with file.open(encoding="utf-8") as lines:
        heads = lines.readline().strip().split(",")
        return dict(zip(heads, np.loadtxt(lines, delimiter=",", ndmin=2).T, strict=True))


def short_form(diagnosis: Diagnosis | None) -> dict[str, Any] | None:
    """Short form of a diagnosis, as a step keeps it."""
    if diagnosis is None:
        return None
    answer, every = diagnosis.answer, diagnosis.probabilities
    likely = sorted(every, key=lambda name: -every[name])[:_MOST_RIVALS]
    return {
        "headline": diagnosis.headline,
        "verdict": diagnosis.verdict,
        "settled": answer.settled,
        "names": list(answer.names),
        "probability": answer.probability,
        "ambiguity": diagnosis.ambiguity,
        "probabilities": {name: every[name] for name in likely},
        "unseen": unseen(diagnosis),
    }


def sheet(step: Step, proposal: ProposedRun, commands: Commands) -> str:
    """Instructions for a person at the bench, as Markdown."""
    one, rig = proposal.experiment, commands.rig
    safe = ", ".join(f"{k} = {v:g} {unit_of(k)}" for k, v in commands.safe.items())
    heard = [name for name in measurable(rig) if name not in one.commands]
    what = f"{one.text[:1].upper()}{one.text[1:]}."
    lines = [
        f"# Step {step.number}: {step.name}",
        "",
        f"**Do.** {what}",
        "",
        f"**Why.** {step.why.removeprefix(what).lstrip()}",
        "",
        f"- It takes {step.seconds:.0f} s and about {step.litres:.0f} l of air.",
    ]
    if one.commands:
        lines.append(
            f"- Send the columns of `commands.csv` ({', '.join(one.commands)}) every "
            f"{one.sample_time:g} s; before the first and after the last: {safe}."
        )
    for name, (_, low, high) in commands.ranges.items():
        lines.append(f"- {name} stays within {low:g} to {high:g} {unit_of(name)}.")
    for name, value in {**one.initial, **one.changes}.items():
        lines.append(f"- Before it begins: {name} = {value:g} (SI).")
    lines += [f"- It takes {one.needs}."] if one.needs else []
    lines += [
        f"- Record time, every command and, as far as you have them, {', '.join(heard)}; headings "
        "with units, as `muscle_pressure [bar]`.",
        "- Put the log into the folder of this sheet as `recording.csv`, and give the same command "
        "again (or name it with `--recording FILE`).",
        "",
        "**What it must show.** A model that is true leaves one noise level of every channel and "
        "its own error, its values moved no farther than is known; `foretold.csv` has the curves.",
        "",
        *(f"- {hypothesis_label(r['label'])} ({r['probability']:.2f})" for r in step.rivals),
    ]
    return "\n".join(lines) + "\n"
