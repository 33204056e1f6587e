"""Write the cases of a plan so that an interrupted run can go on."""

from __future__ import annotations

import json
import multiprocessing
from collections.abc import Callable, Sequence
from pathlib import Path

from .cases import complete, make
from .concealed import Case, store, write
from .design import Spec

MANIFEST = "manifest.json"
SCHEMA = "pamrs.trial-manifest/1"


def write_plan(
    folder: Path,
    wanted: Sequence[Spec],
    *,
    jobs: int = 1,
    progress: Callable[[str, int, int], None] | None = None,
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
        From :func:`trial.design.specs`.
    jobs : int
        Processes.
    progress : callable, optional
        Called with the name of each case made, the number done and the number of all.

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
    missing = [spec for spec in wanted if not complete(folder, spec, digests)]
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

    if jobs <= 1 or len(missing) < 2:
        for spec in missing:
            keep(make(spec))
    else:
        with multiprocessing.get_context("spawn").Pool(min(jobs, len(missing))) as pool:
            for case in pool.imap_unordered(make, missing):
                keep(case)
    if not missing and not manifest.is_file():
        raise ValueError("the plan has no case")
    return manifest
