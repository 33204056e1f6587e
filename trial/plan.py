"""Plans of many cases, and writing them so that an interrupted run can go on."""

from __future__ import annotations

import json
import multiprocessing
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol, TypeVar

import numpy as np

from .concealed import WRONG, Case, Spec, generate, store, stored_key, write
from .effects import LISTED, TYPES, UNLISTED
from .effects.base import log_uniform
from .rigfile import default_rig, read_rig
from .strength import STRENGTHS

MANIFEST = "manifest.json"
SCHEMA = "pamrs.trial-manifest/1"
PLANS = ("full", "small", "blocks")
#: nobody can tell these apart at 200 Hz, so no pair is made of them
_FAST_LAGS = {"input_path_lag", "pressure_lag", "clock_skew"}
_SMALL: tuple[tuple[str, tuple[str, ...]], ...] = (
    ("none", ()),
    ("parameters", ()),
    ("supply_leak", ("medium",)),
    ("valve_dead_zone", ("strong",)),
    ("leak_muscle", ("strong",)),
    ("heat_transfer", ("medium",)),
    ("muscle_hysteresis", ("strong",)),
    ("muscle_creep", ("weak",)),
    ("payload_swing", ("strong",)),
    ("pressure_lag", ("strong",)),
    ("leak_muscle+muscle_hysteresis", ("strong", "strong")),
    ("pressure_zero_drift", ("strong",)),
)
#: plan `blocks`: effects of the gas blocks, and effects of no catalogue that act in the arm
GAS = (
    "supply_leak", "compressor_cut_in", "valve_dead_zone", "valve_hysteresis",
    "valve_centre_leakage", "valve_area", "input_path_lag",
    "tube_flow_restriction", "leak_muscle", "heat_transfer",
)  # fmt: skip
ARM = (
    "tendon_compliance",
    "muscle_buckling",
    "encoder_gear_lash",
    "hose_torque",
    "moment_arm_error",
)
#: plan `blocks`: parameters that are put far off, by how many tolerances, and the least share of
#: the nominal value
PARAMETERS = (
    "supply.volume", "valve.discharge_area_max", "chamber.dead_volume", "muscle.modulus_scale",
    "arm.inertia",
    "arm.first_moment", "arm.payload", "arm.viscous",
)  # fmt: skip
SIZES = ((4.0, 6.0), (7.0, 10.0), (11.0, 15.0))
LEAST_SHARE = 0.3


@dataclass(frozen=True)
class Planned:
    """One case of a plan; cases of the same `group` (not 0) share their seed and recordings."""

    kind: str
    labels: tuple[str, ...] = ()
    wrong: tuple[tuple[str, float], ...] = ()
    group: int = 0


def _far(
    name: str, way: float, size: tuple[float, float], rig: Path, rng: np.random.Generator
) -> float:
    """Tolerances, with their sign, by which a parameter is off; upwards where no four of them fit
    downwards.
    """
    model, tolerance = read_rig(rig)
    section, key = name.split(".")
    most = (
        (1.0 - LEAST_SHARE) * model[section][key] / tolerance[name] if way < 0.0 else SIZES[-1][1]
    )
    if most < SIZES[0][0]:
        way, most = 1.0, SIZES[-1][1]
    low, high = size if size[0] < most else SIZES[0]
    return way * log_uniform(rng, low, min(high, most))


