"""One case through every baseline, and many cases in processes of their own."""

from __future__ import annotations

import json
import multiprocessing
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path
from typing import Any

from benchmarks.baselines.sheet import errors, gap_closed, sheet
from pamrs._writing import write_atomically
from trial.prove import case_digest

SCHEMA = "pamrs.baselines/1"
METHODS = ("refit", "free", "sindy", "gp")


def examined(folder: Path) -> dict[str, Any]:
    """Every baseline on one case.

    Parameters
    ----------
    folder : Path
        The case; nothing else is looked at.

    Returns
    -------
    dict
        Schema ``pamrs.baselines/1``: by channel the held-out errors [SI], the gap closed by method,
        whether refitting alone raises an alarm.
    """
    from benchmarks.baselines import gaussian, sindy

    began = time.perf_counter()
    laid = sheet(folder)
    seconds = {"refit": time.perf_counter() - began}
    table: dict[str, dict[str, float]] = {}
    for column in laid.columns:
        refit, noise = errors(column)
        free = errors(column, free=True)[0]
        table[column.block.channel] = {"noise": noise, "refit": refit, "free": free}
    models: dict[str, dict[str, str]] = {}
    for method, correct in (("sindy", sindy.correct), ("gp", gaussian.correct)):
        began = time.perf_counter()
        models[method] = {}
        for column in laid.columns:
            corrections, words = correct(column)
            table[column.block.channel][method] = errors(column, corrections)[0]
            models[method][column.block.name] = words
        seconds[method] = time.perf_counter() - began
    return {
        "schema": SCHEMA,
        "case": laid.name,
        "case_sha256": case_digest(folder),
        "held_out": table,
        "gap_closed": {method: gap_closed(table, method) for method in METHODS},
        "detected": {"refit": laid.detected},
        "p_value": laid.p_value,
        "moved_tolerances": laid.moved,
        "named": None,
        "models": models,
        "seconds": {method: round(value, 2) for method, value in seconds.items()},
    }


def valid(path: Path, case: Path) -> bool:
    """Whether the result of a case is there whole."""
    try:
        told = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return False
    return (
        isinstance(told, dict)
        and told.get("schema") == SCHEMA
        and told.get("case_sha256") == case_digest(case)
    )


def _work(folder: Path, out: Path) -> str | None:
    try:
        write_atomically(out, json.dumps(examined(folder), indent=1) + "\n")
    except Exception as error:  # whatever it is, the other cases go on
        return f"{type(error).__name__}: {error}".splitlines()[0]
    return None


def run(cases: list[Path], out: Path, jobs: int, say: Callable[[str], None]) -> dict[str, str]:
    """Every case that has no result yet; those that failed, with what they said."""
    out.mkdir(parents=True, exist_ok=True)
    waiting = [c for c in cases if not valid(out / f"{c.name}.json", c)]
    done, failed, began = len(cases) - len(waiting), {}, time.perf_counter()
    if done:
        say(f"{done} of {len(cases)} results are there")
    start = done
    with ProcessPoolExecutor(jobs, mp_context=multiprocessing.get_context("spawn")) as pool:
        tasks = {
            pool.submit(_work, c.resolve(), (out / f"{c.name}.json").resolve()): c.name
            for c in waiting
        }
        try:
            for task in as_completed(tasks):
                try:
                    error = task.result()
                except BrokenProcessPool as broken:
                    error = str(broken)
                if error is not None:
                    failed[tasks[task]] = error
                done += 1
                left = (time.perf_counter() - began) / (done - start) * (len(cases) - done)
                say(
                    f"[{done}/{len(cases)}] {tasks[task]}: "
                    f"{'error: ' + error if error else 'done'}; about {left / 60:.0f} min left"
                )
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise
    return failed
