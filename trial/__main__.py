"""Command line of the trial: ``python -m trial make`` and ``python -m trial score``."""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

from .concealed import make_case
from .effects import KINDS, LISTED
from .score import score
from .selfcheck import selfcheck


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m trial", description="Blinded trial of the diagnosis on concealed data.")
    sub = parser.add_subparsers(dest="command", required=True)
    make = sub.add_parser("make", help="write concealed cases and their keys")
    make.add_argument("--out", type=Path, required=True, help="folder for the cases")
    make.add_argument("--keys-dir", type=Path, help="folder for the answer keys (default: OUT with '_keys' appended)")
    make.add_argument(
        "--kind",
        action="append",
        required=True,
        help=f"{', '.join(KINDS)}, random, or a pair a+b; may be repeated",
    )
    make.add_argument("--seed", type=int, required=True, help="seed of the first case; the following cases count up")
    make.add_argument("--repeat", type=int, default=1, help="cases per kind (default 1)")
    make.add_argument("--first", type=int, default=1, help="number of the first case (default 1)")
    make.add_argument("--strength", type=float, default=1.0, help="size of the effects; 1 is typical")
    make.add_argument("--recordings", type=int, default=5, help="1 to 5 (default 5)")
    make.add_argument("--duration", type=float, default=40.0, help="seconds per recording (default 40)")
    make.add_argument("--rig", type=Path, help="nominal rig file (default: the shoulder)")
    mark = sub.add_parser("score", help="score results against the keys")
    mark.add_argument("--keys", type=Path, required=True)
    mark.add_argument("--results", type=Path, required=True, help="folder with case_xxx/out.json or case_xxx.json")
    mark.add_argument(
        "--catalogue",
        default=",".join(LISTED),
        help="effect ids that the diagnosis may name, comma separated",
    )
    sub.add_parser("selfcheck", help="compare the plant with an adaptive reference and with the golden vectors")
    return parser


def main(argv: list[str] | None = None) -> int:
    """Run the command line; returns the exit code."""
    args = _parser().parse_args(argv)
    try:
        if args.command == "make":
            keys = args.keys_dir or args.out.with_name(args.out.name + "_keys")
            kinds = [k for k in args.kind for _ in range(args.repeat)]
            for i, kind in enumerate(kinds):
                start = time.perf_counter()
                name = f"case_{args.first + i:03d}"

                def publish(digest: str, case: str = name) -> None:
                    print(f"{case} key sha256 {digest}", flush=True)

                make_case(
                    args.out, keys, kind, seed=args.seed + i, name=name, strength=args.strength,
                    recordings=args.recordings, duration=args.duration, rig=args.rig, publish=publish,
                )  # fmt: skip
                print(f"{name} written in {time.perf_counter() - start:.1f} s", file=sys.stderr, flush=True)
        elif args.command == "score":
            print(score(args.keys, args.results, tuple(c for c in args.catalogue.split(",") if c)).text())
        else:
            print(selfcheck())
    except (ValueError, OSError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
