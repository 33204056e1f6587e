"""``python -m benchmarks.ablation FOLDER... --jobs N``: the judgement of read cases without each of
its parts, resumable.

Below ``FOLDER/kept`` there is what is kept of each case, and a folder for each part of the search.
"""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path

from benchmarks.ablation.kept import keep_cases
from benchmarks.ablation.without import PARTS, parts_table, weights_table
from pamrs.errors import PamrsError
from trial.concealed import write
from trial.prove import cases_of


def main(words: list[str] | None = None) -> int:
    """Run the command line; 0 when the tables are printed, 2 when the input is wrong."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.ablation", description=(__doc__ or "").splitlines()[0]
    )
    parser.add_argument("folders", type=Path, nargs="+", help="trials: cases/ and keys/ of each")
    parser.add_argument(
        "--first",
        type=int,
        help="diagnose so many cases of each (tables: all kept)",
    )
    parser.add_argument(
        "--part", nargs="*", default=PARTS, help="parts of the search (default all; none: prices)"
    )
    parser.add_argument("--jobs", type=int, default=1, help="processes (default 1)")
    parser.add_argument("--markdown", type=Path, help="write the tables here")
    args = parser.parse_args(words)
    for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"):
        os.environ[name] = "1"  # before the processes start; they inherit it

    def told(line: str) -> None:
        print(line, file=sys.stderr, flush=True)

    try:
        if args.jobs < 1 or (args.first is not None and args.first < 1):
            raise ValueError(f"--jobs = {args.jobs}, --first = {args.first}: at least 1 is needed")
        for folder in args.folders:
            cases = cases_of(folder)[0][: args.first]
            keep_cases(cases, folder / "kept", jobs=args.jobs, progress=told)
        prices = weights_table(args.folders)
        search = parts_table(args.folders, parts=args.part, jobs=args.jobs, progress=told)
    except (PamrsError, ValueError, OSError) as error:
        print(error, file=sys.stderr)
        return 2
    text = f"{prices}\n{search}" if args.part else prices
    print(text)
    if args.markdown is not None:
        write(args.markdown, text)
    return 0


if __name__ == "__main__":
    sys.exit(main())