def blocks(rng: np.random.Generator, rig: Path | None = None) -> list[Planned]:
    """Cases of plan `blocks`, in no particular order.

    Every effect of the gas blocks at medium and strong, alone and beside an effect of no catalogue
    in the arm at strong and at heavy: 60 cases in groups of three, which share the seed and so the
    baseline, the noise and the first effect. Eight parameters far off, upwards and downwards, of
    three sizes: 48. Six nulls and six with parameters only.
    """
    rig = rig or default_rig()
    missing = [name for name in PARAMETERS if name not in read_rig(rig)[1]]
    if missing:
        raise ValueError(
            f"{rig}: plan 'blocks' needs a tolerance of {', '.join(PARAMETERS)}; missing: "
            f"{', '.join(missing)}"
        )
    found: list[Planned] = []
    turn = [str(v) for v in rng.permutation(ARM)]
    for i, (name, label) in enumerate((n, s) for n in GAS for s in ("medium", "strong")):
        found.append(Planned(name, (label,), group=i + 1))
        found.extend(
            Planned(f"{name}+{turn[i % len(turn)]}", (label, much), group=i + 1)
            for much in ("strong", "heavy")
        )
    for name in PARAMETERS:
        found.extend(
            Planned(WRONG, wrong=((name, _far(name, way, size, rig, rng)),))
            for way in (1.0, -1.0)
            for size in SIZES
        )
    return [*found, *(Planned(kind) for kind in ("none", "parameters") for _ in range(6))]


def _pair(rng: np.random.Generator) -> tuple[str, str]:
    """Two effects of different blocks."""
    while True:
        one, two = (str(v) for v in rng.choice(LISTED, 2, replace=False))
        if TYPES[one].block != TYPES[two].block and not {one, two} <= _FAST_LAGS:
            return one, two


def kinds(plan: str, rng: np.random.Generator) -> list[tuple[str, tuple[str, ...]]]:
    """Kinds and wanted strengths of plan `full` or `small`, in no particular order.

    `full`: 30 nulls, 30 with parameters only, every listed effect three times at each strength, 30
    pairs, every unlisted effect at medium and twice at strong. `small`: twelve cases.

    Raises
    ------
    ValueError
        Unknown plan.
    """
    if plan == "small":
        return list(_SMALL)
    if plan != "full":
        raise ValueError(f"unknown plan {plan!r}; known: {', '.join(PLANS)}")
    found: list[tuple[str, tuple[str, ...]]] = []
    for kind in ("none", "parameters"):
        found.extend([(kind, ())] * 30)
    found.extend((name, (label,)) for name in LISTED for label in STRENGTHS for _ in range(3))
    for _ in range(30):
        labels = tuple(str(v) for v in rng.choice(["medium", "strong"], 2))
        found.append(("+".join(_pair(rng)), labels))
    found.extend((name, (label,)) for name in UNLISTED for label in ("medium", "strong", "strong"))
    return found


def _recordings(rng: np.random.Generator) -> tuple[tuple[str, str], ...]:
    """Three or four recordings to fit, one of them in open loop, and one or two held out of another
    excitation.
    """
    fit = ["multisine", "sealed_holds", "open_cycles"]
    if rng.random() < 0.3:
        fit.append("lift_hold")
    held = ["angle_steps", "slow_triangle"]
    if len(fit) == 4 or rng.random() < 0.7:
        held = [str(rng.choice(held))]
    return tuple([(name, "fit") for name in fit] + [(name, "held_out") for name in held])


def specs(
    plan: str,
    seed: int,
    cases: int | None = None,
    duration: float | None = None,
    measure: str = "reach",
    rig: Path | None = None,
) -> list[Spec]:
    """Cases of a plan, shuffled so that their numbers say nothing; the first `cases` of them.

    Parameters
    ----------
    plan : str
        One of :data:`PLANS`.
    seed : int
        Settles everything. Each case (or group of cases) has its own seed, so that it comes out the
        same whatever is made with it.
    cases : int, optional
        How many; above the size of the plan it is repeated with other seeds.
    duration : float, optional
        Length of the recordings [s]; default 30 to 40, or 12 (small).
    measure : str
        What the strengths are multiples of, see :class:`trial.concealed.Spec`.
    rig : Path, optional
        Nominal rig file.
    """
    found: list[Spec] = []
    turn = 0
    while not found or (cases is not None and len(found) < cases):
        rng = np.random.default_rng([seed, turn, 4711])
        wanted = blocks(rng, rig) if plan == "blocks" else [Planned(*k) for k in kinds(plan, rng)]
        for i in rng.permutation(len(wanted)).tolist():
            one = wanted[i]
            number = len(found) + 1
            own = np.random.default_rng(
                [seed, turn, one.group, 816] if one.group else [seed, number, 815]
            )
            chosen = _recordings(own)
            length = 12.0 if plan == "small" else float(own.integers(30, 41))
            length = length if duration is None else duration
            seed_of_case = int(own.integers(2**31))
            name = f"case_{number:04d}"
            found.append(
                Spec(
                    name,
                    one.kind,
                    seed_of_case,
                    chosen,
                    length,
                    one.labels,
                    measure=measure,
                    wrong=one.wrong,
                )
            )
        turn += 1
    return found[:cases]


