"""A campaign: diagnose, propose, foretell, play, score, and again, until it is decided."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from pamrs.campaigns._bench import Bench, Commands
from pamrs.campaigns._budget import Budget, Cost
from pamrs.campaigns._choice import (
    Pool,
    asked_for,
    is_open,
    plan_of,
    pool_of,
    proposed,
    shows_of,
    unseen,
)
from pamrs.campaigns._folder import Folder, Step, short_form
from pamrs.campaigns._page import write_pages
from pamrs.campaigns._play import play
from pamrs.control.live import Device
from pamrs.diagnosis import Diagnosis, DiagnosisSettings, diagnose
from pamrs.diagnosis.next_experiment import foretold, measurable
from pamrs.errors import (
    CaseError,
    DiagnosisError,
    ParameterError,
    RecordingError,
    SimulationError,
)
from pamrs.experiments import protocol_of
from pamrs.recordings import Case, Recording, load_case
from pamrs.rig import Rig

_MOVED: Final = 0.05  # of a probability, from which on a run changed something
_UNCHANGED: Final = 2  # runs in a row that changed nothing, after which the kind is not asked again


@dataclass(frozen=True, eq=False)
class Campaign:
    """A campaign as far as it went.

    Attributes
    ----------
    path : Path
        Its folder: ``campaign.json``, ``campaign.html``, ``result.json`` of the last diagnosis, and
        a folder for each step.
    diagnosis : Diagnosis or None
        The last one that this call made: with ``no recording`` there may be none, and
        ``result.json`` in the folder has the one before.
    steps : list of Step
        What was proposed, foretold, played and found.
    why : str
        Why it ended: ``decided``, ``budget``, ``nothing parts`` (no allowed experiment parts what
        is left), ``unchanged`` (two runs changed nothing, and a repeat neither), ``no recording``
        (a step waits for one).
    text : str
        The same in words, with what would help.
    """

    path: Path
    diagnosis: Diagnosis | None
    steps: list[Step]
    why: str
    text: str

    def summary(self) -> str:
        """Text of each run's change, and of the open questions."""
        lines = [f"{len(self.steps)} steps in {self.path}"]
        for step in self.steps:
            after = step.after["headline"] if step.after else "waits for its recording"
            after = f"withdrawn, {step.withdrawn}" if step.withdrawn else after
            lines.append(f"  {step.number}  {step.name}{' again' * step.repeats}: {after}")
        return "\n".join([*lines, self.text])


def campaign(
    device: Device | None,
    rig: Rig,
    case: Case | Sequence[Recording] | str | os.PathLike[str] | None = None,
    *,
    out: str | os.PathLike[str],
    budget: Budget | None = None,
    bench: Bench | None = None,
    settings: DiagnosisSettings | None = None,
    recording: str | os.PathLike[str] | None = None,
    progress: Callable[[str], None] | None = None,
) -> Campaign:
    """Diagnose a rig by experiments of its own choice, until it is decided what its model lacks.

    What there is gets diagnosed. While something is open (several answers, one that rests on one
    recording alone, effects that no recording would have shown), and the budget lasts, the
    experiment that tells most is proposed, and what every rival predicts is written down; it is
    played, recorded as it comes, and diagnosed with the rest. Every step is kept in a folder; the
    same call goes on where it was stopped.

    Parameters
    ----------
    device : Device or None
        Anything with ``read()`` and ``write(command)``, as :func:`pamrs.control.live.run_live`
        takes it; ``prepare()``, where it has one, is called before each run. None: the commands
        are written for a person, and the recording is taken back by the next call.
    rig : Rig
        The nominal model; what its file allows (``[limits]``) is kept to.
    case : Case, sequence of Recording or path-like, optional
        What was recorded before: a case, its folder, or recordings.
    out : path-like
        Folder of the campaign; made, or gone on with.
    budget : Budget, optional
        Minutes at the bench, runs and litres of air: 30, 6 and 1000 by default.
    bench : Bench, optional
        Limits, safe commands and what else is not in the rig file.
    settings : DiagnosisSettings, optional
        As for :func:`pamrs.diagnose`.
    recording : path-like, optional
        Without a device: the recording of the step that waits for one.
    progress : callable, optional
        Called with a line of text now and then.

    Returns
    -------
    Campaign
        The last diagnosis, every step, and why it ended.

    Raises
    ------
    ParameterError
        If an argument is not allowed, or the limits allow no experiment.
    LiveError
        If the device failed or was lost; the safe command was written, the recording is kept, and
        the same call goes on.
    CaseError
        If the folder holds the campaign of another rig, or files that one would write over; if
        `recording` lacks a command of its step, or has no channel that the rig can be measured by.
    DiagnosisError
        If the recordings of this rig cannot be diagnosed, or no experiment is made for it; a step
        whose recording cannot takes another one, or is played again.
    """
    work = _Work(device, rig, case, Folder(Path(out), rig), budget, bench, settings, progress)
    if recording is not None:
        work.take(Path(recording))
    return work.run()


