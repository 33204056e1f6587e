"""Weights by what is left, weights by prediction, and both, on the same hypotheses.

Each case of a written trial (`python -m trial write`) is diagnosed once; the hypotheses of each
group of blocks that keeps a mismatch are then weighed again by every scheme. A leading hypothesis
is right when one of its names acts in the case. Of each scheme: how many lead right, the mean
logarithm of the probability of what is right, the Brier score of the leading name, and how many of
those stated above 0.9 are right; probabilities are those among names, as they are before they are
calibrated.

Run it with ``python -m benchmarks.evidence TRIAL [TRIAL ...]``.
"""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any
from unittest import mock

import pamrs
from pamrs.diagnosis.evidence import weigh
from pamrs.effects import id_of
from pamrs.errors import PamrsError
from trial.inserted import truth_of

SCHEMES = {"what is left": 0.0, "prediction": 1.0, "both": 0.5}
"""Share of prediction in each scheme."""
LEAST = 1e-3
SURE = 0.9


@dataclass
class Score:
    """Groups of blocks, as one scheme weighs their names."""

    right: int = 0
    groups: int = 0
    logs: list[float] = field(default_factory=list)
    brier: list[float] = field(default_factory=list)
    sure: list[bool] = field(default_factory=list)

    def add(self, probabilities: Mapping[str, float], truth: set[str]) -> None:
        """Count one group, by its names alone."""
        named = {key: p for key, p in probabilities.items() if key not in ("", "unlisted")}
        whole = sum(named.values())
        if whole <= 0.0:
            return
        true = {key for key in named if {id_of(name) for name in key.split("+")} & truth}
        best = max(named, key=lambda key: named[key])
        stated, right = named[best] / whole, best in true
        self.groups += 1
        self.right += right
        self.logs.append(math.log(max(LEAST, sum(named[key] for key in true) / whole)))
        self.brier.append((stated - right) ** 2)
        if stated > SURE:
            self.sure.append(right)


def weighed(case: Path) -> Iterator[dict[str, dict[str, float]]]:
    """Of each group of blocks that keeps a mismatch: its probabilities by every scheme."""
    last: dict[tuple[str, ...], tuple[Any, ...]] = {}

    def kept(
        candidates: Any,
        suspects: Any,
        most: float,
        seconds: float,
        settings: Any,
        ranging: Any,
        own: Any = None,
    ) -> dict[str, float]:
        if own is None:  # and not one block of a group by itself
            last[tuple(b.name for b in suspects)] = (
                (candidates, suspects, most, seconds),
                settings,
                ranging,
            )
        return weigh(candidates, suspects, most, seconds, settings, ranging, own)

    with mock.patch("pamrs.diagnosis.search._hypotheses.weigh", kept):
        pamrs.diagnose(case)
    for given, settings, ranging in last.values():
        yield {
            scheme: weigh(
                *given,
                replace(settings, evidence=replace(settings.evidence, predictive_share=share)),
                ranging,
            )
            for scheme, share in SCHEMES.items()
        }


def main(folders: list[str]) -> int:
    """Diagnose all cases of some trials, and print the table."""
    scores = {scheme: Score() for scheme in SCHEMES}
    for folder in map(Path, folders):
        for file in sorted((folder / "keys").glob("*.json")):
            key = json.loads(file.read_text(encoding="utf-8"))
            truth = {name for name in truth_of(key).split("+") if name}
            if not truth:
                continue
            print(f"{folder}: {key['case']}", file=sys.stderr)
            try:
                for found in weighed(folder / "cases" / str(key["case"])):
                    for scheme, probabilities in found.items():
                        scores[scheme].add(probabilities, truth)
            except PamrsError as error:
                print(f"{key['case']}: {error}", file=sys.stderr)
    print("| weights by | leading right | log score, mean | Brier | above 0.9 right |")
    print("|---|---|---|---|---|")
    for scheme, score in scores.items():
        count = max(1, score.groups)
        print(
            f"| {scheme} | {score.right} of {score.groups} | {sum(score.logs) / count:.3f} "
            f"| {sum(score.brier) / count:.3f} | {sum(score.sure)} of {len(score.sure)} |"
        )
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
