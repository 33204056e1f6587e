"""``python -m benchmarks.baselines FOLDER --results DIR --jobs N``: the baselines on the cases of a
trial, resumable.

Writes ``DIR/baselines/NAME.json`` for each case. The keys are opened after the last case only,
where there are some, for the table of the gap closed by every method, that of pamrs
beside them.
"""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path

from pamrs.errors import PamrsError
from trial.peers import beside, peers_page
from trial.plan import MANIFEST
from trial.prove import cases_of
from trial.report import checked


def main(words: list[str] | None = None) -> int:
    """Run the command line; 0 when every case has a result, 3 when some failed, 2 when the input is
    wrong.
    """
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.baselines", description=(__doc__ or "").splitlines()[0]
    )
    parser.add_argument("folder", type=Path, help="the trial: cases/, and keys/ for the table")
    parser.add_argument(
        "--results",
        type=Path,
        help="results of `python -m trial prove`; gets baselines/ (default: FOLDER/results)",
    )
    parser.add_argument("--jobs", type=int, default=1, help="processes (default 1)")
    parser.add_argument("--limit", type=int, help="only the first so many cases")
    parser.add_argument(
        "--markdown", type=Path, help="write the table here, not to standard output only"
    )
    args = parser.parse_args(words)
    for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"):
        os.environ[name] = "1"  # before the workers start; they inherit it
    from benchmarks.baselines.run import run

    try:
        if args.jobs < 1 or (args.limit is not None and args.limit < 1):
            raise ValueError(f"--jobs = {args.jobs}, --limit = {args.limit}: at least 1 is needed")
        cases = cases_of(args.folder)[0][: args.limit]
        results = args.results or args.folder / "results"
        failed = run(
            cases,
            results / "baselines",
            args.jobs,
            lambda text: print(text, file=sys.stderr, flush=True),
        )
        keys = args.folder / "keys"
        if keys.is_dir():
            text = peers_page(beside(keys, results), _made(args.folder))
            print(text)
            if args.markdown is not None:
                args.markdown.write_text(text + "\n", encoding="utf-8")
    except (PamrsError, ValueError, OSError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    for name, why in failed.items():
        print(f"{name}: {why}")
    return 3 if failed else 0


def _made(folder: Path) -> str:
    """Of which trial and by which command a page of the second plan is."""
    words = " Made by `python -m benchmarks.baselines second_out --markdown PAGE`."
    if not (folder / MANIFEST).is_file():
        return words
    return f"{words} SHA-256 of the manifest: `{checked(folder)[0]}`."


if __name__ == "__main__":
    raise SystemExit(main())