class _Work:
    """A campaign at work."""

    def __init__(
        self,
        device: Device | None,
        rig: Rig,
        case: Any,
        folder: Folder,
        budget: Budget | None,
        bench: Bench | None,
        settings: DiagnosisSettings | None,
        progress: Callable[[str], None] | None,
    ) -> None:
        self.device, self.rig, self.folder = device, rig, folder
        self.commands = Commands(rig, bench or Bench())
        self.budget, self.settings = budget or Budget(), settings or DiagnosisSettings()
        self.progress, self.say = progress, progress or (lambda line: None)
        if isinstance(case, (str, os.PathLike)):
            case = load_case(case)
        if not isinstance(case, Case):
            case = Case(rig.name, rig, list(case or ()), folder.path)
        self.before: list[Recording] = case.recordings
        if device is not None and not self.commands.ranges:
            raise ParameterError(
                f"device = {getattr(device, 'name', device)} is not allowed: rig {rig.name!r} has "
                "no command that a device could play; None (--step) is needed"
            )
        taken = getattr(device, "commands", None)
        if taken is not None and set(taken) != set(self.commands.ranges):
            raise ParameterError(
                f"device = {getattr(device, 'name', device)} takes {', '.join(taken)}, which is "
                f"not allowed: rig {rig.name!r} has {', '.join(self.commands.ranges)}"
            )
        known = ("time", *measurable(rig))
        unknown = [name for name in getattr(device, "channels", ()) if name not in known]
        if unknown:
            raise ParameterError(
                f"device = {getattr(device, 'name', device)} tells {', '.join(unknown)}, which is "
                f"not allowed: rig {rig.name!r} has {', '.join(known)}"
            )
        self.found: Diagnosis | None = None

    def run(self) -> Campaign:
        """On from where it was, to an end."""
        self.folder.ended = {}
        self.withdraw()
        while not self.folder.ended:
            step = self.folder.open
            if step is None:
                self.next()
            elif step.finished or self.recorded(step):
                self.judge(step)
        self.folder.save()
        write_pages(self.folder)
        ended = self.folder.ended
        return Campaign(
            self.folder.path, self.found, self.folder.steps, ended["why"], ended["text"]
        )

    @property
    def recordings(self) -> list[Recording]:
        """All that there are."""
        return [*self.before, *self.folder.recordings()]

    @property
    def wanted(self) -> dict[str, list[str]]:
        """Effects that are to be seen, each with the experiments that show it: every one before an
        answer has predicted a recording, those not seen yet where these leave it open, else none.
        """
        found, proven = self.found, len(self.before) + len(self.folder.played) > 1
        hidden = found is not None and found.answer.why == "unseen"
        settled = found is None or found.answer.why in ("", "name")
        if not hidden and (proven or not settled):
            return {}
        if self.folder.shows is None:
            self.say("what experiments would show")
            self.folder.shows = shows_of(plan_of(self.rig, self.before, self.settings))
            self.folder.save()
        every = self.folder.shows
        if found is None or not proven:
            return every
        return {effect: every[effect] for effect in unseen(found) if effect in every}

    @property
    def pool(self) -> Pool:
        """Experiments that may be played now, up to pressures recorded before the campaign: a run
        that went higher than it was planned to is no leave for the next one to do so.
        """
        return pool_of(
            self.commands,
            self.before or self.recordings,
            self.folder.played,
            (self.budget, self.folder.spent),
            self.settings,
            hands=self.device is None and not self.commands.bench.unattended,
        )

    def withdraw(self) -> None:
        """Withdraw a step that waits to be played, and would not be proposed as it is by now."""
        step = self.folder.open
        if step is None or step.finished or (self.device is None and self.waiting(step).exists()):
            return
        pool, sent = self.pool, self.folder.sent(step)
        one = {**pool.new, **pool.again}.get(step.name)
        protocol = None if one is None else protocol_of(one)
        if step.name in pool.refused:
            step.withdrawn = pool.refused[step.name]
        elif any(own.name == step.name for own in pool.by_hand):
            step.withdrawn = "it takes another payload, or somebody at the bench"
        elif one is None or (protocol and protocol.to_csv()) != (
            sent.read_text(encoding="utf-8") if sent.exists() else None
        ):
            step.withdrawn = "this bench and these recordings ask for other commands"
        if step.withdrawn:
            self.folder.save()
            self.say(f"step {step.number}: {step.name} is withdrawn: {step.withdrawn}")

    def diagnose(self) -> None:
        """Diagnose all recordings."""
        every = self.recordings
        if every:
            case = Case(self.rig.name, self.rig, every, self.folder.path)
            self.found = diagnose(case, settings=self.settings, progress=self.progress)
            self.found.to_json(self.folder.path / "result.json")

    def end(self, why: str, text: str) -> None:
        """Say why it ends."""
        self.folder.ended = {"why": why, "text": text}

    def next(self) -> None:
        """Propose the next experiment, or end."""
        recordings, spent = self.recordings, self.folder.spent
        if self.found is None:
            self.diagnose()
        what = is_open(self.found, len(recordings))
        headline = "" if self.found is None else self.found.headline
        if not what:
            return self.end("decided", f"Decided: {headline}")
        over = self.budget.passed(spent + Cost(runs=1))
        if over:
            return self.end("budget", f"The budget allows no further run ({over}); open is: {what}")
        pool, wanted = self.pool, self.wanted
        last = [step for step in self.folder.steps if step.finished][-_UNCHANGED:]
        stuck = len(last) == _UNCHANGED and not any(step.changed for step in last)
        proposal = None
        if not (stuck and any(step.repeats for step in last)):
            proposal = proposed(
                self.rig, self.found, pool, wanted, recordings, self.settings, repeat=stuck
            )
        if proposal is not None:
            cost = pool.costs[proposal.experiment.name]
            step = self.folder.propose(proposal, cost, self.commands, short_form(self.found))
            write_pages(self.folder)
            return self.say(f"step {step.number}: {step.name}")
        helps = f"What would help: {asked_for(self.found, pool)}"
        if stuck:
            text = f"The last runs changed nothing; open is: {what}. {helps}"
            return self.end("unchanged", text)
        short = [why for why in pool.refused.values() if "budget" in why]
        if short and not pool.new:
            return self.end("budget", f"What is left of the budget is too little ({short[0]})")
        text = f"No allowed experiment parts what is left: {what}. {helps}"
        return self.end("nothing parts", text)

    def waiting(self, step: Step) -> Path:
        """The file that a person puts the recording of a step into."""
        return self.folder.home(step) / "recording.csv"

    def recorded(self, step: Step) -> bool:
        """Play a step, or take what a person brought; True where its recording is there then."""
        home = self.folder.home(step)
        if self.device is None:
            if self.waiting(step).exists():
                self.take(self.waiting(step))
                self.waiting(step).unlink()  # it is kept under its number
                return True
            self.end("no recording", f"Waits for the recording of {home / 'sheet.md'}")
            return False
        protocol = self.folder.protocol(step)
        if protocol is None:
            raise CaseError(f"{home}: the commands are missing; give a new folder")
        path = self.folder.next_file(step)
        step.recordings.append(str(path.relative_to(self.folder.path)))
        step.spent.append(step.seconds)  # a run that is killed counts in full
        self.folder.save()
        self.say(f"step {step.number}: playing {step.name}, {step.seconds:.0f} s")
        done = play(self.device, self.commands, protocol, path)
        step.spent[-1], step.finished = done.seconds, True
        self.folder.save()
        return True

    def take(self, path: Path) -> None:
        """Take the recording of the step that waits for one, or that was not judged by another."""
        step = self.folder.open
        if step is None:
            raise CaseError(f"recording = {path} is not allowed: no step waits for one")
        protocol, has = self.folder.protocol(step), self.folder.recording(step, path).channels
        sent = list(protocol.commands) if protocol else []
        heard = [name for name in measurable(self.rig) if name not in sent]
        missing = [name for name in sent if name not in has]
        if missing or not any(name in has for name in heard):
            needed = missing or [f"one of {', '.join(heard)}"]
            raise CaseError(
                f"recording = {path} is not allowed: it has {', '.join(has)}, and step "
                f"{step.number} needs {', '.join(needed)}"
            )
        kept = self.folder.next_file(step, "".join(path.suffixes) or ".csv")
        shutil.copyfile(path, kept)
        step.recordings.append(str(kept.relative_to(self.folder.path)))
        step.spent.append(step.seconds)
        step.finished = True
        self.folder.save()

    def judge(self, step: Step) -> None:
        """Score what was foretold of a run, and diagnose with it."""
        step.scores, recording = {}, self.folder.recording(step)
        for rival in self.folder.rivals(step):
            with suppress(DiagnosisError, SimulationError):  # this run tells nothing of this model
                step.scores |= foretold([rival], recording, self.settings)
        try:
            self.diagnose()
        except (CaseError, DiagnosisError, RecordingError, SimulationError) as error:
            step.finished = False
            self.folder.save()
            raise DiagnosisError(
                f"{self.folder.path / step.recordings[-1]} cannot be diagnosed with the others: "
                f"{error}; step {step.number} takes another recording"
            ) from error
        step.after = short_form(self.found)
        step.changed = _changed(step.before, step.after)
        self.folder.save()
        if self.found is not None:
            self.found.report(self.folder.home(step) / "report.html")
            self.found.to_json(self.folder.home(step) / "result.json")
        write_pages(self.folder)


def _changed(before: dict[str, Any] | None, after: dict[str, Any] | None) -> bool:
    """True where a run changed answer, sets, a probability, or the sizes that can be seen."""
    if before is None or after is None:
        return before != after
    same = all(before[key] == after[key] for key in ("verdict", "names", "ambiguity", "settled"))
    moved = abs((before["probability"] or 0.0) - (after["probability"] or 0.0)) >= _MOVED
    return not same or moved or len(after["unseen"]) < len(before["unseen"])
