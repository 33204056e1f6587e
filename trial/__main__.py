"""Command line of the trial: ``python -m trial write``, ``make``, ``score``, ``pool``, ``insert``,
``report``, ``blocks`` and ``selfcheck``.
"""

from __future__ import annotations

import argparse
import hashlib
import sys
import time
from collections.abc import Callable
from pathlib import Path

from .blocks import blocks_page
from .concealed import WRONG, make_case, write
from .effects import KINDS, LISTED
from .pictures import figure
from .plan import MANIFEST, specs, write_plan
from .plan import PLANS as FIRST_PLANS
from .report import about, checked, report, run_of
from .score import score
from .second.cases import complete as second_complete
from .second.cases import make as second_make
from .second.design import PLANS as STRATA_PLANS
from .second.design import ROUND
from .second.design import specs as second_specs
from .second.inserted import all_inserted
from .second.inserted import table as insertion_table
from .second.marks import is_second, marks, plan_of
from .second.pooled import CASES, pooled, table_of_cases
from .second.pooled import page as pooled_page
from .second.tables import markdown as second_markdown
from .second.tables import scores as second_scores
from .second.tables import to_json
from .selfcheck import selfcheck
from .strength import LABELS, MEASURES
from .summary import markdown, target_table
from .targets import targets

#: plans of strata, as the help names them
_STRATA = ", ".join(STRATA_PLANS)
_MEASURE = (
    "what the multiple of the noise is of: all that the effect moves, or what a refit of the "
    "baseline leaves of it"
)


#: adds a command: its name, and what it is for as ``help``
Add = Callable[..., argparse.ArgumentParser]


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m trial", description="Blinded trial of the diagnosis on concealed data."
    )
    commands = parser.add_subparsers(dest="command", required=True)
    for add in (
        _add_write,
        _add_make,
        _add_score,
        _add_pool,
        _add_insert,
        _add_report,
        _add_blocks,
        _add_selfcheck,
    ):
        add(commands.add_parser)
    return parser


# ---------------------------------------------------------------------- write, make


def _add_write(add: Add) -> None:
    whole = add(
        "write", help="write the cases, keys and manifest of a plan; goes on where it was stopped"
    )
    whole.add_argument("folder", type=Path, help="gets cases/, keys/ and manifest.json")
    whole.add_argument("--plan", choices=(*FIRST_PLANS, *STRATA_PLANS), default="full")
    whole.add_argument("--cases", type=int, help="how many (default: the whole plan)")
    whole.add_argument("--seed", type=int, required=True)
    whole.add_argument(
        "--duration", type=float, help="seconds per recording (default: 30 to 40; plan small 12)"
    )
    whole.add_argument("--jobs", type=int, default=1, help="processes (default 1)")
    whole.add_argument(
        "--measure",
        choices=MEASURES,
        default="reach",
        help=f"{_MEASURE}; plans {_STRATA} always: what is left",
    )
    whole.add_argument(
        "--rig",
        type=Path,
        help=f"nominal rig file (default: the shoulder; plans {_STRATA} have several)",
    )
    whole.set_defaults(run=_write)


def _write(args: argparse.Namespace) -> None:
    if (args.cases is not None and args.cases < 1) or args.jobs < 1:
        raise ValueError("--cases and --jobs must be at least 1")

    def told(name: str, done: int, total: int) -> None:
        print(f"{name} written, {done} of {total}", file=sys.stderr, flush=True)

    if args.plan in STRATA_PLANS:
        if args.rig is not None:
            raise ValueError(f"plan {args.plan} has rigs of its own: leave --rig out")
        chosen = second_specs(args.seed, args.cases or 25 * ROUND, args.duration, args.plan)
        manifest = write_plan(
            args.folder,
            chosen,
            jobs=args.jobs,
            progress=told,
            make=second_make,
            complete=second_complete,
        )
        print(f"sha256 of the manifest: {hashlib.sha256(manifest.read_bytes()).hexdigest()}")
        return
    wanted = specs(args.plan, args.seed, args.cases, args.duration, args.measure, args.rig)
    manifest = write_plan(args.folder, wanted, jobs=args.jobs, rig=args.rig, progress=told)
    print(f"sha256 of the manifest: {hashlib.sha256(manifest.read_bytes()).hexdigest()}")