def _complete(folder: Path, spec: Spec, digests: dict[str, str]) -> bool:
    """Whether a case, its key and its digest are there and belong together."""
    told = stored_key(folder, spec.name, [name for name, _ in spec.recordings], digests)
    if told is None:
        return False
    same = all(
        told.get(name) == getattr(spec, name)
        for name in ("kind", "seed", "duration", "measure", "strength")
    )
    wrong = {name: entry["tolerances"] for name, entry in told.get("wrong_parameters", {}).items()}
    roles = {name: entry["role"] for name, entry in told.get("recordings", {}).items()}
    wanted = tuple(told.get("wanted", {}).values())
    return (
        same
        and wanted == spec.wanted
        and wrong == dict(spec.wrong)
        and roles == dict(spec.recordings)
    )


class Named(Protocol):
    """What a case is made from, of any plan."""

    @property
    def name(self) -> str:
        """Name of the case."""


S = TypeVar("S", bound=Named)


def _work(task: tuple[Callable[[Any, Path], Case], Any, Path]) -> Case:
    make, spec, rig = task
    return make(spec, rig)


def write_plan(
    folder: Path,
    wanted: Sequence[S],
    *,
    jobs: int = 1,
    rig: Path | None = None,
    progress: Callable[[str, int, int], None] | None = None,
    make: Callable[[S, Path], Case] | None = None,
    complete: Callable[[Path, S, dict[str, str]], bool] | None = None,
) -> Path:
    """Write the cases of a plan below ``folder/cases``, their keys below ``folder/keys``, and the
    manifest.

    The digest of a key is in the manifest before any file of its case exists. A case that is there
    complete is not made again.

    Parameters
    ----------
    folder : Path
        Where to.
    wanted : sequence of Spec
        From :func:`specs`.
    jobs : int
        Processes.
    rig : Path, optional
        Nominal rig file.
    progress : callable, optional
        Called with the name of each case made, the number done and the number of all.
    make, complete : callable, optional
        Make a case, and tell whether it is there, of another plan than those of :func:`specs`.

    Returns
    -------
    Path
        The manifest.

    Raises
    ------
    ValueError
        The folder holds another manifest.
    """
    folder = Path(folder)
    manifest = folder / MANIFEST
    digests: dict[str, str] = {}
    if manifest.is_file():
        told = json.loads(manifest.read_text(encoding="utf-8"))
        if told.get("schema") != SCHEMA:
            raise ValueError(f"{manifest}: schema must be {SCHEMA!r}")
        digests = told["keys"]
    there: Any = complete or _complete
    missing = [s for s in wanted if not there(folder, s, digests)]
    rig = (rig or default_rig()).resolve()
    done = len(wanted) - len(missing)

    def keep(case: Case) -> None:
        nonlocal done
        digests[case.name] = case.digest()
        text = json.dumps({"schema": SCHEMA, "keys": dict(sorted(digests.items()))}, indent=1)
        write(manifest, text + "\n")
        write(folder / "keys" / f"{case.name}.json", case.key)
        store(case, folder / "cases")
        done += 1
        if progress is not None:
            progress(case.name, done, len(wanted))

    tasks: list[tuple[Any, Any, Path]] = [(make or generate, s, rig) for s in missing]
    if jobs <= 1 or len(tasks) < 2:
        for task in tasks:
            keep(_work(task))
    else:
        with multiprocessing.get_context("spawn").Pool(min(jobs, len(tasks))) as pool:
            for case in pool.imap_unordered(_work, tasks):
                keep(case)
    if not missing and not manifest.is_file():
        raise ValueError("the plan has no case")
    return manifest
