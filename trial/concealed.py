"""Write concealed cases: nominal rig, recordings of a plant that differs from it, and the key
elsewhere.
"""

from __future__ import annotations

import hashlib
import json
import math
import os
import tempfile
from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from .effects import KINDS, LISTED, Effect, Effects, Setting, draw
from .excitation import RECORDINGS, select
from .plant import Plant
from .recording import ANGLE_STEP, Array, Noise, Record, follow, prepare, reach, run
from .remainder import Remainder
from .rigfile import default_rig, draw_parameters, read_rig, to_parameters
from .strength import FIRST, LABELS, MEASURES, STRENGTHS, aim

#: kind of a case whose rig file holds a parameter that is far from the true one
WRONG = "wrong_parameter"
_NO_EFFECT = ("none", "parameters", WRONG)


@dataclass(frozen=True)
class Spec:
    """What a case is made from.

    `kind` is "none", "parameters", "wrong_parameter", an effect id, or ids joined by "+". With
    `wanted` (one label of :data:`trial.strength.LABELS` per effect) the effects are scaled to that
    reach, else by `strength`. `measure` is what the multiple of the noise is of: "reach", or
    "left", what a refit of the baseline leaves of it. `wrong` lists the parameters that are far
    off, dotted name and tolerances with their sign, of the kind "wrong_parameter".
    """

    name: str
    kind: str
    seed: int
    recordings: tuple[tuple[str, str], ...]
    duration: float
    wanted: tuple[str, ...] = ()
    strength: float = 1.0
    measure: str = "reach"
    wrong: tuple[tuple[str, float], ...] = ()


@dataclass(frozen=True)
class Case:
    """A case in memory: its key and its files by name, the list of recordings last."""

    name: str
    key: str
    files: dict[str, str]

    def digest(self) -> str:
        """SHA-256 of the key file."""
        return hashlib.sha256(self.key.encode()).hexdigest()


@lru_cache(maxsize=4)
def _nominal(rig: Path) -> Plant:
    return Plant(to_parameters(read_rig(rig)[0]))


def write(path: Path, text: str) -> None:
    """Write atomically: a temporary file in the same folder, then a rename."""
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    try:
        with os.fdopen(handle, "w", encoding="utf-8", newline="\n") as stream:
            stream.write(text)
        os.chmod(name, 0o644)
        os.replace(name, path)
    except BaseException:
        Path(name).unlink(missing_ok=True)
        raise


def _csv(record: Record) -> str:
    lines = [
        "time [s],valve_command [V],supply_pressure [bar],muscle_pressure [bar],joint_angle [deg]"
    ]
    lines += [
        f"{t:.3f},{u:.4f},{ps / 1e5:.5f},{p / 1e5:.5f},{math.degrees(a):.3f}"
        for t, u, (p, ps, a) in zip(
            record.time.tolist(), record.command.tolist(), record.logged.tolist(), strict=True
        )
    ]
    return "\n".join(lines) + "\n"


def _case_toml(recordings: Sequence[tuple[str, str]]) -> str:
    blocks = ['schema = "pamrs.case/1"\nrig = "rig.toml"\n']
    blocks += [
        f'[[recording]]\nfile = "{name}.csv"\nrole = "{role}"\n' for name, role in recordings
    ]
    return "\n".join(blocks)


#: a recording and how far the effects move its channels, shape (n, 3)
Measured = tuple[Record, Array]


