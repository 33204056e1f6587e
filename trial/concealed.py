"""Write concealed cases: nominal rig, recordings of a plant that differs from it, and the key elsewhere."""

from __future__ import annotations

import hashlib
import json
import math
import os
import tempfile
import tomllib
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .effects import KINDS, LISTED, Effects, draw
from .excitation import Controller, build, select
from .plant import Parameters, Plant, State

Array = NDArray[np.floating]
ROOT = Path(__file__).resolve().parents[1]
SAMPLE_TIME = 0.005
ANGLE_STEP = math.radians(180.0 / 16384.0)
_UNIT = {"bar": 1.0e5, "deg": math.pi / 180.0}


def default_rig() -> Path:
    """The nominal rig file: the copy in the package, else the shared one."""
    for path in (
        ROOT / "python" / "pamrs" / "rigs" / "shoulder.toml",
        ROOT / ".." / "shared" / "rigs" / "shoulder.toml",
    ):
        if path.is_file():
            return path
    raise FileNotFoundError("no shoulder.toml found; give the nominal rig with --rig")


def _si(entry: Any) -> Any:
    """Value in SI of a TOML parameter table (or of a bare number)."""
    if not isinstance(entry, dict):
        return entry
    factor = _UNIT.get(entry.get("unit", ""), 1.0)
    value = entry["value"]
    return [factor * v for v in value] if isinstance(value, list) else factor * value


def read_rig(path: Path) -> tuple[dict[str, Any], dict[str, float]]:
    """Nominal model and tolerances of a rig file.

    Returns
    -------
    model : dict
        Nested sections with SI values.
    tolerance : dict
        Standard deviation in SI by dotted name, for parameters that have one.
    """
    with path.open("rb") as stream:
        raw = tomllib.load(stream)
    model: dict[str, Any] = {}
    tolerance: dict[str, float] = {}
    for section, table in raw.items():
        if not isinstance(table, dict):
            continue
        model[section] = {}
        for key, entry in table.items():
            if isinstance(entry, dict) and "value" not in entry:
                model[section][key] = entry
                continue
            model[section][key] = _si(entry)
            if isinstance(entry, dict) and "tol" in entry:
                tolerance[f"{section}.{key}"] = _UNIT.get(entry.get("unit", ""), 1.0) * float(entry["tol"])
    return model, tolerance


def to_parameters(model: dict[str, Any]) -> Parameters:
    """Plant parameters of a nested SI model as returned by :func:`read_rig`."""
    gas, valve, arm, chamber = model["gas"], model["valve"], model["arm"], model["chamber"]
    muscle = {k: v for k, v in model["muscle"].items() if k not in ("model", "count", "modulus_scale", "end_ratio")}
    muscle.update(model["muscle"]["end_ratio"])
    return Parameters(
        ambient=gas["ambient_pressure"],
        temperature=gas["temperature"],
        gas_constant=gas["gas_constant"],
        kappa=gas["heat_capacity_ratio"],
        supply_volume=model["supply"]["volume"],
        supply_pressure=model["supply"]["initial_pressure"],
        area_max=valve["discharge_area_max"],
        null_voltage=valve["null_voltage"],
        half_range=valve["half_range"],
        opening=tuple(valve["area_fraction"]["opening"]),
        fraction=tuple(valve["area_fraction"]["fraction"]),
        dead_volume=chamber["dead_volume"],
        alpha_in=chamber["alpha_in"],
        alpha_out=chamber["alpha_out"],
        alpha=chamber["alpha"],
        muscle=muscle,
        count=int(model["muscle"]["count"]),
        modulus_scale=model["muscle"]["modulus_scale"],
        joint={k: v for k, v in model["joint"].items() if k != "kind"},
        inertia=arm["inertia"],
        first_moment=arm["first_moment"],
        length=arm["length"],
        payload=arm["payload"],
        viscous=arm["viscous"],
        coulomb=arm["coulomb"],
        coulomb_speed=arm["coulomb_speed"],
        gravity=arm["gravity"],
        pressure_zero=model["sensors"]["pressure_zero"],
        angle_zero=model["sensors"]["angle_zero"],
    )


@lru_cache(maxsize=4)
def _nominal(rig: Path) -> Plant:
    return Plant(to_parameters(read_rig(rig)[0]))


@dataclass(frozen=True)
class Noise:
    """Standard deviation and resolution of the transducers: pressures in Pa, angle in rad."""

    pressure: float
    pressure_step: float
    angle: float
    angle_step: float


