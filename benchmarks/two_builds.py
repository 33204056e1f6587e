"""Every number of one build against those of another, bit for bit.

``python -m benchmarks.two_builds write OUT.npz`` simulates every packaged rig, bare and with each
effect that it can have, and predicts each of its blocks with all sensitivities. Run it once with
each build on ``PYTHONPATH``, then ``python -m benchmarks.two_builds compare ONE.npz OTHER.npz``
lists what differs and ends with 1 where anything does.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np

import pamrs
from pamrs import _core

SAMPLE = 5e-3  # s
SAMPLES = 240
WINDOW = 60


def rigs() -> Iterator[tuple[str, pamrs.Rig]]:
    """Every packaged rig, bare, with each effect by itself at two sets of values, and with all of
    them.
    """
    try:
        from pamrs.effects import EFFECTS
    except ImportError:  # builds before that package
        from pamrs.effects_table import EFFECTS
    for name in pamrs.rigs.names():
        rig = pamrs.rigs.named(name)
        yield name, rig
        everything = rig
        for effect in EFFECTS.values():
            last = {p.name: p.starts[-1] for p in effect.parameters if p.starts}
            for label, values in (("default", {}), ("last", last)):
                try:
                    altered = rig.with_effect(effect.id, values)
                except pamrs.ParameterError:
                    continue
                yield f"{name}+{effect.id}.{label}", altered
            try:
                everything = everything.with_effect(effect.id, {})
            except pamrs.ParameterError:
                continue
        yield f"{name}+all", everything


def driven(rig: pamrs.Rig, core: _core.Rig) -> dict[str, np.ndarray]:
    """Held commands that fill, hold and vent, and a length where a frame asks for one."""
    time = np.arange(SAMPLES) * SAMPLE
    signals: dict[str, np.ndarray] = {}
    valves = rig.tables("valve")
    for k, name in enumerate(core.inputs):
        kind, _, block = name.partition(".")
        if kind == "valve_command":
            table = valves[block]
            wave = np.sign(np.sin(2 * np.pi * time / (0.45 + 0.1 * k))) * (0.2 + 0.5 * time)
            wave[np.abs(np.sin(7.0 * time + k)) < 0.3] = 0.0
            signals[name] = float(table["null_voltage"]) + wave * float(table["half_range"]) * 0.5
        else:
            signals[name] = 2e5 + 5e4 * np.sin(2 * np.pi * time)
    load = rig.tables("load").get("", {})
    if load.get("kind") == "frame":
        low, high = float(load["min_length"]), float(load["max_length"])
        signals["length"] = 0.5 * (low + high) + 0.3 * (high - low) * np.sin(3.0 * time)
    return signals


def blocks(core: _core.Rig) -> Iterator[tuple[str, str]]:
    """Name and output channel of each block that can be predicted."""
    kinds = {
        "supply_pressure": "supply",
        "muscle_pressure": "chamber",
        "joint_angle": "arm",
        "length": "load",
    }
    for channel in core.channels:
        kind, _, name = channel.partition(".")
        if kind in kinds:
            yield kinds[kind] + (f".{name}" if name else ""), channel


def numbers(
    label: str, rig: pamrs.Rig, measured: dict[str, np.ndarray]
) -> Iterator[tuple[str, np.ndarray]]:
    """Every channel of a simulation, and predictions with sensitivities, by name."""
    try:
        core = _core.Rig(rig.to_json())
        signals = driven(rig, core)
        step = 1e-3
        yield f"{label}|stable_step", np.array([core.stable_step])
        try:
            channels, events = core.simulate(SAMPLES, signals, SAMPLE, step, {})
        except pamrs.PamrsError as error:
            yield f"{label}|simulation refused: {error}", np.zeros(0)
            channels, events = {}, []
        for name, values in channels.items():
            yield f"{label}|{name}", values
        yield f"{label}|events", np.array([time for time, *_ in events])
        if not measured:
            measured.update(channels)
        commands = {name: signals[name] for name in core.inputs}
        known = {
            name: (values, np.gradient(values, SAMPLE))
            for name, values in measured.items()
            if name.partition(".")[0]
            in ("supply_pressure", "muscle_pressure", "joint_angle", "length")
        }
        starts = list(range(0, SAMPLES, WINDOW))
        for block, channel in blocks(core):
            if channel not in known:
                continue
            try:
                value, slopes = core.predict(
                    block,
                    commands,
                    SAMPLE,
                    step,
                    starts,
                    list(core.parameter_names),
                    known,
                    SAMPLES,
                )
            except pamrs.PamrsError as error:
                yield f"{label}|{block} refused: {error}", np.zeros(0)
                continue
            yield f"{label}|{block} predicted", value
            if slopes is not None:
                yield f"{label}|{block} sensitivities", slopes
    except pamrs.PamrsError as error:
        yield f"{label}|refused: {error}", np.zeros(0)


def write(path: Path) -> None:
    """All numbers of this build."""
    found: dict[str, np.ndarray] = {}
    nominal: dict[str, dict[str, np.ndarray]] = {}
    for label, rig in rigs():
        measured = nominal.setdefault(label.partition("+")[0], {})
        found.update(numbers(label, rig, measured))
        if label.partition("+")[2] in ("", "all"):
            print(f"{len(found):6d} arrays  {label}", file=sys.stderr)
    with path.open("wb") as file:
        np.savez(
            file,
            **{f"a{k}": values for k, values in enumerate(found.values())},
            names=np.array(list(found)),
        )
    print(
        f"{path}: {len(found)} arrays, {sum(values.size for values in found.values())} numbers, "
        f"core {_core.__file__}"
    )


def compare(one: Path, other: Path) -> int:
    """How many arrays differ."""
    with np.load(one) as first, np.load(other) as second:
        a = {name: first[f"a{k}"] for k, name in enumerate(first["names"].tolist())}
        b = {name: second[f"a{k}"] for k, name in enumerate(second["names"].tolist())}
    lost = [name for name in a if name not in b]
    new = [name for name in b if name not in a]
    for name in lost:
        print(f"only in {one}: {name}")
    for name in new:
        print(f"only in {other}: {name}")
    differ = 0
    for name in a.keys() & b.keys():
        x, y = a[name], b[name]
        if x.shape != y.shape or not np.array_equal(x, y, equal_nan=True):
            differ += 1
            apart = (
                float(np.nanmax(np.abs(x - y) / (np.abs(x) + 1e-300)))
                if x.shape == y.shape
                else float("inf")
            )
            print(f"differs: {name}: shapes {x.shape}, {y.shape}, relative {apart:.2e}")
    same = len(a.keys() & b.keys()) - differ
    total = sum(a[name].size for name in a.keys() & b.keys())
    print(
        f"{same} arrays are the same bit for bit, {differ} differ, {len(lost) + len(new)} are in "
        f"one only; {total} numbers"
    )
    return differ + len(lost) + len(new)


def main() -> int:
    """The command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    verbs = parser.add_subparsers(dest="verb", required=True)
    verbs.add_parser("write").add_argument("out", type=Path)
    both = verbs.add_parser("compare")
    both.add_argument("one", type=Path)
    both.add_argument("other", type=Path)
    given = parser.parse_args()
    if given.verb == "write":
        write(given.out)
        return 0
    return 1 if compare(given.one, given.other) else 0


if __name__ == "__main__":
    sys.exit(main())