class _Bench:
    """The recordings of one case, to be run with any effects."""

    def __init__(
        self,
        spec: Spec,
        true: dict[str, Any],
        tolerance: dict[str, float],
        nominal: Plant,
        noise: Noise,
        believed: dict[str, Any] | None = None,
    ) -> None:
        self.spec, self.true, self.tolerance, self.noise = spec, true, tolerance, noise
        self.par = par = to_parameters(true)
        supply_tol = tolerance.get("supply.initial_pressure", 0.0)
        # the plant without what is concealed: no effects, and no parameter far off
        self.bare = Plant(to_parameters(believed or true))
        self.moves = believed is not None
        self._remainder: Remainder | None = None
        roles = [role for _, role in spec.recordings]
        self.fit = [i for i, role in enumerate(roles) if role == "fit"] or list(range(len(roles)))
        self.prepared = []
        self.supply: list[float] = []
        for index, (name, _) in enumerate(spec.recordings):
            own = np.random.default_rng([spec.seed, index, 77])
            self.supply.append(par.supply_pressure + float(own.uniform(-1.0, 1.0)) * supply_tol)
            self.prepared.append(prepare(nominal, name, spec.duration, own))

    def measure(
        self, effects: Effects, known: dict[int, Measured] | None = None, fit_only: bool = False
    ) -> dict[int, Measured]:
        """Record and reach of the recordings by number; those in `known` are kept."""
        plant = Plant(self.par, effects)
        found = dict(known or {})
        for i, (made, supply) in enumerate(zip(self.prepared, self.supply, strict=True)):
            if i in found or (fit_only and i not in self.fit):
                continue
            record = run(
                plant, *made, supply, self.noise, np.random.default_rng([self.spec.seed, i, 78]), i
            )
            found[i] = (
                record,
                record.clean - follow(self.bare, record, i)
                if effects.items or self.moves
                else np.zeros((1, 3)),
            )
        return found

    def most_moved(self, measured: dict[int, Measured]) -> tuple[str, float]:
        """Channel that moves most in a recording to fit, and its reach."""
        tops = [
            max(reach(measured[i][1], self.noise).items(), key=lambda item: item[1])
            for i in self.fit
        ]
        return max(tops, key=lambda item: item[1])

    def left(self, measured: dict[int, Measured]) -> float:
        """Reach that is left of the recordings to fit when the baseline is refitted within its
        tolerances.

        The sensitivities are those of the recordings of the first call.
        """
        if self._remainder is None:
            self._remainder = Remainder(
                self.true, self.tolerance, [(measured[i][0], i) for i in self.fit], self.noise
            )
        found = self._remainder.of([measured[i][1] for i in self.fit])
        return max(max(reach(moved, self.noise).values()) for moved in found)

    def scale(self, effect: Effect, target: float) -> tuple[float, float, dict[int, Measured]]:
        """Factor and reach of one effect alone, and its recordings to fit."""
        left = self.spec.measure == "left"

        def simulate(factor: float) -> tuple[float, dict[int, Measured]]:
            measured = self.measure(Effects(effect.scaled(factor)), fit_only=True)
            return self.left(measured) if left else self.most_moved(measured)[1], measured

        start = FIRST.get(effect.id, 1.0) * target / STRENGTHS["medium"]
        return aim(simulate, target, effect.most(), 2.0 * start if left else start)


def _values(model: dict[str, Any], names: Iterable[str]) -> dict[str, float]:
    """Values of a nested model by dotted name."""
    return {name: model[name.split(".")[0]][name.split(".")[1]] for name in names}


def _put(model: dict[str, Any], values: dict[str, float]) -> dict[str, Any]:
    """Copy of a nested model with other values."""
    changed = {k: dict(v) for k, v in model.items()}
    for name, value in values.items():
        section, key = name.split(".")
        changed[section][key] = value
    return changed


def _verdict(kind: str, ids: Sequence[str]) -> str:
    """The right verdict; an effect that can be named counts, whatever stands beside it."""
    if not ids:
        return "none" if kind == "none" else "parameters"
    return "effects" if any(i in LISTED for i in ids) else "unlisted"


def _noise(rng: np.random.Generator) -> Noise:
    """Noise and steps of the transducers of one case."""
    return Noise(
        pressure=float(rng.uniform(300.0, 600.0)),
        pressure_step=float(rng.choice([42.0, 84.0])),
        angle=math.radians(float(rng.uniform(0.01, 0.02))),
        angle_step=ANGLE_STEP,
    )


@dataclass(frozen=True)
class _Chosen:
    """The effects of a case, the reach of each alone where it was aimed at, and the recordings of
    the last one alone.
    """

    effects: Effects
    alone: dict[str, float]
    known: dict[int, Measured]


def _choose(spec: Spec, ids: Sequence[str], bench: _Bench, rng: np.random.Generator) -> _Chosen:
    """Draw the effects and scale them to what is wanted."""
    start = float(np.median(bench.supply))
    setting = Setting(
        len(spec.recordings), spec.duration, start, bench.par.payload, bench.par.coulomb
    )
    alone: dict[str, float] = {}
    known: dict[int, Measured] = {}
    chosen = []
    for name, label in zip(ids, spec.wanted or [""] * len(ids), strict=True):
        effect = draw(name, spec.strength, rng, setting)
        if label:
            # an effect that does not come into play in these recordings is drawn again
            for attempt in range(4):
                if attempt:
                    effect = draw(name, spec.strength, rng, setting)
                factor, alone[name], known = bench.scale(effect, LABELS[label])
                if alone[name] > 0.5 * LABELS[label]:
                    break
            effect = effect.scaled(factor)
        chosen.append(effect)
    return _Chosen(Effects(*chosen), alone, known)


