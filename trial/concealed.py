"""Write concealed cases: nominal rig, recordings of a plant that differs from it, and the key
elsewhere.
"""

from __future__ import annotations

import hashlib
import json
import math
import os
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from .effects import KINDS, LISTED, Effects, Setting, draw
from .excitation import select
from .plant import Plant
from .recording import ANGLE_STEP, Noise, Record, prepare, run
from .rigfile import default_rig, draw_parameters, read_rig, to_parameters, value_of

_NO_EFFECT = ("none", "parameters")


@dataclass(frozen=True)
class Spec:
    """What a single case is made from.

    `kind` is "none", "parameters", an effect id, or ids joined by "+"; `strength` a factor on the
    sizes that the effects draw.
    """

    name: str
    kind: str
    seed: int
    recordings: tuple[tuple[str, str], ...]
    duration: float
    strength: float = 1.0


@dataclass(frozen=True)
class Case:
    """A case in memory: its key and its files by name, the list of recordings last."""

    name: str
    key: str
    files: dict[str, str]

    def digest(self) -> str:
        """SHA-256 of the key file."""
        return hashlib.sha256(self.key.encode()).hexdigest()


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


def case_toml(recordings: Sequence[tuple[str, str]]) -> str:
    """The list of recordings of a case."""
    blocks = ['schema = "pamrs.case/1"\nrig = "rig.toml"\n']
    blocks += [
        f'[[recording]]\nfile = "{name}.csv"\nrole = "{role}"\n' for name, role in recordings
    ]
    return "\n".join(blocks)


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


def generate(spec: Spec, rig: Path) -> Case:
    """Make one case in memory; the same arguments give the same bytes."""
    model, tolerance = read_rig(rig)
    rng = np.random.default_rng([spec.seed, 20140517])
    true, moved = draw_parameters(spec.kind, model, tolerance, rng, {})
    ids = [p for p in spec.kind.split("+") if p not in _NO_EFFECT]
    noise, par, nominal = _noise(rng), to_parameters(true), Plant(to_parameters(model))
    supply_tol = tolerance.get("supply.initial_pressure", 0.0)
    supply, prepared = [], []
    for index, (name, _) in enumerate(spec.recordings):
        own = np.random.default_rng([spec.seed, index, 77])
        supply.append(par.supply_pressure + float(own.uniform(-1.0, 1.0)) * supply_tol)
        prepared.append(prepare(nominal, name, spec.duration, own))
    start = float(np.median(supply))
    setting = Setting(len(supply), spec.duration, start, par.payload, par.coulomb)
    effects = Effects(*(draw(name, spec.strength, rng, setting) for name in ids))
    plant = Plant(par, effects)
    files = {"rig.toml": rig.read_text(encoding="utf-8")}
    for i, (name, _) in enumerate(spec.recordings):
        own = np.random.default_rng([spec.seed, i, 78])
        files[f"{name}.csv"] = _csv(run(plant, *prepared[i], supply[i], noise, own, i))
    files["case.toml"] = case_toml(spec.recordings)
    key: dict[str, Any] = {
        "schema": "pamrs.trial-key/1",
        "case": spec.name,
        "kind": spec.kind,
        "verdict": _verdict(spec.kind, ids),
        "effects": ids,
        "blocks": {e.id: e.block for e in effects},
        "effect_parameters": effects.to_dict(),
        "strength": spec.strength,
        "duration": spec.duration,
        "parameters": {name: value_of(true, name) for name in moved},
        "moved_tolerances": moved,
        "noise": asdict(noise),
        "recordings": {
            name: {"role": role, "initial_supply_pressure": supply[i]}
            for i, (name, role) in enumerate(spec.recordings)
        },
        "seed": spec.seed,
    }
    return Case(spec.name, json.dumps(key, indent=1) + "\n", files)


def make_case(
    out: Path,
    keys: Path,
    kind: str,
    *,
    seed: int,
    name: str = "case_001",
    strength: float = 1.0,
    recordings: int = 5,
    duration: float = 40.0,
    rig: Path | None = None,
    publish: Callable[[str], None] | None = None,
) -> str:
    """Write one concealed case and its answer key.

    Parameters
    ----------
    out, keys : Path
        Folder of the cases and folder of the keys (must differ, and the keys must not lie inside
        the cases).
    kind : str
        One of :data:`trial.effects.KINDS`, "random", or effects joined by "+" for a pair.
    seed : int
        Everything is determined by the seed, the kind and the other arguments.
    name : str
        Folder name of the case.
    strength : float
        Size of the effect; 1 is moderate.
    recordings : int
        1 to 5 recordings.
    duration : float
        Length of each recording [s].
    rig : Path, optional
        Nominal rig file.
    publish : callable, optional
        Called with the SHA-256 of the key before any file of the case is written.

    Returns
    -------
    str
        SHA-256 of the key file.

    Raises
    ------
    ValueError
        Unknown kind, bad duration or number of recordings, or keys inside the folder of the cases.
    """
    out, keys = Path(out), Path(keys)
    if keys.resolve().is_relative_to((out / name).resolve()):
        raise ValueError("the keys must not lie inside a case folder")
    if not (math.isfinite(duration) and duration >= 2.0):
        raise ValueError(f"duration must be at least 2 s, got {duration!r}")
    if not strength > 0.0:
        raise ValueError(f"strength must be positive, got {strength!r}")
    chosen = tuple(select(recordings))
    if kind == "random":
        kind = str(np.random.default_rng([seed, 5]).choice(KINDS))
    parts = kind.split("+")
    if any(p not in KINDS for p in parts) or (len(parts) > 1 and set(_NO_EFFECT) & set(parts)):
        raise ValueError(
            f"unknown kind {kind!r}; known: {', '.join(KINDS)}, random, and effects joined by '+'"
        )
    case = generate(Spec(name, kind, seed, chosen, duration, strength), rig or default_rig())
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
