"""The page of a trial of plan `blocks`: naming beside an effect of no catalogue, and parameters
that are far off.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from statistics import mean, median

from .concealed import write
from .effects import LISTED
from .plan import SIZES
from .report import about, checked, run_of
from .score import Row, Scores, score
from .strength import LABELS
from .summary import percent, table

#: what an effect of the gas blocks stands beside, by the label of the second effect
BESIDE = {"": "alone", "strong": "beside 10 noises", "heavy": "beside 20 noises"}
#: largest number of tolerances of each size; two sizes are told apart half way between them
_EDGES = [0.5 * (one[1] + two[0]) for one, two in zip(SIZES, SIZES[1:], strict=False)]


def beside(row: Row) -> str:
    """What the effect of a case stands beside, in words."""
    return BESIDE.get(row.labels[1] if len(row.labels) > 1 else "", "beside another")


def size_of(tolerances: float) -> str:
    """Size class of a parameter that is far off."""
    low, high = SIZES[sum(abs(tolerances) > edge for edge in _EDGES)]
    return f"{low:g} to {high:g} tolerances"


def _hits(rows: Sequence[Row]) -> int:
    return sum(r.outcome == "right" for r in rows)


def _mean(values: Iterable[float | None]) -> str:
    kept = [v or 0.0 for v in values]
    return f"{mean(kept):.3f}" if kept else "-"


def _share(told: Iterable[bool]) -> str:
    kept = list(told)
    return f"{sum(kept)} of {len(kept)}" if kept else "-"


def _both(told: Iterable[bool]) -> str:
    kept = list(told)
    return f"{sum(kept)} of {len(kept)}; {percent(sum(kept), len(kept))}" if kept else "-"


def _naming(rows: Sequence[Row], labels: Sequence[str]) -> str:
    """Right names by strength and by what stands beside; the difference to the same effects
    alone.
    """
    body = []
    for name, chosen in [
        *((f"{label}, {LABELS[label]:g} noises", [label]) for label in labels),
        ("all", list(labels)),
    ]:
        kept = [r for r in rows if r.labels and r.labels[0] in chosen]
        groups = {words: [r for r in kept if beside(r) == words] for words in BESIDE.values()}
        alone = groups["alone"]
        for words, group in groups.items():
            points, changed = "-", "-"
            if words != "alone" and group and alone:
                points = f"{100.0 * (_hits(group) / len(group) - _hits(alone) / len(alone)):+.1f}"
                # the same effect of the same case, alone and not
                before = {(r.seed, r.ids[0]): r.outcome == "right" for r in alone}
                pairs = [
                    (before[r.seed, r.ids[0]], r.outcome == "right")
                    for r in group
                    if (r.seed, r.ids[0]) in before
                ]
                changed = (
                    f"{sum(a and not b for a, b in pairs)}, {sum(b and not a for a, b in pairs)}"
                )
            chance = _mean(r.name_probability for r in group)
            contains = _share(r.contains for r in group)
            body.append(
                (
                    name,
                    words,
                    _both(r.outcome == "right" for r in group),
                    points,
                    changed,
                    contains,
                    chance,
                )
            )
    head = (
        "strength",
        "",
        "right name first (95 % interval)",
        "difference, points",
        "lost, gained",
        "name or set holds it",
    )
    return table((*head, "mean probability on the name"), body)


def _by(rows: Sequence[Row], heading: str, key: Callable[[Row], str]) -> str:
    """Right names and mean probability by any property and by what stands beside."""
    body = []
    for name in sorted({key(r) for r in rows}):
        groups = [
            [r for r in rows if key(r) == name and beside(r) == words] for words in BESIDE.values()
        ]
        body.append(
            (
                name,
                *(
                    (
                        f"{_share(r.outcome == 'right' for r in g)}; "
                        f"{_mean(r.name_probability for r in g)}"
                    )
                    if g
                    else "-"
                    for g in groups
                ),
            )
        )
    return table((heading, *BESIDE.values()), body)


def _rest(rows: Sequence[Row]) -> str:
    """What is said of the unexplained rest, where there is one and where there is none."""
    body = []
    for words in BESIDE.values():
        group = [r for r in rows if beside(r) == words]
        there = [r.rest_said for r in group if r.rest_said is not None]
        none = [bool(r.unexplained) for r in group if not r.mixed]
        body.append((words, _both(there), _both(none)))
    return table(
        ("", "unexplained rest is said, in the right block", "said where there is none"), body
    )


def _far(rows: Sequence[Row]) -> str:
    """Parameters far off: named, in a set, false names, intervals and held-out recordings."""
    body = []

    def line(name: str, group: Sequence[Row]) -> None:
        if not group:
            return
        other = [bool(set(r.wrong_named) - {n for n, _ in r.wrong}) for r in group]
        held = [r.held_out for r in group if r.held_out is not None]
        body.append(
            (
                name,
                _both(r.outcome == "right" for r in group),
                _share(r.contains for r in group),
                _share(other),
                _share(r.false_name for r in group),
                _share(r.interval_holds for r in group if r.interval_holds is not None),
                f"{median(held):.2f}" if held else "-",
                _mean(r.probability for r in group),
            )
        )

    for name in dict.fromkeys(n for r in sorted(rows, key=lambda r: r.wrong) for n, _ in r.wrong):
        line(name, [r for r in rows if name in dict(r.wrong)])
    for way, sign in (("upwards", 1.0), ("downwards", -1.0)):
        for low, high in SIZES:
            size = f"{low:g} to {high:g} tolerances"
            line(
                f"{way}, {size}",
                [r for r in rows if sign * r.wrong[0][1] > 0.0 and size_of(r.wrong[0][1]) == size],
            )
        line(way, [r for r in rows if sign * r.wrong[0][1] > 0.0])
    line("all", rows)
    head = (
        "wrong parameter",
        "named (95 % interval)",
        "named or a set holds it",
        "another parameter named",
        "an effect, unlisted or a rest claimed",
    )
    return table(
        (*head, "95 % interval holds the value", "held out, error / noise", "mean probability"),
        body,
    )


def _false(rows: Sequence[Row]) -> str:
    """False names where no effect is concealed."""
    body = []
    groups = {
        "none": [r for r in rows if r.healthy and r.truth == "none"],
        "parameters, 1.5 to 2.5 tolerances": [r for r in rows if r.healthy and r.truth != "none"],
        "wrong parameter": [r for r in rows if r.wrong],
    }
    for name, group in (*groups.items(), ("all", [r for g in groups.values() for r in g])):
        claimed = [r.detected for r in group]
        left = [bool(r.unexplained) and not r.detected for r in group]
        called = [bool(r.wrong_named) for r in group if not r.wrong]
        body.append(
            (
                name,
                str(len(group)),
                _share(claimed),
                _share(left),
                _share(called),
                _both(r.false_name for r in group),
            )
        )
    head = (
        "truth",
        "cases",
        "an effect or unlisted is the verdict",
        "only a rest called unexplained",
    )
    return table((*head, "a parameter called wrong on a null", "false names (95 % interval)"), body)


def _truth(row: Row) -> str:
    if row.wrong:
        return ", ".join(f"{name} {z:+.1f} tolerances" for name, z in row.wrong)
    if not row.ids:
        return row.truth
    labels = row.labels or ("",) * len(row.ids)
    return " beside ".join(
        f"{name} ({label})" if label else name for name, label in zip(row.ids, labels, strict=True)
    )


def tables(scores: Scores) -> str:
    """All tables of the page."""
    rows = scores.rows
    gas = [r for r in rows if r.ids and r.listed[:1] == r.ids[:1]]
    labels = [label for label in LABELS if any(r.labels[:1] == (label,) for r in gas)]
    far = [r for r in rows if r.wrong]
    poor = [r for r in rows if r.outcome != "right" or r.false_name]
    listing = [
        (r.case, _truth(r), r.said, r.outcome + (", false name" if r.false_name else ""))
        for r in poor
    ]
    parts = [
        (
            "## Naming an effect of the gas blocks, alone and beside an effect of no catalogue in "
            "the arm\n"
        ),
        "The three cases of a group have the same effect of the gas blocks, the same baseline and "
        "the same noise. Strengths are multiples of the noise, measured as the keys tell. Right: "
        "verdict `effects` and the name of the gas effect first; what is said of the rest is "
        "counted apart. Lost, gained: groups named right alone only, and beside the other only.\n",
        _naming(gas, labels),
        "\nRight name first, of so many; mean probability on the name.\n",
        _by(gas, "effect", lambda r: r.ids[0]),
        "\nThe same by the effect beside it.\n",
        _by([r for r in gas if r.mixed], "beside", lambda r: r.ids[1]),
        "\n## The unexplained rest\n",
        _rest(gas),
        "\n## Parameters far outside their tolerance\n",
        "Named: verdict `parameters` and exactly the right names. The error on held-out recordings "
        "is that of the worst channel after the diagnosis, in units of its noise (median over the "
        "cases). Viscous friction has no room downwards and is put upwards instead; dead volume "
        "goes down by less than 5 tolerances only.\n",
        _far(far) if far else "No such case.",
        "\n## False names where no effect is concealed\n",
        _false(rows),
        "\n## Every case that was not right\n",
        table(("case", "truth", "said", "outcome"), listing) if listing else "None.",
    ]
    return "\n".join(parts) + "\n"


def blocks_page(
    folder: Path,
    results: Path,
    out: Path,
    command: str,
    catalogue: Sequence[str] = LISTED,
    first: int | None = None,
) -> Path:
    """Score a trial of plan `blocks` and write its page ``blocks.md``.

    Parameters
    ----------
    folder : Path
        The trial: ``cases``, ``keys``, ``manifest.json``.
    results : Path
        From ``pamrs prove``.
    out : Path
        Folder for the page.
    command : str
        What makes the page, as the page says.
    catalogue : sequence of str
        As in :func:`trial.score.score`.
    first : int, optional
        Only the first so many cases, where a run was ended before the last: they stand in random
        order, so that these are a fair share.

    Returns
    -------
    Path
        The page.

    Raises
    ------
    ValueError
        The keys are not those that were published, or the results are of another trial.
    """
    digest, count = checked(folder)
    run = run_of(results, digest)
    scores = score(folder / "keys", results, catalogue, first)
    head = [
        "# Blocks judged apart, and parameters far outside their tolerance\n",
        *about(folder, digest, count, run, command),
    ]
    if first is not None and first < count:
        head.append(
            f"**Scored are the first {first} of the {count} cases**, which stand in random order: "
            "the run was ended there.\n"
        )
    write(out / "blocks.md", "\n".join([*head, tables(scores)]))
    return out / "blocks.md"
