"""Conceal an effect in a simulated shoulder, record one poor log, and let a campaign find it.

The plant is the packaged shoulder with values drawn within their tolerances and one effect; the
fingerprint of its file is printed first. The campaign is `pamrs campaign` in a process of its own,
whose device is that plant; the model that it knows is the packaged rig.
"""

import argparse
import hashlib
import json
import secrets
import shutil
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

import pamrs

#: What is concealed, and its sizes [SI]; without any the usual ones of the catalogue.
KINDS = {
    "leak_muscle": {"conductance": 6e-10},
    "valve_dead_zone": {},
    "muscle_hysteresis": {},
}
ROOT = Path(__file__).parents[1]
SAMPLE_TIME, SECONDS = 0.01, 30.0
NOISE = {"supply_pressure": 400.0, "muscle_pressure": 400.0, "joint_angle": np.radians(0.02)}
NAMED = (
    "supply.initial_pressure",
    "valve.discharge_area_max",
    "chamber.dead_volume",
    "muscle.modulus_scale",
    "arm.payload",
)


def concealed(kind: str, rng: np.random.Generator) -> pamrs.Rig:
    """The plant: the shoulder with values within their tolerances, and an effect."""
    rig = pamrs.rigs.shoulder()
    drawn = {}
    for name in NAMED:
        known = rig.parameter(name)
        drawn[name] = known.value + known.tol * float(rng.uniform(-1.0, 1.0))
    return rig.with_parameters(drawn).with_effect(kind, KINDS.get(kind) or None)


def poor_log(plant: pamrs.Rig, rng: np.random.Generator) -> str:
    """Somebody plays with the valve for half a minute, as a table."""
    n = round(SECONDS / SAMPLE_TIME)
    command = np.full(n, 5.0)
    k = 0
    while k < n:
        held = int(rng.integers(30, 150))
        command[k : k + held] += rng.choice(
            [0.0, rng.uniform(-0.35, -0.15), rng.uniform(0.15, 0.4)]
        )
        k += held
    run = pamrs.simulate(plant, command, sample_time=SAMPLE_TIME)
    seen = {name: run[name] + rng.normal(0.0, std, n) for name, std in NOISE.items()}
    heads = ["time [s]", "valve_command [V]", "supply_pressure [bar]", "muscle_pressure [bar]"]
    columns = [run.time, command, seen["supply_pressure"] / 1e5, seen["muscle_pressure"] / 1e5]
    columns.append(np.degrees(seen["joint_angle"]))
    rows = [",".join(f"{value:.7g}" for value in row) for row in np.column_stack(columns)]
    return "\n".join([",".join([*heads, "joint_angle [deg]"]), *rows]) + "\n"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--kind", choices=KINDS, help="what to conceal; by default one of these by chance"
    )
    parser.add_argument(
        "--seed", type=int, help="number that fixes the case; by default a fresh one"
    )
    parser.add_argument(
        "--out", type=Path, default=Path("out/campaign"), help="folder for all of it"
    )
    options = parser.parse_args()
    seed = secrets.randbelow(10**6) if options.seed is None else options.seed
    kind = options.kind or secrets.choice(list(KINDS))
    out = options.out if options.out.is_absolute() else ROOT / options.out
    shutil.rmtree(out, ignore_errors=True)
    out.mkdir(parents=True)

    plant_file, log, home = out / "key.toml", out / "free_log.csv", out / "campaign"
    rng = np.random.default_rng(seed)
    plant = concealed(kind, rng)
    plant_file.write_text(plant.to_toml_text(), encoding="utf-8")
    log.write_text(poor_log(plant, rng), encoding="utf-8")
    digest = hashlib.sha256(plant_file.read_bytes()).hexdigest()
    print(f"1  A shoulder with something concealed in it was recorded for {SECONDS:g} s.")
    print(f"   SHA-256 of the key, still shut: {digest}", flush=True)
    print("2  The campaign knows the packaged rig and that log ...\n", flush=True)
    started = time.perf_counter()
    command = [sys.executable, "-m", "pamrs", "campaign", "shoulder", "--log", str(log)]
    command += ["--device", f"simulated:{plant_file}", "--out", str(home), "--runs", "3"]
    done = subprocess.run([*command, "--period", "10 ms"], check=False)
    if done.returncode:
        return done.returncode
    seconds = time.perf_counter() - started
    steps = json.loads((home / "campaign.json").read_text(encoding="utf-8"))["steps"]
    names = steps[-1]["after"]["names"] if steps else []
    print(f"\n3  The key is opened.\n   concealed: {kind}")
    print(f"   named:     {' + '.join(names) or 'nothing'}   ({seconds:.0f} s, {len(steps)} runs)")
    print(f"\nThe same again: make campaign KIND={kind} SEED={seed}\nWritten:")
    pages = [home / f"step_{step['number']:02d}" / "page.html" for step in steps]
    for path in (home / "campaign.html", *pages, log, plant_file):
        print(f"   {path.relative_to(ROOT) if path.is_relative_to(ROOT) else path}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
