"""Make the cases of a plan: files for the diagnosis, and the key with every size."""

from __future__ import annotations

import json
import math
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from .bench import Bench, put
from .concealed import Case, case_toml, stored_key
from .design import Spec
from .effects import Effect, Setting
from .errors import model_errors, pair_errors, stated_lines
from .families import BY_LABEL, UNLISTED, Form
from .labs import Hole, holes, noise_of, table
from .pair.bench import PairBench
from .pair.places import BOTH, SIDES, Placed
from .recording import Noise
from .rig_kinds import PAIR, RIGS, stated
from .rigfile import draw_parameters, split, value_of

SCHEMA = "pamrs.trial-key/2"
#: noises that a parameter far off is to leave
VISIBLE = 3.0
#: block of the rig in which an effect of a block of the plant shows, and the channel of that block
_SHOWS = {"supply": "supply", "valve": "chamber", "line": "chamber", "chamber": "chamber"}
_CHANNEL = {"supply": "supply_pressure", "chamber": "muscle_pressure", "arm": "joint_angle"}
_SENSORS = {
    "pressure_lag": "chamber",
    "clock_skew": "chamber",
    "model_error.muscle_pressure": "chamber",
}


#: an effect; of a pair with its place
Acting = Effect | Placed


def place_of(effect: Acting) -> str:
    """Where an effect of a pair acts; empty where that is no question."""
    return effect.at if isinstance(effect, Placed) else ""


def bench_of(spec: Spec, true: dict[str, Any], tolerance: dict[str, float], noise: Noise) -> Bench:
    """The recordings of a case on its rig; arguments as those of :class:`Bench`."""
    return (PairBench if spec.rig == PAIR else Bench)(spec, true, tolerance, noise)


def block_of(effect: Acting) -> str:
    """Block of the rig in which an effect shows: supply, chamber or arm."""
    return _SENSORS.get(effect.id) or _SHOWS.get(effect.block, "arm")


def _chosen(
    spec: Spec, bench: Bench, rng: np.random.Generator
) -> tuple[list[Acting], list[dict[str, Any]]]:
    """The effects of a case at their sizes, and what the key says of each."""
    setting = Setting(
        len(spec.recordings),
        spec.duration,
        float(np.median(bench.supply)),
        bench.par.payload or 10.0,
        bench.par.coulomb,
    )
    effects: list[Acting] = []
    told: list[dict[str, Any]] = []
    for i, label in enumerate(spec.forms):
        form = BY_LABEL[label]
        best: tuple[float, Acting] | None = None
        # an effect that does not come into play in these recordings is drawn again
        for _ in range(2):
            drawn = form.draw(rng, setting)
            effect = Placed(drawn, spec.places[i]) if spec.rig == PAIR else drawn
            try:
                factor, reached = bench.scale(effect, spec.strength)
            except ArithmeticError:
                continue
            if best is None or reached > best[0]:
                best = reached, effect.scaled(factor)
            if reached > 0.5 * spec.strength:
                break
        if best is None:
            raise ArithmeticError(f"{spec.name}: {label} cannot be run on {spec.rig}")
        effects.append(best[1])
        told.append(_entry(form, best[1], best[0], spec, bench))
    return effects, told


def _entry(form: Form, effect: Acting, reached: float, spec: Spec, bench: Bench) -> dict[str, Any]:
    """What the key says of one effect."""
    at = place_of(effect)
    return {
        "id": form.family,
        **({"at": at} if at else {}),
        "form": form.name,
        "mark": form.mark,
        "first_catalogue": form.first,
        "block": block_of(effect),
        "wanted": spec.strength,
        "reached": reached,
        "parameters": effect.to_dict(),
        "catalogue_parameters": _truths(form, effect, bench),
    }


def _truths(form: Form, effect: Acting, bench: Bench) -> dict[str, float]:
    """Parameters that the catalogue names the same way; at both sides those that are alike there,
    since what it says of one muscle depends on how many there are.
    """
    inner: Any = effect.effect if isinstance(effect, Placed) else effect
    if form.truths is None:
        return {}
    first, *others = (form.truths(inner, par) for par in bench.numbers_at(effect))
    return {k: v for k, v in first.items() if all(math.isclose(v, o[k]) for o in others)}


