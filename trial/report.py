"""How a trial was made: keys against the digests that were published, the run, code and machine."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any

from .plan import MANIFEST
from .plan import SCHEMA as MANIFEST_SCHEMA


def checked(folder: Path) -> tuple[str, int]:
    """Compare every key with the digest that was published before its case was written.

    Parameters
    ----------
    folder : Path
        Holds ``manifest.json`` and ``keys``.

    Returns
    -------
    digest : str
        SHA-256 of the manifest.
    count : int
        Number of keys.

    Raises
    ------
    ValueError
        A key that is missing, not in the manifest, or not the one that was published.
    """
    content = (folder / MANIFEST).read_bytes()
    told = json.loads(content)
    if told.get("schema") != MANIFEST_SCHEMA:
        raise ValueError(f"{folder / MANIFEST}: schema must be {MANIFEST_SCHEMA!r}")
    found = {
        p.stem: hashlib.sha256(p.read_bytes()).hexdigest() for p in (folder / "keys").glob("*.json")
    }
    for name, digest in told["keys"].items():
        if found.get(name) != digest:
            raise ValueError(
                f"{folder / 'keys' / name}.json: "
                f"{'missing' if name not in found else 'not the key that was published'}"
            )
    if more := sorted(set(found) - set(told["keys"])):
        raise ValueError(f"{folder / 'keys'}: not in the manifest: {', '.join(more[:3])}")
    return hashlib.sha256(content).hexdigest(), len(found)


def run_of(results: Path, digest: str) -> dict[str, Any]:
    """The record that ``python -m trial prove`` keeps; it must be of this manifest."""
    file = results / "run.json"
    if not file.is_file():
        return {}
    told: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))
    if told.get("manifest_sha256") not in (None, digest):
        raise ValueError(f"{file}: of another manifest; run `python -m trial prove` again")
    return told


def about(folder: Path, digest: str, count: int, run: dict[str, Any], command: str) -> list[str]:
    """How a trial was made: its cases, the digest of its manifest, the code and the machine, and
    the command.
    """
    entries = run.get("cases", {}).values()
    codes = sorted({str(e["code"])[:12] for e in entries if "code" in e})
    errors = sum("error" in e for e in entries)
    machine = run.get("machine", {})
    recordings = len(list((folder / "cases").glob("*/*.csv")))
    lines = [
        f"{count} cases with {recordings} recordings by the independent plant of "
        "[trial](../../trial/README.md). Every key has the SHA-256 that was published before its "
        "case was written; each case was diagnosed in a process of its own that was given that "
        "case's folder only; then the keys were opened.\n",
        f"- SHA-256 of the manifest: `{digest}`",
    ]
    if run:
        ended = f"; {errors} of the cases could not be diagnosed" if errors else ""
        lines.append(f"- pamrs {run.get('version')}, code `{'`, `'.join(codes) or '-'}`{ended}")
        processor = machine.get("processor") or "unknown processor"
        lines.append(
            f"- {processor}, {machine.get('cores')} cores, {run.get('jobs')} cases at a time; "
            f"Python {machine.get('python')}"
        )
        spent = sum(float(e.get("cpu_seconds", 0.0)) for e in entries)
        lines.append(f"- {spent / 3600.0:.1f} h of processor time for the diagnoses")
        if len(codes) > 1:
            lines.append(
                "- **The results were made by different code: run `python -m trial prove --fresh` "
                "before they are quoted.**"
            )
    return [*lines, f"\nMade by\n\n```\n{command}\n```\n"]