def _reached(bench: _Bench, measured: dict[int, Measured], concealed: bool) -> dict[str, Any]:
    """What the key says of how far the channels move; nothing moves where nothing is concealed."""
    channel, size, left = None, 0.0, 0.0
    if concealed:
        channel, size = bench.most_moved(measured)
        left = bench.left(measured)
    return {"reach": size, "reach_channel": channel, "reach_left": left}


def generate(spec: Spec, rig: Path) -> Case:
    """Make one case in memory; the same arguments give the same bytes."""
    model, tolerance = read_rig(rig)
    rng = np.random.default_rng([spec.seed, 20140517])
    wrong = dict(spec.wrong)
    true, moved = draw_parameters(spec.kind, model, tolerance, rng, wrong)
    ids = [p for p in spec.kind.split("+") if p not in _NO_EFFECT]
    noise = _noise(rng)
    believed = _put(true, _values(model, wrong)) if wrong else None
    bench = _Bench(spec, true, tolerance, _nominal(rig), noise, believed)
    chosen = _choose(spec, ids, bench, rng)
    measured = bench.measure(chosen.effects, chosen.known if len(ids) == 1 else None)
    reached = _reached(bench, measured, bool(ids or wrong))
    key: dict[str, Any] = {
        "schema": "pamrs.trial-key/1",
        "case": spec.name,
        "kind": spec.kind,
        "verdict": _verdict(spec.kind, ids),
        "effects": ids,
        "blocks": {e.id: e.block for e in chosen.effects},
        "effect_parameters": chosen.effects.to_dict(),
        "strength": spec.strength,
        "wanted": dict(zip(ids, spec.wanted, strict=False)),
        "measure": spec.measure,
        "duration": spec.duration,
        "reach": reached["reach"],
        "reach_channel": reached["reach_channel"],
        "reach_alone": chosen.alone,
        "reach_left": reached["reach_left"],
        "parameters": _values(true, moved),
        "moved_tolerances": moved,
        "noise": asdict(noise),
        "recordings": {
            name: {
                "role": role,
                "initial_supply_pressure": bench.supply[i],
                "reach": reach(measured[i][1], noise),
            }
            for i, (name, role) in enumerate(spec.recordings)
        },
        "seed": spec.seed,
    }
    if wrong:
        key["wrong_parameters"] = _wrong_entries(model, true, wrong)
    files = {f"{name}.csv": _csv(measured[i][0]) for i, (name, _) in enumerate(spec.recordings)}
    files = {
        "rig.toml": rig.read_text(encoding="utf-8"),
        **files,
        "case.toml": _case_toml(spec.recordings),
    }
    return Case(spec.name, json.dumps(key, indent=1) + "\n", files)


def _wrong_entries(
    model: dict[str, Any], true: dict[str, Any], wrong: dict[str, float]
) -> dict[str, dict[str, float]]:
    """The parameters that are far off: what the rig file says, what is true, and by how many
    tolerances.
    """
    nominal, value = _values(model, wrong), _values(true, wrong)
    return {
        k: {"nominal": nominal[k], "value": value[k], "tolerances": z} for k, z in wrong.items()
    }


def _check_wrong(wrong: Sequence[tuple[str, float]], rig: Path) -> None:
    """Refuse parameters without a tolerance, and values that are not positive."""
    model, tolerance = read_rig(rig)
    allowed = [
        n for n in tolerance if not n.startswith("sensors.") and n != "supply.initial_pressure"
    ]
    for name, z in wrong:
        if name not in allowed:
            raise ValueError(f"unknown parameter {name!r}; known: {', '.join(allowed)}")
        least = -_values(model, [name])[name] / tolerance[name]
        if not (math.isfinite(z) and z > least):
            raise ValueError(
                f"{name}: {z:g} tolerances off is not allowed, more than {least:.3g} are (the "
                "value stays positive)"
            )