def _baseline(spec: Spec, noise: Noise) -> tuple[Bench, dict[str, float], dict[str, float]]:
    """The rig without effects, by how many tolerances each parameter is off, and which is far off:
    the first of those that the spec proposes of which a refit leaves enough to be seen, else the
    one that leaves most.
    """
    model, tolerance = stated(spec.rig)
    drawn = {k: v for k, v in tolerance.items() if not k.endswith("initial_pressure")}
    best: tuple[float, Bench, dict[str, float], dict[str, float]] | None = None
    for one in spec.wrong or (None,):
        wrong = dict([one]) if one else {}
        rng = np.random.default_rng([spec.seed, 20260704])
        true, moved = draw_parameters("none", model, drawn, rng, wrong)
        bench = bench_of(spec, true, tolerance, noise)
        left = max((max(_wrong_left(bench, n, model).values()) for n in wrong), default=0.0)
        if best is None or left > best[0]:
            best = left, bench, moved, wrong
        if left >= VISIBLE:
            break
    assert best is not None
    return best[1:]


def _wrong_left(bench: Bench, name: str, model: dict[str, Any]) -> dict[str, float]:
    """What a parameter that is far off leaves, all others refitted [noises by channel]."""
    section, key = split(name)
    plain = bench.against(bench.run(()), put(bench.true, {name: model[section][key]}))
    return bench.left(plain, (name,))


@dataclass(frozen=True)
class Concealed:
    """What a case conceals: the recordings of its plant, effects with what the key says of them,
    model errors, by how many tolerances values are off, and what effects were made smaller by.
    """

    bench: Bench
    effects: list[Acting]
    told: list[dict[str, Any]]
    errors: list[Any]
    moved: dict[str, float]
    wrong: dict[str, float]
    together: float


def concealed(spec: Spec) -> Concealed:
    """Draw what a case conceals; the same for the same spec."""
    kind = RIGS[spec.rig]
    noise = noise_of(spec.lab, kind, np.random.default_rng([spec.seed, 20260701]))
    bench, moved, wrong = _baseline(spec, noise)
    effects, told = _chosen(spec, bench, np.random.default_rng([spec.seed, 20260702]))
    gear = not {"tendon_compliance", "moment_arm_error"} & {e.id for e in effects}
    weight = bench.par.weight if "muscle" in kind.blocks else 0.0
    own = np.random.default_rng([spec.seed, 20260703])
    erring: Any = pair_errors if spec.rig == PAIR else model_errors
    errors: list[Any] = erring(kind, spec.percent, weight, own, gear)
    effects, errors, shrunk = _survives(bench, effects, errors)
    return Concealed(bench, effects, told, errors, moved, wrong, shrunk)


def make(spec: Spec) -> Case:
    """Make one case in memory; the same spec gives the same bytes."""
    model, kind = stated(spec.rig)[0], RIGS[spec.rig]
    drawn = concealed(spec)
    bench, effects, told, errors = drawn.bench, drawn.effects, drawn.told, drawn.errors
    wrong, true = drawn.wrong, drawn.bench.true
    records = bench.run([*effects, *errors])
    terms = _terms(bench, told, effects, errors, wrong, model)
    files, lost = _tables(spec, bench, records)
    key: dict[str, Any] = {
        "schema": SCHEMA,
        **({"plan": spec.plan} if spec.plan else {}),
        "case": spec.name,
        "spec": spec.to_dict(),
        "verdict": _verdict(spec, errors),
        "effects": told,
        "together": drawn.together,
        "model_error": {
            "percent": spec.percent,
            "stated": spec.stated,
            "sizes": {_named(e): {**e.to_dict(), "block": block_of(e)} for e in errors},
        },
        "wrong_parameters": {
            name: {
                "nominal": value_of(model, name),
                "value": value_of(true, name),
                "tolerances": z,
            }
            for name, z in wrong.items()
        },
        "terms": terms,
        "moved_tolerances": drawn.moved,
        "noise": asdict(bench.noise),
        "lost": lost,
    }
    files = {
        "rig.toml": kind.path.read_text(encoding="utf-8")
        + (stated_lines(kind, errors, spec.percent) if spec.stated else ""),
        **files,
        "case.toml": case_toml(spec.recordings),
    }
    return Case(spec.name, json.dumps(key, indent=1) + "\n", files)


def _named(error: Acting) -> str:
    """Name of a model error in the key: its block or channel, with the side of a pair."""
    return ".".join(filter(None, (error.id.split(".")[1], place_of(error))))


