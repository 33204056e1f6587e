"""Bytes of logs, rigs and cases at random: read, or refused in words. ``PAMRS_FUZZ`` says how many
are tried of each kind (``make fuzz``); a few by default.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

import pamrs
from pamrs.errors import MissingPackageError, PamrsError
from pamrs.recordings.logs import read_log
from tests.hostile.corpus import SHOULDER, TABLE
from tests.recordings.written import written

#: What a library leaves open of a broken file is told by it as it goes.
pytestmark = pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")

EXAMPLES = int(os.environ.get("PAMRS_FUZZ", "25"))
FUZZ = settings(
    max_examples=EXAMPLES,
    deadline=None,
    database=None,
    derandomize="PAMRS_FUZZ" not in os.environ,
    suppress_health_check=list(HealthCheck),
)
KINDS = ("parquet", "feather", "npy", "npz", "mat", "hdf5", "mf4", "tdms", "mcap", "xlsx", "csv")

#: Places in a file (as a share of its length) and bytes that are put there.
CHANGES = st.lists(
    st.tuples(st.floats(0.0, 1.0, exclude_max=True), st.binary(max_size=9)), max_size=6
)


@cache
def sound(kind: str) -> bytes:
    """A log of that kind, as it should be."""
    if kind == "csv":
        return TABLE.encode()
    with tempfile.TemporaryDirectory() as home:
        file, _, _ = written(Path(home), kind)
        return file.read_bytes()


def changed(content: bytes, changes: list[tuple[float, bytes]], end: float) -> bytes:
    """A content with other bytes at some places, cut after a share of its length."""
    made = bytearray(content)
    for share, new in changes:
        at = int(share * len(made))
        made[at : at + len(new)] = new
    return bytes(made[: max(1, round(end * len(made)))])


def refusal(work: Callable[[], object]) -> str:
    """What some work is refused by; empty where it is done."""
    try:
        work()
    except PamrsError as error:
        return str(error)
    return ""


@pytest.mark.parametrize("kind", KINDS)
@FUZZ
@given(changes=CHANGES, end=st.one_of(st.just(1.0), st.floats(0.0, 1.0)))
@example(changes=[(0.1, b"\x01")], end=1.0)  # a Feather file that asks for 7e16 bytes
def test_a_log_of_any_bytes_is_read_or_refused(
    kind: str, changes: list[tuple[float, bytes]], end: float
) -> None:
    try:
        content = sound(kind)
    except (ImportError, MissingPackageError):
        pytest.skip("a package is missing")
    with tempfile.TemporaryDirectory() as home:
        file = Path(home) / f"run.{'h5' if kind == 'hdf5' else kind}"
        file.write_bytes(changed(content, changes, end))

        def read() -> None:
            series = read_log(file).series
            assert series
            assert not any(np.isinf(one.values).any() for one in series.values())

        assert len(refusal(read)) < 3000


@FUZZ
@given(changes=CHANGES, text=st.text(max_size=30), end=st.floats(0.0, 1.0))
def test_a_rig_of_any_text_is_read_or_refused(
    changes: list[tuple[float, bytes]], text: str, end: float
) -> None:
    content = changed(SHOULDER.encode(), changes, max(end, 0.2))
    for whole in (content, content + text.encode("utf-8", "replace")):
        with tempfile.TemporaryDirectory() as home:
            file = Path(home) / "rig.toml"
            file.write_bytes(whole)
            assert len(refusal(lambda file=file: pamrs.load_rig(file).to_toml_text())) < 20_000


@FUZZ
@given(
    entry=st.dictionaries(
        st.sampled_from(["name", "role", "start", "stop", "sample_time", "columns", "decimal"]),
        st.sampled_from(
            ["1e300", "-1", "nan", "1e-9", '"x"', '""', "[]", "[1]", "{}", "true", '"\\u0000"']
        ),
        max_size=4,
    ),
    changes=CHANGES,
)
def test_a_case_of_any_entry_is_read_or_refused(
    entry: dict[str, str], changes: list[tuple[float, bytes]]
) -> None:
    with tempfile.TemporaryDirectory() as folder:
        home = Path(folder)
        (home / "rig.toml").write_text(SHOULDER, encoding="utf-8")
        (home / "run.csv").write_bytes(changed(TABLE.encode(), changes, 1.0))
        lines = ['schema = "pamrs.case/1"', "[[recording]]", 'file = "run.csv"']
        lines += [f"{key} = {value}" for key, value in entry.items()]
        (home / "case.toml").write_text("\n".join(lines), encoding="utf-8")
        assert len(refusal(lambda: pamrs.load_case(home))) < 20_000
