"""Diagnose every case of a folder by ``pamrs diagnose``, each in a process that is given that
case's folder only.

The answer keys of a trial (``python -m trial write``) lie beside the cases; nothing here opens
them. A result that is there is kept, so a run that was stopped goes on where it was.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import math
import os
import platform
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from importlib import metadata, util
from pathlib import Path
from typing import Any, Final

from .concealed import write
from .plan import MANIFEST

SCHEMA: Final = "pamrs.prove/1"
_READABLE: Final = ("pamrs.diagnosis/1", "pamrs.diagnosis/2")
_VERDICTS: Final = ("none", "parameters", "effects", "unlisted")
#: Time after which a case is given up [s].
TIMEOUT: Final = 1800.0
#: Time between two looks at the processes [s].
_POLL: Final = 0.05
#: Signals that end a program; Ctrl-C is a KeyboardInterrupt already.
_ENDING: Final = ("SIGINT", "SIGTERM", "SIGHUP", "SIGBREAK")


@dataclass(frozen=True)
class Proof:
    """The outcome of a run over a folder of cases.

    Attributes
    ----------
    results : Path
        Folder with ``NAME/out.json`` and ``run.json``.
    cases : dict of str to dict
        By name: ``verdict``, ``effects``, ``wrong_parameters``, ``unexplained`` (blocks without a
        name) and ``seconds``, or ``error``; as in ``run.json``.
    kept : int
        Results that were there before.
    """

    results: Path
    cases: dict[str, dict[str, Any]] = field(default_factory=dict)
    kept: int = 0

    @property
    def failed(self) -> dict[str, str]:
        """Error by case, of those without a result."""
        return {name: str(entry["error"]) for name, entry in self.cases.items() if "error" in entry}

    @property
    def verdicts(self) -> dict[str, int]:
        """Number of cases by verdict, ``error`` last."""
        found = [str(entry.get("verdict", "error")) for entry in self.cases.values()]
        return {
            word: found.count(word)
            for word in (*_VERDICTS, "error")
            if word != "error" or word in found
        }

    def table(self) -> str:
        """The verdicts counted, and the time that a diagnosis took, as text."""
        counts = self.verdicts
        seconds = sorted(float(e["seconds"]) for e in self.cases.values() if "seconds" in e)
        lines = [
            f"{'verdict':<12}{'cases':>7}",
            *(f"{word:<12}{count:>7}" for word, count in counts.items()),
        ]
        lines.append(f"{'all':<12}{sum(counts.values()):>7}")
        if seconds:
            lines += [
                "",
                (
                    f"seconds for a diagnosis: median {seconds[len(seconds) // 2]:.1f}, longest "
                    f"{seconds[-1]:.1f}"
                ),
            ]
        return "\n".join(lines)


def cases_of(folder: str | os.PathLike[str]) -> tuple[list[Path], str | None]:
    """The cases below a folder, and the digest of the manifest that lists them.

    Parameters
    ----------
    folder : path-like
        Holds ``cases/NAME/case.toml``, or ``NAME/case.toml``, and maybe ``manifest.json``.

    Returns
    -------
    cases : list of Path
        Case folders by name.
    digest : str or None
        SHA-256 of the manifest; None without one.

    Raises
    ------
    ValueError
        If there is no case, or the manifest does not list exactly the cases that are there.
    """
    home = Path(folder)
    if not home.is_dir():
        raise ValueError(f"{home}: no such folder")
    inside = home / "cases" if (home / "cases").is_dir() else home
    found = sorted(p.parent for p in inside.glob("*/case.toml"))
    if not found:
        raise ValueError(
            f"{home}: no case below it; NAME/case.toml or cases/NAME/case.toml is needed"
        )
    manifest = home / MANIFEST
    if not manifest.is_file():
        return found, None
    content = manifest.read_bytes()
    try:
        listed = set(json.loads(content)["keys"])
    except (ValueError, KeyError, TypeError) as error:
        raise ValueError(
            f"{manifest}: not a manifest, a table 'keys' from cases to digests is needed"
        ) from error
    names = {p.name for p in found}
    for wrong, words in (
        (names - listed, "does not list"),
        (listed - names, "lists cases that are not there:"),
    ):
        if wrong:
            more = f" and {len(wrong) - 3} more" if len(wrong) > 3 else ""
            raise ValueError(f"{manifest}: {words} {', '.join(sorted(wrong)[:3])}{more}")
    return found, hashlib.sha256(content).hexdigest()


def valid_result(path: Path) -> dict[str, Any] | None:
    """A result that was written whole, or None."""
    try:
        told = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    good = (
        isinstance(told, dict)
        and told.get("schema") in _READABLE
        and told.get("verdict") in _VERDICTS
    )
    return told if good else None


def case_digest(folder: Path) -> str:
    """SHA-256 over every file of a case, so that a result of another case of the same name is not
    kept.
    """
    return _digest(Path(os.path.realpath(folder)), lambda path: True)


def code_digest() -> str:
    """SHA-256 over every file of the installed pamrs, so that results of different code can be told
    apart.

    Raises
    ------
    ValueError
        If pamrs is not installed.
    """
    found = util.find_spec("pamrs")
    if found is None or found.origin is None:
        raise ValueError("pamrs is not installed: `pamrs diagnose` is what is tried")
    return _digest(
        Path(found.origin).parent,
        lambda path: path.suffix in (".py", ".so", ".pyd", ".toml", ".json"),
    )


def _version() -> str:
    """The version of the installed pamrs, as it says itself."""
    try:
        return metadata.version("pamrs")
    except metadata.PackageNotFoundError:
        return "0+unknown"


def _digest(home: Path, wanted: Callable[[Path], bool]) -> str:
    total = hashlib.sha256()
    for path in sorted(home.rglob("*")):
        if path.is_file() and wanted(path):
            total.update(
                path.relative_to(home).as_posix().encode()
                + b"\0"
                + hashlib.sha256(path.read_bytes()).digest()
            )
    return total.hexdigest()


def _machine() -> dict[str, Any]:
    """The machine on which the seconds were measured."""
    model = platform.processor()
    with contextlib.suppress(OSError):
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
        model = next(
            (line.partition(":")[2].strip() for line in lines if line.startswith("model name")),
            model,
        )
    return {
        "system": platform.platform(),
        "processor": model,
        "cores": os.cpu_count(),
        "python": platform.python_version(),
    }


@contextlib.contextmanager
def _signals() -> Iterator[Callable[[], None]]:
    """Signals that end a program, raised where the function that is given is called: none comes
    between the start of a process and its place among those that are ended with the program.
    """
    came: list[int] = []
    old: dict[int, Any] = {}
    for number in (getattr(signal, name) for name in _ENDING if hasattr(signal, name)):
        if signal.getsignal(number) in (signal.SIG_DFL, signal.default_int_handler):
            old[number] = signal.signal(number, lambda n, _: came.append(n))

    def check() -> None:
        if came:
            raise KeyboardInterrupt if came[0] == signal.SIGINT else SystemExit(128 + came[0])

    try:
        yield check
    finally:
        for number, handler in old.items():
            signal.signal(number, handler)


def _spent() -> float:
    """Processor time of the processes that have ended [s]."""
    known = os.times()
    return known.children_user + known.children_system


@dataclass
class _Running:
    """A diagnosis at work."""

    case: Path
    process: subprocess.Popen[bytes]
    home: tempfile.TemporaryDirectory[str]
    began: float
    late: bool = False
    cpu: float = 0.0

    def has_ended(self) -> bool:
        """True once it has ended; then its processor time is noted."""
        before = _spent()
        ended = self.process.poll() is not None
        self.cpu += _spent() - before
        return ended

    def cried(self) -> list[str]:
        """Lines of its standard error."""
        text = (Path(self.home.name) / "stderr").read_text(encoding="utf-8", errors="replace")
        return text.strip().splitlines()

    def close(self) -> None:
        if self.process.poll() is None:
            self.process.kill()
        self.process.wait()
        self.home.cleanup()


def _launch(command: Sequence[str], case: Path, out: Path) -> _Running:
    """Start a diagnosis in an empty folder, with one thread for linear algebra and its words in
    files.
    """
    home = tempfile.TemporaryDirectory(prefix="pamrs-prove-")
    paths = [os.path.abspath(p) for p in os.environ.get("PYTHONPATH", "").split(os.pathsep) if p]
    threads = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1")
    environment = {
        **os.environ,
        **threads,
        **({"PYTHONPATH": os.pathsep.join(paths)} if paths else {}),
    }
    with (
        open(Path(home.name, "stdout"), "wb") as told,
        open(Path(home.name, "stderr"), "wb") as cried,
    ):
        process = subprocess.Popen(
            [*command, os.path.realpath(case), "--json", os.path.realpath(out)],
            cwd=home.name, env=environment, stdin=subprocess.DEVNULL, stdout=told, stderr=cried,
        )  # fmt: skip
    return _Running(case, process, home, time.perf_counter())


def _ended(running: _Running, out: Path) -> dict[str, Any]:
    """The entry of a case whose process has ended."""
    code = running.process.returncode
    result = valid_result(out) if code == 0 else None
    wall = round(time.perf_counter() - running.began, 2)
    if running.late:
        return {"error": f"given up after {wall:.0f} s", "wall_seconds": wall}
    if result is not None:
        spent = {"cpu_seconds": round(running.cpu, 2)} if running.cpu else {}
        return {**_entry(result), **spent, "wall_seconds": wall}
    if code < 0:
        why = f"the process was killed by signal {-code}"
    else:
        lines = running.cried()[-1:] or [f"the process ended with code {code} and no result"]
        why = lines[0].strip().removeprefix("pamrs: error: ")
    return {"error": why, "wall_seconds": wall}


def _entry(result: dict[str, Any]) -> dict[str, Any]:
    seconds = result.get("seconds")
    known = isinstance(seconds, int | float) and math.isfinite(seconds)
    named = {
        "effects": [e.get("id") for e in result.get("effects") or []]
        if result["verdict"] == "effects"
        else [],
        "wrong_parameters": [w.get("name") for w in result.get("wrong_parameters") or []],
        "unexplained": [
            u.get("block")
            for u in result.get("unexplained") or []
            if u.get("verdict") == "unlisted"
        ],
    }
    return {
        "verdict": result["verdict"],
        **{key: v for key, v in named.items() if v},
        **({"seconds": seconds} if known else {}),
    }


def _said(entry: dict[str, Any]) -> str:
    """The outcome of a case in one line: verdict, names, and blocks that keep a mismatch without
    one.
    """
    if "error" in entry:
        return f"error: {entry['error']}"
    names = ", ".join(
        [
            *entry.get("effects", []),
            *(f"wrong {name}" for name in entry.get("wrong_parameters", [])),
        ]
    )
    kept = ", ".join(entry.get("unexplained", []))
    beside = f"; without a name in {kept}" if kept and entry["verdict"] != "unlisted" else ""
    return f"{entry['verdict']}{' ' * bool(names)}{names}{beside}"


def _before(results: Path) -> dict[str, Any]:
    """Entries of an earlier run."""
    try:
        cases = json.loads((results / "run.json").read_text(encoding="utf-8"))["cases"]
    except (OSError, ValueError, KeyError, TypeError):
        return {}
    return cases if isinstance(cases, dict) else {}


def _span(seconds: float) -> str:
    minutes = round(seconds / 60.0)
    if minutes < 1:
        return "less than a minute"
    return f"{minutes} min" if minutes < 90 else f"{seconds / 3600.0:.1f} h"


def prove(
    folder: str | os.PathLike[str],
    *,
    results: str | os.PathLike[str] | None = None,
    jobs: int = 1,
    limit: int | None = None,
    fresh: bool = False,
    timeout: float = TIMEOUT,
    say: Callable[[str], None] | None = None,
    command: Sequence[str] | None = None,
    allow_outside: bool = False,
) -> Proof:
    """Diagnose every case of a folder, each in a process of its own.

    Parameters
    ----------
    folder : path-like
        See :func:`cases_of`.
    results : path-like, optional
        Where ``NAME/out.json`` and ``run.json`` go; ``results`` in the folder by default.
    jobs : int
        Cases at a time.
    limit : int, optional
        Only the first so many cases.
    fresh : bool
        Diagnose again what has a result.
    timeout : float
        Time after which a case is given up [s].
    say : callable, optional
        Called with a line of text for each case.
    command : sequence of str, optional
        What diagnoses, given a case's folder, ``--json`` and the file to write; ``pamrs diagnose``
        by default.
    allow_outside : bool
        Whether rig files and recordings may lie outside the case folders.

    Returns
    -------
    Proof
        Verdicts and errors. A case that fails is an error in it, and is tried again by the next
        run.

    Raises
    ------
    ValueError
        If there is no case, or the manifest lists others.
    ValueError
        If `jobs` or `limit` is less than 1, or `timeout` not positive.
    """
    if not timeout > 0.0:
        raise ValueError(f"timeout = {timeout} s is not allowed: it must be positive")
    for name, value in (("jobs", jobs), ("limit", limit)):
        if value is not None and value < 1:
            raise ValueError(f"{name} = {value} is not allowed: it must be at least 1")
    found, manifest = cases_of(folder)
    target = Path(folder) / "results" if results is None else Path(results)
    target.mkdir(parents=True, exist_ok=True)
    tell = say or (lambda text: None)
    run = _Run.of(found[:limit], target, jobs, manifest, fresh=fresh)
    kept = len(run.entries)
    other = sum(entry.get("code") != run.code for entry in run.entries.values())
    if kept:
        tell(
            f"{kept} of {len(run.cases)} results are there"
            + (f", {other} of them made by other code (--fresh makes them again)" * bool(other))
        )
    run.record()
    outside = ["--allow-outside"] if allow_outside else []
    own = (sys.executable, "-m", "pamrs", "diagnose", "--quiet", *outside)
    with _signals() as check:
        run.finish(command or own, jobs, timeout, tell, check)
    return Proof(target, {case.name: run.entries[case.name] for case in run.cases}, kept)


@dataclass
class _Run:
    """Cases, what is known of them, and those that are still to be diagnosed."""

    cases: list[Path]
    target: Path
    code: str
    digests: dict[str, str]
    head: dict[str, Any]
    entries: dict[str, dict[str, Any]]
    waiting: list[Path]

    @classmethod
    def of(
        cls, cases: list[Path], target: Path, jobs: int, manifest: str | None, *, fresh: bool
    ) -> _Run:
        """These cases with what an earlier run left of them."""
        code, earlier, digests = (
            code_digest(),
            _before(target),
            {case.name: case_digest(case) for case in cases},
        )
        entries: dict[str, dict[str, Any]] = {}
        waiting: list[Path] = []
        for case in cases:
            result = None if fresh else valid_result(target / case.name / "out.json")
            known = earlier.get(case.name, {})
            if result is None or known.get("case_sha256", digests[case.name]) != digests[case.name]:
                waiting.append(case)
            else:
                entries[case.name] = {
                    **_entry(result),
                    **{k: v for k, v in known.items() if k != "error"},
                }
        told = {
            "schema": SCHEMA,
            "version": _version(),
            "code": code,
            "machine": _machine(),
            "jobs": jobs,
        }
        return cls(
            cases, target, code, digests, {**told, "manifest_sha256": manifest}, entries, waiting
        )

    def record(self) -> None:
        """Write what is known to ``run.json``."""
        ordered = {
            case.name: self.entries[case.name] for case in self.cases if case.name in self.entries
        }
        write(
            self.target / "run.json", json.dumps({**self.head, "cases": ordered}, indent=1) + "\n"
        )

    def finish(
        self,
        command: Sequence[str],
        jobs: int,
        timeout: float,
        tell: Callable[[str], None],
        check: Callable[[], None],
    ) -> None:
        """Diagnose what waits, so many cases at a time, each in a process of its own."""
        began, todo, kept = time.perf_counter(), len(self.waiting), len(self.entries)
        running: list[_Running] = []
        done = 0
        try:
            while self.waiting or running:
                check()
                while self.waiting and len(running) < jobs:
                    running.append(self._started(command, self.waiting.pop(0)))
                for slow in (r for r in running if time.perf_counter() - r.began > timeout):
                    slow.process.kill()
                    slow.process.wait()
                    slow.late = True
                ended = [r for r in running if r.has_ended()]
                for one in ended:
                    running.remove(one)
                    entry = self._entered(one)
                    done += 1
                    left = (time.perf_counter() - began) / done * (todo - done)
                    rest = f"; about {_span(left)} left" if done < todo else ""
                    place = f"[{kept + done}/{len(self.cases)}]"
                    tell(
                        f"{place} {one.case.name}: {_said(entry)}, {entry['wall_seconds']:.1f} "
                        f"s{rest}"
                    )
                if not ended:
                    time.sleep(_POLL)
        finally:
            for one in running:
                one.close()

    def _started(self, command: Sequence[str], case: Path) -> _Running:
        """A diagnosis of a case, whose earlier result is gone."""
        out = self.target / case.name / "out.json"
        out.parent.mkdir(exist_ok=True)
        out.unlink(missing_ok=True)
        return _launch(command, case, out)

    def _entered(self, ended: _Running) -> dict[str, Any]:
        """The entry of a case whose process has ended, recorded."""
        name = ended.case.name
        entry = _ended(ended, self.target / name / "out.json")
        ended.close()
        self.entries[name] = {
            **entry,
            "version": self.head["version"],
            "code": self.code,
            "case_sha256": self.digests[name],
        }
        self.record()
        return entry