def _survives(
    bench: Bench, effects: list[Acting], errors: list[Any]
) -> tuple[list[Acting], list[Any], float]:
    """Effects and errors that can be run together: all effects smaller by the last number where
    they cannot.
    """
    factor = 1.0
    for _ in range(6):
        try:
            bench.run([*effects, *errors])
        except (ArithmeticError, ValueError, OverflowError):
            factor *= 0.6
            effects = [e.scaled(0.6) for e in effects]
        else:
            return effects, errors, factor
    raise ArithmeticError(f"{bench.spec.name} cannot be run")


def _terms(
    bench: Bench,
    told: list[dict[str, Any]],
    effects: list[Acting],
    errors: list[Any],
    wrong: dict[str, float],
    model: dict[str, Any],
) -> list[dict[str, Any]]:
    """What each thing that is wrong leaves alone, by channel [noises], and its share of all that is
    left in the channel of its block.
    """
    found: list[dict[str, Any]] = []

    def add(block: str, kind: str, name: str, left: dict[str, float], at: str = "") -> None:
        place = {"at": at} if at else {}
        found.append({"block": block, "kind": kind, "id": name, **place, "left": left})

    for entry, effect in zip(told, effects, strict=True):
        left = bench.left(bench.against(bench.run([effect]), bench.true))
        add(str(entry["block"]), "effect", str(entry["id"]), left, place_of(effect))
    for block in ("supply", "chamber", "arm"):
        if group := [e for e in errors if block_of(e) == block]:
            left = bench.left(bench.against(bench.run(group), bench.true))
            add(block, "model_error", f"model_error.{block}", left)
    for name in wrong:
        block = _SHOWS.get(name.split(".")[0], "arm")
        side = name.split(".")[1]
        at = side if side in SIDES else ""
        add(block, "parameter", name, _wrong_left(bench, name, model), at)
    for block in _CHANNEL:
        group_ = [t for t in found if t["block"] == block]
        for term in group_:
            term["share"] = _share(term, group_, bench.channels)
    return found


def _share(
    term: dict[str, Any], group: list[dict[str, Any]], channels: tuple[str, ...]
) -> float | None:
    """Share of a term of all that is left in the channel of its block; at both sides of a pair the
    mean of both.
    """
    own = [c for c in channels if c.split(".")[0] == _CHANNEL[term["block"]]]
    if len(own) > 1 and term.get("at", BOTH) in SIDES:
        own = [c for c in own if c.endswith(f".{term['at']}")]
    found = []
    for channel in own:
        whole = sum(t["left"].get(channel, 0.0) ** 2 for t in group)
        if whole > 0.0:
            found.append(term["left"].get(channel, 0.0) ** 2 / whole)
    return sum(found) / len(found) if found else None


def _verdict(spec: Spec, errors: list[Any]) -> str:
    """The right verdict on the whole case."""
    marks = [BY_LABEL[f].mark for f in spec.forms]
    if any(m != UNLISTED for m in marks):
        return "effects"
    if marks:
        return "unlisted"
    return "parameters" if spec.wrong else "unlisted" if errors and not spec.stated else "none"


def _tables(
    spec: Spec, bench: Bench, records: dict[int, Any]
) -> tuple[dict[str, str], dict[str, Any]]:
    """CSV files by name, and the samples that each lost."""
    files: dict[str, str] = {}
    lost: dict[str, Any] = {}
    channels = [bench.channels[i] for i in bench.shown]
    for i, (name, _) in enumerate(spec.recordings):
        rng = np.random.default_rng([spec.seed, i, 79])
        gone: list[Hole] = holes(spec.lab, len(records[i].time), channels, rng)
        rest = float(bench.true.get("muscle", {}).get("rest_length", 0.0))
        files[f"{name}.csv"], _ = table(records[i], bench.rig, spec.lab, gone, rest)
        if gone:
            lost[name] = [asdict(h) for h in gone]
    return files, lost


def complete(folder: Path, spec: Spec, digests: dict[str, str]) -> bool:
    """Whether a case, its key and its digest are there and belong to a spec."""
    told = stored_key(folder, spec.name, [name for name, _ in spec.recordings], digests)
    return told is not None and told.get("spec") == json.loads(json.dumps(spec.to_dict()))
