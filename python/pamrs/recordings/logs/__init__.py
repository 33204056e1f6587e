"""Logs of a laboratory, read as they are: text, tables, sheets, MATLAB, HDF5, MDF, TDMS, bags.

:func:`read_log` turns a file into named series of numbers, each with the unit and the clock that
the file gives it. There is one module for each family of formats; which of the series is which
channel, and in what unit, is for those who call it.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path
from typing import Final, NamedTuple

from pamrs._files import check_regular
from pamrs.errors import MissingPackageError, PamrsError, RecordingError
from pamrs.recordings._gate import check_size
from pamrs.recordings.logs._arrays import read_arrow, read_hdf, read_matlab, read_numpy
from pamrs.recordings.logs._log import (
    Log,
    Series,
    TextFormat,
    Written,
    split_heading,
    switched,
    table_of,
    understood_unit,
)
from pamrs.recordings.logs._recorders import read_bag, read_mcap, read_mdf, read_tdms
from pamrs.recordings.logs._text import read_json, read_sheets, read_text_log

__all__ = [
    "ENDINGS",
    "Log",
    "Series",
    "TextFormat",
    "Written",
    "check_readable",
    "read_log",
    "split_heading",
    "switched",
    "table_of",
    "understood_unit",
]

_EXTRA: Final = "logs"


class _Format(NamedTuple):
    read: Callable[[Path, TextFormat], Log]
    needs: tuple[str, ...] = ()


_TEXT: Final = _Format(read_text_log)
_JSON: Final = _Format(read_json)
_ARROW: Final = _Format(read_arrow, ("pyarrow",))
_HDF: Final = _Format(read_hdf, ("h5py",))
_MDF: Final = _Format(read_mdf, ("asammdf",))
_BAG: Final = _Format(read_bag, ("rosbags",))
#: What reads the files of each ending, and the packages that it needs; a new format is one
#: function and its entry here.
_FORMATS: Final[dict[str, _Format]] = {
    **dict.fromkeys((".csv", ".tsv", ".txt", ".dat", ".lvm", ".asc", ""), _TEXT),
    **dict.fromkeys((".json", ".jsonl", ".ndjson"), _JSON),
    **dict.fromkeys((".parquet", ".feather", ".arrow"), _ARROW),
    **dict.fromkeys((".npy", ".npz"), _Format(read_numpy)),
    ".mat": _Format(read_matlab, ("matio", "h5py")),
    **dict.fromkeys((".h5", ".hdf5", ".hdf"), _HDF),
    **dict.fromkeys((".mf4", ".mdf"), _MDF),
    ".tdms": _Format(read_tdms, ("nptdms",)),
    **dict.fromkeys((".bag", ".db3"), _BAG),
    **dict.fromkeys((".xlsx", ".xlsm", ".xls"), _Format(read_sheets, ("python_calamine",))),
    ".mcap": _Format(read_mcap, ("mcap", "mcap_ros2")),
}
#: Endings that are read.
ENDINGS: Final = tuple(ending for ending in _FORMATS if ending)


def _format(path: Path) -> _Format:
    if path.is_dir():
        if (path / "metadata.yaml").is_file():
            return _BAG
        raise RecordingError(
            f"{path}: a folder, not a file (a bag of ROS 2 is a folder with metadata.yaml)"
        )
    name = path.name.lower()
    ending = Path(name.removesuffix(".gz")).suffix
    form = _FORMATS.get(ending)
    if ending == ".dat" and path.is_file():
        with path.open("rb") as stream:  # measuring systems of cars call theirs so
            form = _MDF if stream.read(8) == b"MDF     " else form
    if form is None or (name.endswith(".gz") and form not in (_TEXT, _JSON)):
        raise RecordingError(
            f"{path}: the format {Path(name).suffix!r} is not read here; readable are "
            f"{', '.join(ENDINGS)} and the folder of a bag (text also .gz)"
        )
    return form


def check_readable(path: Path) -> None:
    """Refuse a log that cannot be read here, before any work begins.

    Parameters
    ----------
    path : Path
        File, or folder of a bag.

    Raises
    ------
    RecordingError
        If it is not there, no regular file, or its ending is not known.
    MissingPackageError
        If a package that reads it is not installed; the message names the extra.
    """
    if not path.exists():
        raise RecordingError(f"{path}: cannot be read (no such file)")
    form = _format(path)
    try:
        if not path.is_dir():
            check_regular(path)
    except OSError as error:
        raise RecordingError(f"{path}: cannot be read ({error})") from error
    missing = [name for name in form.needs if find_spec(name) is None]
    if missing:
        raise MissingPackageError(
            f"{path}: to read it takes {' and '.join(missing)}, which is not installed: "
            f"pip install 'pamrs[{_EXTRA}]'",
            name=missing[0],
        )


def read_log(path: Path, form: TextFormat | None = None) -> Log:
    """Read a log.

    Parameters
    ----------
    path : Path
        File, or folder of a bag; the ending tells the format.
    form : TextFormat, optional
        How a text file is written, where that is not to be found out; names of columns.

    Returns
    -------
    Log
        Series with the units and clocks that the file gives them.

    Raises
    ------
    RecordingError
        If it is missing, broken, too large or of a kind that is not read.
    MissingPackageError
        If a package is missing; the message names the extra.
    """
    check_readable(path)
    try:
        log = _format(path).read(path, form or TextFormat())
    except PamrsError:
        raise
    except Exception as error:  # each library has its own kinds for a broken file
        reason = next(iter(str(error).strip().splitlines()), type(error).__name__)
        raise RecordingError(f"{path}: cannot be read ({reason[:200]})") from error
    sizes = [series.values.size for series in log.series.values()]
    check_size(max(sizes, default=0), sum(sizes), str(path))
    return log