@dataclass(frozen=True)
class Record:
    """One recording: columns (n,) in V, gauge Pa and rad, and the true states at the samples."""

    time: Array
    command: Array
    supply: Array
    pressure: Array
    angle: Array
    states: list[State]


class InputPath:
    """Splits a sample into spans of constant command behind a pure delay."""

    def __init__(self, delay: float, start: float) -> None:
        self.whole = int(delay / SAMPLE_TIME)
        self.part = delay - self.whole * SAMPLE_TIME
        self.past = [start] * (self.whole + 1)

    def spans(self, command: float) -> list[tuple[float, float]]:
        """(command [V], duration [s]) pairs of the next sample."""
        self.past.append(command)
        old, new = self.past[-self.whole - 2], self.past[-self.whole - 1]
        spans = [(old, self.part), (new, SAMPLE_TIME - self.part)]
        return [s for s in spans if s[1] > 1.0e-9]


def run(
    plant: Plant,
    nominal: Plant,
    name: str,
    duration: float,
    supply: float,
    noise: Noise,
    rng: np.random.Generator,
) -> Record:
    """Closed-loop run of one recording; `supply` is the initial tank pressure [gauge Pa]."""
    shape = build(name, duration, SAMPLE_TIME, rng)
    control = Controller(nominal, SAMPLE_TIME, rng)
    n = len(shape.reference)
    white = rng.standard_normal((n, 3))
    columns = np.empty((n, 4))
    lag = plant.effects.input_path_lag
    path = InputPath(lag.delay if lag else 0.0, plant.par.null_voltage)
    y = plant.rest(supply + plant.par.ambient)
    step = 1.0e-3
    states: list[State] = []
    for i in range(n):
        states.append(y)
        p, ps, angle = plant.reading(y)
        p = round((p + noise.pressure * white[i, 0]) / noise.pressure_step) * noise.pressure_step
        ps = round((ps + noise.pressure * white[i, 1]) / noise.pressure_step) * noise.pressure_step
        angle = round((angle + noise.angle * white[i, 2]) / noise.angle_step) * noise.angle_step
        u = control(float(shape.reference[i]), angle, p, float(shape.dither[i]), bool(shape.sealed[i]))
        columns[i] = u, ps, p, angle
        for command, span in path.spans(u):
            y, step = plant.advance(y, plant.valve_opening(command), span, step)
    return Record(SAMPLE_TIME * np.arange(n), columns[:, 0], columns[:, 1], columns[:, 2], columns[:, 3], states)


def reach(plant: Plant, bare: Plant, record: Record, noise: Noise, window: float = 2.0) -> dict[str, float]:
    """How far the effects move each channel, in units of its noise.

    The plant without its effects gets the same commands in windows that start from the true state; returned
    is the rms over the recording of the difference between the noise-free readings.
    """
    every = round(window / SAMPLE_TIME)
    moved = np.zeros((len(record.states), 2))
    step = 1.0e-3
    y: State = []
    for i, state in enumerate(record.states):
        if i % every == 0:
            y = bare.initial(state[0], state[1], state[2], state[3])
        true, other = plant.reading(state), bare.reading(y)
        moved[i] = true[0] - other[0], true[2] - other[2]
        y, step = bare.advance(y, bare.valve_opening(float(record.command[i])), SAMPLE_TIME, step, rtol=1.0e-6)
    lsb = math.sqrt(12.0)
    floor = np.array(
        [
            math.hypot(noise.pressure, noise.pressure_step / lsb),
            math.hypot(noise.angle, noise.angle_step / lsb),
        ]
    )
    rms = np.sqrt((moved**2).mean(axis=0)) / floor
    return {"muscle_pressure": float(rms[0]), "joint_angle": float(rms[1])}


def _write(path: Path, text: str) -> None:
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
    lines = ["time [s],valve_command [V],supply_pressure [bar],muscle_pressure [bar],joint_angle [deg]"]
    lines += [
        f"{t:.3f},{u:.4f},{ps / 1e5:.5f},{p / 1e5:.5f},{math.degrees(a):.3f}"
        for t, u, ps, p, a in zip(record.time, record.command, record.supply, record.pressure, record.angle, strict=True)
    ]
    return "\n".join(lines) + "\n"


def _case_toml(recordings: Sequence[tuple[str, str]]) -> str:
    blocks = ['schema = "pamrs.case/1"\nrig = "rig.toml"\n']
    blocks += [f'[[recording]]\nfile = "{name}.csv"\nrole = "{role}"\n' for name, role in recordings]
    return "\n".join(blocks)


