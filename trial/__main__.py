"""Command line of the trial: ``python -m trial write``, ``prove``, ``score``, ``pool``, ``insert``,
``make``, ``campaign`` and ``selfcheck``.
"""

from __future__ import annotations

import argparse
import hashlib
import sys
from collections.abc import Callable
from pathlib import Path

from .campaign import RIGS as CAMPAIGN_RIGS
from .campaign import draw, highest, scored, specs_of_campaigns, trial_of_campaigns
from .campaign import page as campaign_page
from .concealed import make_case, write
from .design import PLANS, ROUND, SECOND, specs
from .effects import KINDS
from .inserted import all_inserted
from .inserted import table as insertion_table
from .marks import marks, plan_of
from .plan import MANIFEST, write_plan
from .pooled import CASES, pooled, table_of_cases
from .pooled import page as pooled_page
from .prove import TIMEOUT, prove
from .report import about, checked, run_of
from .selfcheck import selfcheck
from .tables import markdown, scores, to_json

#: Exit code when a case could not be diagnosed.
INCOMPLETE = 3

#: adds a command: its name, and what it is for as ``help``
Add = Callable[..., argparse.ArgumentParser]


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m trial", description="Blinded trial of the diagnosis on concealed data."
    )
    commands = parser.add_subparsers(dest="command", required=True)
    for add in (_add_write, _add_prove, _add_score, _add_pool, _add_insert, _add_make):
        add(commands.add_parser)
    _add_campaign(commands.add_parser)
    _add_selfcheck(commands.add_parser)
    return parser


def _shown(text: str, file: Path | None) -> None:
    """Print a page, and write it where a file is given."""
    print(text)
    if file is not None:
        write(file, text)


def _add_write(add: Add) -> None:
    whole = add(
        "write", help="write the cases, keys and manifest of a plan; goes on where it was stopped"
    )
    whole.add_argument("folder", type=Path, help="gets cases/, keys/ and manifest.json")
    whole.add_argument(
        "--plan", choices=PLANS, default=SECOND, help=f"which rigs (default {SECOND})"
    )
    whole.add_argument("--cases", type=int, default=25 * ROUND, help=f"default {25 * ROUND}")
    whole.add_argument("--seed", type=int, required=True)
    whole.add_argument("--duration", type=float, help="seconds per recording (default: 8 to 60)")
    whole.add_argument("--jobs", type=int, default=1, help="processes (default 1)")
    whole.set_defaults(run=_write)


def _write(args: argparse.Namespace) -> None:
    if args.cases < 1 or args.jobs < 1:
        raise ValueError("--cases and --jobs must be at least 1")

    def told(name: str, done: int, total: int) -> None:
        print(f"{name} written, {done} of {total}", file=sys.stderr, flush=True)

    chosen = specs(args.seed, args.cases, args.duration, args.plan)
    manifest = write_plan(args.folder, chosen, jobs=args.jobs, progress=told)
    print(f"sha256 of the manifest: {hashlib.sha256(manifest.read_bytes()).hexdigest()}")


def _add_prove(add: Add) -> None:
    run = add(
        "prove",
        help="diagnose every case, each in a process that is given that case alone; answer keys "
        "are not opened; goes on where it was stopped; exit code 3: some case has no result",
    )
    run.add_argument(
        "folder", type=Path, help="cases/NAME/case.toml or NAME/case.toml, and maybe manifest.json"
    )
    run.add_argument(
        "--results", type=Path, help="gets NAME/out.json and run.json (default: FOLDER/results)"
    )
    run.add_argument("--jobs", type=int, default=1, help="cases at a time (default 1)")
    run.add_argument("--limit", type=int, help="only the first so many cases")
    run.add_argument("--fresh", action="store_true", help="diagnose again what has a result")
    run.add_argument(
        "--allow-outside", action="store_true", help="files may lie outside the folder of a case"
    )
    run.add_argument(
        "--timeout",
        type=float,
        default=TIMEOUT,
        help=f"seconds after which a case is given up (default {TIMEOUT:g})",
    )
    run.set_defaults(run=_prove)


def _prove(args: argparse.Namespace) -> int:
    def told(line: str) -> None:
        print(line, file=sys.stderr, flush=True)

    proof = prove(
        args.folder,
        results=args.results,
        jobs=args.jobs,
        limit=args.limit,
        fresh=args.fresh,
        timeout=args.timeout,
        say=told,
        allow_outside=args.allow_outside,
    )
    print(proof.table())
    for name, error in proof.failed.items():
        print(f"{name}: {error}")
    told(f"written: {proof.results}")
    return INCOMPLETE if proof.failed else 0


def _add_score(add: Add) -> None:
    mark = add("score", help="score results against the keys")
    mark.add_argument("--keys", type=Path, required=True)
    mark.add_argument(
        "--results", type=Path, required=True, help="folder with case_xxx/out.json or case_xxx.json"
    )
    mark.add_argument("--markdown", type=Path, help="write the tables here")
    mark.add_argument("--json", type=Path, help="write the scores here")
    mark.add_argument("--first", type=int, help="only the first so many cases, by name")
    mark.add_argument(
        "--command",
        dest="words",
        default="python -m trial score",
        help="what makes the tables, as they say",
    )
    mark.set_defaults(run=_score)


def _score(args: argparse.Namespace) -> None:
    """Score keys, which must be those of the manifest where there is one."""
    found = marks(args.keys, args.results, args.first)
    folder, head = args.keys.parent, [f"# {plan_of(args.keys).capitalize()} plan\n"]
    if (folder / MANIFEST).is_file():
        digest, count = checked(folder)
        head += about(folder, digest, count, run_of(args.results, digest), args.words)
    told = scores(found)
    _shown("\n".join([*head, markdown(told)]), args.markdown)
    if args.json is not None:
        write(args.json, to_json(told))