def _add_make(add: Add) -> None:
    make = add("make", help="write concealed cases and their keys")
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
        help=f"{', '.join((*KINDS, WRONG))}, random, or a pair a+b; may be repeated",
    )
    make.add_argument(
        "--seed",
        type=int,
        required=True,
        help="seed of the first case; the following cases count up",
    )
    make.add_argument("--repeat", type=int, default=1, help="cases per kind (default 1)")
    make.add_argument("--first", type=int, default=1, help="number of the first case (default 1)")
    make.add_argument(
        "--strength", type=float, default=1.0, help="size of the effects; 1 is moderate"
    )
    make.add_argument(
        "--wanted",
        choices=tuple(LABELS),
        help="scale each effect to this multiple of the noise instead",
    )
    make.add_argument(
        "--parameter",
        action="append",
        default=[],
        help=f"of the kind {WRONG}: a parameter as SECTION.NAME; may be repeated",
    )
    make.add_argument(
        "--tolerances",
        action="append",
        type=float,
        default=[],
        help="by how many tolerances it is off; once per parameter",
    )
    make.add_argument("--measure", choices=MEASURES, default="reach", help=_MEASURE)
    make.add_argument("--recordings", type=int, default=5, help="1 to 5 (default 5)")
    make.add_argument(
        "--duration", type=float, default=40.0, help="seconds per recording (default 40)"
    )
    make.add_argument("--rig", type=Path, help="nominal rig file (default: the shoulder)")
    make.set_defaults(run=_make)


def _make(args: argparse.Namespace) -> None:
    keys = args.keys_dir or args.out.with_name(args.out.name + "_keys")
    if len(args.parameter) != len(args.tolerances):
        raise ValueError("give --tolerances once for every --parameter")
    wrong = tuple(zip(args.parameter, args.tolerances, strict=True))
    if wrong and WRONG not in args.kind:
        raise ValueError(f"--parameter is for --kind {WRONG}")
    kinds = [k for k in args.kind for _ in range(args.repeat)]
    for i, kind in enumerate(kinds):
        start = time.perf_counter()
        name = f"case_{args.first + i:03d}"

        def publish(digest: str, case: str = name) -> None:
            print(f"{case} key sha256 {digest}", flush=True)

        make_case(
            args.out,
            keys,
            kind,
            seed=args.seed + i,
            name=name,
            strength=args.strength,
            wanted=args.wanted,
            measure=args.measure,
            recordings=args.recordings,
            duration=args.duration,
            rig=args.rig,
            publish=publish,
            wrong=wrong if kind == WRONG else (),
        )
        print(f"{name} written in {time.perf_counter() - start:.1f} s", file=sys.stderr, flush=True)


# ---------------------------------------------------------------- score, report, blocks


def _add_score(add: Add) -> None:
    mark = add("score", help="score results against the keys")
    mark.add_argument("--keys", type=Path, required=True)
    mark.add_argument(
        "--results", type=Path, required=True, help="folder with case_xxx/out.json or case_xxx.json"
    )
    mark.add_argument(
        "--catalogue",
        default=",".join(LISTED),
        help="effect ids that the diagnosis may name, comma separated",
    )
    mark.add_argument("--markdown", type=Path, help="write the tables here")
    mark.add_argument("--json", type=Path, help=f"of plans {_STRATA}: write the scores here")
    mark.add_argument(
        "--first", type=int, help=f"of plans {_STRATA}: only the first so many cases, by name"
    )
    mark.add_argument(
        "--command",
        dest="words",
        default="python -m trial score",
        help=f"of plans {_STRATA}: what makes the tables, as they say",
    )
    mark.add_argument("--figure", type=Path, help="draw the figure here (needs matplotlib)")
    mark.set_defaults(run=_score)


def _score_second(args: argparse.Namespace) -> None:
    """Score keys of the second plan, which must be those of the manifest where there is one."""
    folder, head = args.keys.parent, [f"# {plan_of(args.keys).capitalize()} plan\n"]
    if (folder / MANIFEST).is_file():
        digest, count = checked(folder)
        head += about(folder, digest, count, run_of(args.results, digest), args.words)
    told = second_scores(marks(args.keys, args.results, args.first))
    text = "\n".join([*head, second_markdown(told)])
    print(text)
    if args.markdown is not None:
        write(args.markdown, text)
    if args.json is not None:
        write(args.json, to_json(told))