def draw_parameters(
    kind: str, model: dict[str, Any], tolerance: dict[str, float], rng: np.random.Generator
) -> tuple[dict[str, Any], dict[str, float]]:
    """Draw the true baseline.

    `none` keeps the nominal values, `parameters` moves four to six of them by one to two tolerances, and
    everything else lies within one tolerance (normal, truncated).

    Returns
    -------
    model : dict
        The true nested model.
    moved : dict
        Deviation in tolerances, by dotted name.
    """
    true = {k: dict(v) for k, v in model.items()}
    names = [k for k in tolerance if k != "supply.initial_pressure"]
    moved = dict.fromkeys(names, 0.0)
    if kind != "none":
        for name in names:
            z = 2.0
            while abs(z) > 1.0:
                z = float(rng.standard_normal())
            moved[name] = z
    if kind == "parameters":
        loud = [k for k in names if not k.startswith("sensors.") and k not in ("supply.volume", "arm.coulomb")]
        for name in rng.choice(loud, int(rng.integers(4, 7)), replace=False):
            moved[str(name)] = float(rng.choice([-1.0, 1.0]) * rng.uniform(1.0, 2.0))
    for name, z in moved.items():
        section, key = name.split(".")
        true[section][key] = model[section][key] + z * tolerance[name]
    return true, moved


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
        Folder of the cases and folder of the keys (must differ, and the keys must not lie inside the cases).
    kind : str
        One of :data:`trial.effects.KINDS`, "random", or effects joined by "+" for a pair.
    seed : int
        Everything is determined by the seed, the kind and the other arguments.
    name : str
        Folder name of the case.
    strength : float
        Size of the effect; 1 is typical.
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
    chosen = select(recordings)
    rng = np.random.default_rng([seed, 20140517])
    if kind == "random":
        kind = str(rng.choice(KINDS))
    parts = kind.split("+")
    if any(p not in KINDS for p in parts) or (len(parts) > 1 and {"none", "parameters"} & set(parts)):
        raise ValueError(f"unknown kind {kind!r}; known: {', '.join(KINDS)}, random, and effects joined by '+'")
    rig = (rig or default_rig()).resolve()
    model, tolerance = read_rig(rig)
    true, moved = draw_parameters(kind, model, tolerance, rng)
    ids = [p for p in parts if p not in ("none", "parameters")]
    effects = Effects(**{p: draw(p, strength, rng) for p in ids})
    noise = Noise(
        pressure=float(rng.uniform(300.0, 600.0)),
        pressure_step=float(rng.choice([42.0, 84.0])),
        angle=math.radians(float(rng.uniform(0.01, 0.02))),
        angle_step=ANGLE_STEP,
    )
    par = to_parameters(true)
    plant = Plant(par, effects)
    bare = Plant(par) if ids else None
    nominal = _nominal(rig)
    supply_tol = tolerance.get("supply.initial_pressure", 0.0)
    files: dict[str, str] = {}
    runs: dict[str, Any] = {}
    for index, (recording, role) in enumerate(chosen):
        own = np.random.default_rng([seed, index, 77])
        supply = par.supply_pressure + float(own.uniform(-1.0, 1.0)) * supply_tol
        record = run(plant, nominal, recording, duration, supply, noise, own)
        files[f"{recording}.csv"] = _csv(record)
        runs[recording] = {"role": role, "initial_supply_pressure": supply}
        if bare is not None:
            runs[recording]["reach"] = reach(plant, bare, record, noise)
    verdict = kind if not ids else ("effects" if all(i in LISTED for i in ids) else "unlisted")
    key = {
        "schema": "pamrs.trial-key/1",
        "case": name,
        "kind": kind,
        "verdict": verdict,
        "effects": ids,
        "effect_parameters": effects.to_dict(),
        "parameters": {k: true[k.split(".")[0]][k.split(".")[1]] for k in moved},
        "moved_tolerances": moved,
        "noise": asdict(noise),
        "recordings": runs,
        "reach": max((max(r["reach"].values()) for r in runs.values() if "reach" in r), default=0.0),
        "seed": seed,
        "strength": strength,
    }
    text = json.dumps(key, indent=1) + "\n"
    digest = hashlib.sha256(text.encode()).hexdigest()
    _write(keys / f"{name}.json", text)
    if publish is not None:
        publish(digest)
    _write(out / name / "rig.toml", rig.read_text(encoding="utf-8"))
    for file, content in files.items():
        _write(out / name / file, content)
    _write(out / name / "case.toml", _case_toml(chosen))
    return digest