def make_case(
    out: Path,
    keys: Path,
    kind: str,
    *,
    seed: int,
    name: str = "case_001",
    strength: float = 1.0,
    wanted: str | None = None,
    measure: str = "reach",
    recordings: int = 5,
    duration: float = 40.0,
    rig: Path | None = None,
    publish: Callable[[str], None] | None = None,
    wrong: Sequence[tuple[str, float]] = (),
) -> str:
    """Write one concealed case and its answer key.

    Parameters
    ----------
    out, keys : Path
        Folder of the cases and folder of the keys (must differ, and the keys must not lie inside
        the cases).
    kind : str
        One of :data:`trial.effects.KINDS`, "wrong_parameter", "random", or effects joined by "+"
        for a pair.
    seed : int
        Everything is determined by the seed, the kind and the other arguments.
    name : str
        Folder name of the case.
    strength : float
        Size of the effect; 1 is moderate.
    wanted : str, optional
        "weak", "medium", "strong" or "heavy": scale every effect until it reaches that multiple of
        the noise.
    measure : str
        "reach", or "left": the multiple is of what a refit of the baseline leaves.
    recordings : int
        1 to 5 recordings.
    duration : float
        Length of each recording [s].
    rig : Path, optional
        Nominal rig file.
    publish : callable, optional
        Called with the SHA-256 of the key before any file of the case is written.
    wrong : sequence of tuple
        Of the kind "wrong_parameter": dotted names and by how many tolerances they are off.

    Returns
    -------
    str
        SHA-256 of the key file.

    Raises
    ------
    ValueError
        Unknown kind, bad duration or number of recordings, a wrong parameter that cannot be, or
        keys inside the folder of the cases.
    """
    out, keys = Path(out), Path(keys)
    if keys.resolve().is_relative_to((out / name).resolve()):
        raise ValueError("the keys must not lie inside a case folder")
    if not (math.isfinite(duration) and duration >= 2.0):
        raise ValueError(f"duration must be at least 2 s, got {duration!r}")
    if not strength > 0.0:
        raise ValueError(f"strength must be positive, got {strength!r}")
    if wanted is not None and wanted not in LABELS:
        raise ValueError(f"strength must be one of {', '.join(LABELS)}, got {wanted!r}")
    if measure not in MEASURES:
        raise ValueError(f"measure must be one of {', '.join(MEASURES)}, got {measure!r}")
    chosen = tuple(select(recordings))
    if kind == "random":
        kind = str(np.random.default_rng([seed, 5]).choice(KINDS))
    parts = kind.split("+")
    if any(p not in (*KINDS, WRONG) for p in parts) or (
        len(parts) > 1 and set(_NO_EFFECT) & set(parts)
    ):
        raise ValueError(
            f"unknown kind {kind!r}; known: {', '.join((*KINDS, WRONG))}, random, and effects "
            "joined by '+'"
        )
    if (kind == WRONG) != bool(wrong):
        raise ValueError(f"wrong parameters and the kind {WRONG!r} go together")
    rig = (rig or default_rig()).resolve()
    _check_wrong(wrong, rig)
    labels = (wanted,) * len(parts) if wanted and kind not in _NO_EFFECT else ()
    spec = Spec(name, kind, seed, chosen, duration, labels, strength, measure, tuple(wrong))
    case = generate(spec, rig)
    write(keys / f"{name}.json", case.key)
    if publish is not None:
        publish(case.digest())
    store(case, out)
    return case.digest()


def stored_key(
    folder: Path, name: str, recordings: Sequence[str], digests: dict[str, str]
) -> dict[str, Any] | None:
    """The key of a case whose files are all there and whose digest is the published one."""
    key = folder / "keys" / f"{name}.json"
    files = ("case.toml", "rig.toml", *(f"{recording}.csv" for recording in recordings))
    there = all((folder / "cases" / name / file).is_file() for file in files)
    if name not in digests or not key.is_file() or not there:
        return None
    content = key.read_bytes()
    if hashlib.sha256(content).hexdigest() != digests[name]:
        return None
    told: dict[str, Any] = json.loads(content)
    return told


def store(case: Case, out: Path) -> None:
    """Write the files of a case below `out`; its list of recordings comes last and says that it is
    complete.
    """
    for file, content in case.files.items():
        write(out / case.name / file, content)


__all__ = [
    "RECORDINGS",
    "WRONG",
    "Case",
    "Spec",
    "generate",
    "make_case",
    "store",
    "stored_key",
    "write",
]