def _score(args: argparse.Namespace) -> None:
    if is_second(args.keys):
        _score_second(args)
        return
    catalogue = tuple(c for c in args.catalogue.split(",") if c)
    scores = score(args.keys, args.results, catalogue)
    print(scores.text())
    print(f"\n{target_table(targets(scores, catalogue))}")
    if args.markdown is not None:
        write(args.markdown, markdown(scores, catalogue))
    if args.figure is not None:
        figure(scores, args.figure)


def _add_pool(add: Add) -> None:
    several = add("pool", help=f"tables of several scored trials of plans {_STRATA} together")
    several.add_argument(
        "scores",
        type=Path,
        nargs="+",
        help="what `score --json` wrote, one file for each trial, and tables of cases",
    )
    several.add_argument("--only", default="", help="trials whose name begins with these letters")
    several.add_argument("--cases", type=Path, help=f"write all cases as one table here ({CASES})")
    several.add_argument("--markdown", type=Path, help="write the tables here")
    several.set_defaults(run=_pool)


def _pool(args: argparse.Namespace) -> None:
    trials = pooled(args.scores, args.only)
    if args.cases is not None:
        if not args.cases.name.endswith(CASES):
            raise ValueError(f"--cases {args.cases}: the name must end in {CASES}")
        args.cases.write_bytes(table_of_cases(trials))
    text = pooled_page(trials)
    print(text)
    if args.markdown is not None:
        write(args.markdown, text)


def _add_insert(add: Add) -> None:
    again = add(
        "insert",
        help=f"of plans {_STRATA}: diagnose each missed case again with its truth inserted, and "
        "say whether the search or the weighing failed",
    )
    again.add_argument("folder", type=Path, help="the trial: cases/ and keys/")
    again.add_argument(
        "--results", type=Path, help="results of `pamrs prove` (default: FOLDER/results)"
    )
    again.add_argument("--markdown", type=Path, help="write the table here")
    again.set_defaults(run=_insert)


def _insert(args: argparse.Namespace) -> None:
    def told(line: str) -> None:
        print(line, file=sys.stderr, flush=True)

    if not is_second(args.folder / "keys"):
        raise ValueError(f"{args.folder}: no keys of plans {_STRATA} in its folder keys")
    results = args.results or args.folder / "results"
    text = insertion_table(all_inserted(args.folder, results, told))
    print(text)
    if args.markdown is not None:
        write(args.markdown, text)


def _add_report(add: Add) -> None:
    page = add(
        "report",
        help="score a whole trial and write its page, trial.md, with pictures (needs matplotlib)",
    )
    page.add_argument("folder", type=Path, help="the trial: cases/, keys/ and manifest.json")
    page.add_argument(
        "--results",
        type=Path,
        help="results of `pamrs prove` and of the baselines (default: FOLDER/results)",
    )
    page.add_argument(
        "--out", type=Path, required=True, help="folder for the page and the pictures"
    )
    page.add_argument(
        "--command",
        dest="words",
        default="python -m trial report",
        help="what makes the page, as it says",
    )
    page.set_defaults(run=_report)


def _report(args: argparse.Namespace) -> None:
    results = args.results or args.folder / "results"
    print(f"written: {report(args.folder, results, args.out, args.words)}")


def _add_blocks(add: Add) -> None:
    apart = add("blocks", help="score a trial of plan blocks and write its page, blocks.md")
    apart.add_argument("folder", type=Path, help="the trial: cases/, keys/ and manifest.json")
    apart.add_argument(
        "--results", type=Path, help="results of `pamrs prove` (default: FOLDER/results)"
    )
    apart.add_argument("--out", type=Path, required=True, help="folder for the page")
    apart.add_argument(
        "--command",
        dest="words",
        default="python -m trial blocks",
        help="what makes the page, as it says",
    )
    apart.add_argument(
        "--first",
        type=int,
        help="only the first so many cases, where a run was ended before the last",
    )
    apart.set_defaults(run=_blocks)


def _blocks(args: argparse.Namespace) -> None:
    if args.first is not None and args.first < 1:
        raise ValueError(f"--first {args.first} is not allowed: at least 1")
    results = args.results or args.folder / "results"
    print(f"written: {blocks_page(args.folder, results, args.out, args.words, first=args.first)}")


# ------------------------------------------------------------------------- selfcheck


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
        args.run(args)
    except (ValueError, OSError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