def _add_pool(add: Add) -> None:
    several = add("pool", help="tables of several scored trials together")
    several.add_argument(
        "scores",
        type=Path,
        nargs="+",
        help="what `score --json` wrote, one file for each trial, and tables of cases",
    )
    several.add_argument("--only", default="", help="trials whose name begins with these letters")
    several.add_argument("--cases", type=Path, help=f"write all cases as one table here ({CASES})")
    several.add_argument("--markdown", type=Path, help="write the tables here")
    several.add_argument("--diagram", type=Path, help="write the reliability diagram here (SVG)")
    several.set_defaults(run=_pool)


def _pool(args: argparse.Namespace) -> None:
    trials = pooled(args.scores, args.only)
    if args.cases is not None:
        if not args.cases.name.endswith(CASES):
            raise ValueError(f"--cases {args.cases}: the name must end in {CASES}")
        args.cases.write_bytes(table_of_cases(trials))
    if args.diagram is not None:
        from .diagram import reliability_diagram  # matplotlib, which no other command needs

        reliability_diagram([mark for marks in trials.values() for mark in marks], args.diagram)
    _shown(pooled_page(trials), args.markdown)


def _add_insert(add: Add) -> None:
    again = add(
        "insert",
        help="diagnose each missed case again with its truth inserted, and say whether the search "
        "or the weighing failed",
    )
    again.add_argument("folder", type=Path, help="the trial: cases/ and keys/")
    again.add_argument("--results", type=Path, help="results of `prove` (default: FOLDER/results)")
    again.add_argument("--markdown", type=Path, help="write the table here")
    again.set_defaults(run=_insert)


def _insert(args: argparse.Namespace) -> None:
    def told(line: str) -> None:
        print(line, file=sys.stderr, flush=True)

    results = args.results or args.folder / "results"
    _shown(insertion_table(all_inserted(args.folder, results, told)), args.markdown)


def _add_make(add: Add) -> None:
    make = add("make", help="write single cases of the shoulder, and their keys")
    make.add_argument("--out", type=Path, required=True, help="folder for the cases")
    make.add_argument(
        "--keys-dir",
        type=Path,
        help="folder for the answer keys (default: OUT with '_keys' appended)",
    )
    make.add_argument(
        "--kind",
        action="append",
        required=True,
        help=f"{', '.join(KINDS)}, random, or a pair a+b; may be repeated",
    )
    make.add_argument(
        "--seed",
        type=int,
        required=True,
        help="seed of the first case; the following cases count up",
    )
    make.add_argument(
        "--strength", type=float, default=1.0, help="size of the effects; 1 is moderate"
    )
    make.add_argument("--recordings", type=int, default=5, help="1 to 5 (default 5)")
    make.add_argument(
        "--duration", type=float, default=40.0, help="seconds per recording (default 40)"
    )
    make.add_argument("--rig", type=Path, help="nominal rig file (default: the shoulder)")
    make.set_defaults(run=_make)


def _make(args: argparse.Namespace) -> None:
    keys = args.keys_dir or args.out.with_name(args.out.name + "_keys")
    for i, kind in enumerate(args.kind):
        name = f"case_{1 + i:03d}"

        def publish(digest: str, case: str = name) -> None:
            print(f"{case} key sha256 {digest}", flush=True)

        make_case(
            args.out,
            keys,
            kind,
            seed=args.seed + i,
            name=name,
            strength=args.strength,
            recordings=args.recordings,
            duration=args.duration,
            rig=args.rig,
            publish=publish,
        )


def _add_campaign(add: Add) -> None:
    whole = add(
        "campaign",
        help="campaigns from one free log, against multisines and a fixed protocol; goes on where "
        "it was stopped",
    )
    whole.add_argument("folder", type=Path, help="gets cases/, keys/, results/, campaign.md, .svg")
    whole.add_argument("--seed", type=int, required=True)
    whole.add_argument("--cases", type=int, default=24, help="default 24")
    whole.add_argument("--jobs", type=int, default=1, help="cases at a time (default 1)")
    whole.add_argument(
        "--rigs", nargs="+", choices=CAMPAIGN_RIGS, default=CAMPAIGN_RIGS, help="default: all five"
    )
    whole.set_defaults(run=_campaign)


def _campaign(args: argparse.Namespace) -> None:
    if args.cases < 1 or args.jobs < 1:
        raise ValueError("--cases and --jobs must be at least 1")

    def told(line: str) -> None:
        print(line, file=sys.stderr, flush=True)

    wanted = specs_of_campaigns(args.seed, args.cases, args.rigs)
    trial_of_campaigns(args.folder, wanted, args.jobs, told)
    names = [spec.name for spec in wanted]
    found = scored(args.folder, names)
    draw(found, args.folder / "campaign.svg")
    ratios = highest(args.folder, names)
    _shown(campaign_page(found, len(names), ratios), args.folder / "campaign.md")


def _add_selfcheck(add: Add) -> None:
    check = add("selfcheck", help="compare the plant with finer steps and with another integrator")
    check.add_argument(
        "--golden", type=Path, help="folder with golden vectors of the plant without effects"
    )
    check.set_defaults(run=_selfcheck)


def _selfcheck(args: argparse.Namespace) -> None:
    print(selfcheck(args.golden))


def main(argv: list[str] | None = None) -> int:
    """Run the command line; returns the exit code."""
    args = _parser().parse_args(argv)
    try:
        return args.run(args) or 0
    except (ValueError, OSError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 2


if __name__ == "__main__":
    raise SystemExit(main())
