"""Conceal an effect in recordings of a simulated shoulder, diagnose them, open the key.

The plant that makes the recordings shares no code with the package, and the diagnosis runs in a
process of its own that is given the case folder and nothing else. The key's fingerprint is printed
first.
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
from typing import Any

KINDS = ("leak_muscle", "heat_transfer", "muscle_hysteresis")
#: Answers that are no names of effects.
WORDS = {
    "unlisted": "an effect outside the catalogue",
    "parameters": "parameter values that are off",
    "none": "nothing missing",
}
ROOT = Path(__file__).parents[1]


def score(key: dict[str, Any], result: dict[str, Any]) -> tuple[str, str, bool]:
    """What was concealed, what the verdict is, and whether they agree."""
    named = sorted(effect["id"] for effect in result["effects"])
    truth = " + ".join(key["effects"]) or key["verdict"]
    verdict = result["verdict"] + (f": {' + '.join(named)}" if named else "")
    right = result["verdict"] == key["verdict"]
    if key["verdict"] == "effects":
        right = right and named == sorted(key["effects"])
    return truth, verdict, right


def judgement(key: dict[str, Any], result: dict[str, Any]) -> str:
    """Whether the verdict is the truth, and whether the diagnosis calls it settled."""
    right = score(key, result)[2]
    truth = sorted(key["effects"]) or [key["verdict"]]
    named = sorted(effect["id"] for effect in result["effects"])
    first = named if result["verdict"] == "effects" else [result["verdict"]]
    sets = [sorted(names) for names in result["ambiguity"]]
    rivals = [names for names in sets if names != first]
    if not right:
        held = truth in sets
        return "The first answer is NOT the truth this time" + (
            ", but the diagnosis leaves it open, and the truth is among what is open."
            if held
            else "."
        )
    if rivals:
        others = " and ".join(" + ".join(WORDS.get(name, name) for name in s) for s in rivals)
        still = "is" if len(rivals) == 1 else "are"
        return f"The verdict is right, but not settled: {others} {still} open as well."
    answer = result["answer"]
    if not answer["settled"]:
        why = f"its probability is {answer['probability']:.2f}"
        why = "the model still misses too much" if answer["missed"] else why
        return f"The verdict is right, but not settled: {why}."
    return "The verdict is right."


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--kind", help=f"what to conceal; by default one of {', '.join(KINDS)} by chance"
    )
    parser.add_argument(
        "--seed", type=int, help="number that fixes the case; by default a fresh one"
    )
    parser.add_argument(
        "--out", type=Path, default=Path("out/demo"), help="folder for everything written"
    )
    options = parser.parse_args()
    seed = secrets.randbelow(10**6) if options.seed is None else options.seed
    kind = options.kind or secrets.choice(KINDS)
    out = options.out if options.out.is_absolute() else ROOT / options.out
    folder, key_path = out / "cases" / "case_001", out / "keys" / "case_001.json"
    for stale in (folder, key_path.parent):
        shutil.rmtree(stale, ignore_errors=True)
    out.mkdir(parents=True, exist_ok=True)

    print(
        "1  An independent plant writes recordings with something concealed in them ...", flush=True
    )
    make = [sys.executable, "-m", "trial", "make", "--kind", kind, "--seed", str(seed)]
    folders = ["--out", str(folder.parent), "--keys-dir", str(key_path.parent)]
    made = subprocess.run([*make, *folders], cwd=ROOT, stdout=subprocess.DEVNULL, check=False)
    if made.returncode:
        return made.returncode
    digest = hashlib.sha256(key_path.read_bytes()).hexdigest()
    print(f"   SHA-256 of the key, still shut: {digest}", flush=True)

    report, answer, picture = out / "report.html", out / "result.json", out / "diagnosis.png"
    model = out / "model.toml"
    print("2  The diagnosis, in its own process, sees only the case folder ...\n", flush=True)
    started = time.perf_counter()
    outputs = ["--report", str(report), "--json", str(answer), "--png", str(picture)]
    outputs += ["--model", str(model)]
    command = [sys.executable, "-m", "pamrs", "diagnose", str(folder), *outputs]
    done = subprocess.run(command, cwd=folder, check=False)
    if done.returncode:
        return done.returncode
    seconds = time.perf_counter() - started

    key = json.loads(key_path.read_text(encoding="utf-8"))
    result = json.loads(answer.read_text(encoding="utf-8"))
    truth, verdict, _ = score(key, result)
    print(
        f"\n3  The key is opened.\n   concealed: {truth}\n"
        f"   verdict:   {verdict}   ({seconds:.0f} s)"
    )
    print(f"   {judgement(key, result)}")
    again = f"make demo KIND={kind} SEED={seed}"
    print(f"\nThe same case again: {again}\nWritten:")
    for path in (report, picture, answer, model, key_path, folder):
        print(f"   {path.relative_to(ROOT) if path.is_relative_to(ROOT) else path}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
