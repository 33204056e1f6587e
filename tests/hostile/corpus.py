"""Hostile inputs by kind: each writes its files into an empty folder and says which command is
tried on them. What is large is large by its heading alone; nothing takes more than some megabytes.

Whatever is in a file, a command ends within seconds: with its work done (exit code 0), or with one
line that says what is wrong (2).
"""

from __future__ import annotations

import io
import os
import re
import struct
import zipfile
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

import pamrs
from pamrs import rigs

#: Writes its files and gives the words of a command.
Writer = Callable[[Path], list[str]]


class Entry(NamedTuple):
    """One hostile input.

    Attributes
    ----------
    name : str
        What it is.
    write : callable
        Writes it.
    told : str
        What the answer has to say; empty where it may as well be taken.
    """

    name: str
    write: Writer
    told: str = ""


def _log(name: str, content: bytes, *options: str) -> Writer:
    def write(home: Path) -> list[str]:
        (home / name).write_bytes(content)
        return ["import", str(home / name), *options]

    return write


def _rig(text: str | bytes) -> Writer:
    def write(home: Path) -> list[str]:
        content = text.encode() if isinstance(text, str) else text
        (home / "rig.toml").write_bytes(content)
        return ["rig", "check", str(home / "rig.toml")]

    return write


SHOULDER = (Path(pamrs.__file__).parent / "rigs" / "shoulder.toml").read_text(encoding="utf-8")
TABLE = "time [s],valve_command [V],muscle_pressure [Pa]\n" + "".join(
    f"{k * 0.005},{5 + 0.1 * (k % 7)},{1e5 + k}\n" for k in range(60)
)


def _case(entry: str, table: str = TABLE, head: str = "") -> Writer:
    def write(home: Path) -> list[str]:
        (home / "rig.toml").write_text(SHOULDER, encoding="utf-8")
        (home / "run.csv").write_text(table, encoding="utf-8")
        text = f'schema = "pamrs.case/1"\n{head}\n[[recording]]\nfile = "run.csv"\n{entry}\n'
        (home / "case.toml").write_text(text, encoding="utf-8")
        return ["replay", str(home)]

    return write


def _npy(shape: tuple[int, ...], data: bytes = bytes(64)) -> bytes:
    stream = io.BytesIO()
    np.lib.format.write_array_header_1_0(
        stream, {"shape": shape, "fortran_order": False, "descr": "<f8"}
    )
    return stream.getvalue() + data


def _npz(*shapes: tuple[int, ...]) -> bytes:
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as packed:
        for k, shape in enumerate(shapes):
            packed.writestr(f"a{k}.npy", _npy(shape, bytes(1 << 20)))
    return stream.getvalue()


def _mat() -> bytes:
    packing = zlib.compressobj(9)
    parts = [packing.compress(struct.pack("<II", 14, 400 << 20))]
    parts += [packing.compress(bytes(1 << 22)) for _ in range(50)]
    body = b"".join([*parts, packing.flush()])
    head = b"MATLAB 5.0 MAT-file".ljust(124) + struct.pack("<H", 0x0100) + b"IM"
    return head + struct.pack("<II", 15, len(body)) + body


def _hdf(make: Callable[[Any], None]) -> Writer:
    def write(home: Path) -> list[str]:
        import h5py

        with h5py.File(home / "run.h5", "w") as file:
            make(file)
        return ["import", str(home / "run.h5")]

    return write


def _bomb(file: Any) -> None:
    file.create_dataset("p", (500_000_000,), "f8", chunks=(1 << 20,), compression="gzip")


def _nested(file: Any) -> None:
    group = file
    for _ in range(500):
        group = group.create_group("g")


def _round(file: Any) -> None:
    group = file.create_group("a")
    group["again"] = file["/"]
    file["p"] = np.arange(100.0)


def _doubled(file: Any) -> None:
    """Twenty groups in each other with two names each: a million paths."""
    inner = file
    for _ in range(20):
        outer, inner = inner, inner.create_group("a")
        outer["b"] = inner
    inner["p"] = np.arange(100.0)


def _arrow(ending: str) -> Writer:
    def write(home: Path) -> list[str]:
        import pyarrow as pa
        import pyarrow.feather
        import pyarrow.parquet

        table = pa.table({"p": pa.array(np.zeros(6_000_000, dtype=np.int8))})
        file = str(home / f"run.{ending}")
        if ending == "parquet":
            pyarrow.parquet.write_table(table, file)
        else:
            pyarrow.feather.write_feather(table, file, compression="zstd", chunksize=6_000_000)
        return ["import", file]

    return write


def _packed(kind: str, megabytes: int) -> bytes:
    """Nothing but zeros, packed piece by piece."""
    import bz2

    import lz4.frame
    import zstandard

    if kind == "lz4":
        frames = lz4.frame.LZ4FrameCompressor()
        return b"".join(
            [
                frames.begin(),
                *(frames.compress(bytes(1 << 20)) for _ in range(megabytes)),
                frames.flush(),
            ]
        )
    packer = bz2.BZ2Compressor(1) if kind == "bz2" else zstandard.ZstdCompressor().compressobj()
    return b"".join([*(packer.compress(bytes(1 << 20)) for _ in range(megabytes)), packer.flush()])


def _mcap_bomb(kind: str, said: int) -> Writer:
    """One part, whose heading says how much it unpacks to."""

    def write(home: Path) -> list[str]:
        from mcap.data_stream import RecordBuilder
        from mcap.records import Chunk, DataEnd, Footer, Header

        made = RecordBuilder()
        made.write(b"\x89MCAP0\r\n")
        for record in (
            Header("", "x"),
            Chunk(kind, _packed(kind, 300), 0, 0, 0, said),
            DataEnd(0),
            Footer(0, 0, 0),
        ):
            record.write(made)
        (home / "run.mcap").write_bytes(made.end() + b"\x89MCAP0\r\n")
        return ["import", str(home / "run.mcap")]

    return write


def _bag_bomb(kind: str) -> Writer:
    """A bag of ROS 1 with one message, in a part that unpacks to more than it says."""

    def record(data: bytes, **fields: Any) -> bytes:
        head = b""
        for name, value in fields.items():
            line = name.encode() + b"=" + value
            head += struct.pack("<I", len(line)) + line
        return struct.pack("<I", len(head)) + head + struct.pack("<I", len(data)) + data

    def number(value: int, form: str = "I") -> bytes:
        return struct.pack(f"<{form}", value)

    def write(home: Path) -> list[str]:
        packed = _packed(kind, 300)
        chunk = record(packed, op=b"\x05", compression=kind.encode(), size=number(100))
        index = record(bytes(12), op=b"\x04", ver=number(1), conn=number(0), count=number(1))
        about = {
            "topic": b"/p",
            "type": b"std_msgs/Float64",
            "md5sum": b"fdb28210bfa9d7c91146260178d9a584",
        }
        told = b"".join(
            struct.pack("<I", len(k) + 1 + len(v)) + k.encode() + b"=" + v
            for k, v in {**about, "message_definition": b"float64 data"}.items()
        )
        ends = record(told, op=b"\x07", conn=number(0), topic=b"/p")

        def head(at: int) -> bytes:
            return b"#ROSBAG V2.0\n" + record(
                b"",
                op=b"\x03",
                index_pos=number(at, "Q"),
                conn_count=number(1),
                chunk_count=number(1),
            )

        first = len(head(0))
        ends += record(
            bytes(4) + number(1), op=b"\x06", ver=number(1), chunk_pos=number(first, "Q"),
            start_time=bytes(8), end_time=bytes(8), count=number(1),
        )  # fmt: skip
        (home / "run.bag").write_bytes(head(first + len(chunk + index)) + chunk + index + ends)
        return ["import", str(home / "run.bag")]

    return write


def _bag2_bomb(mode: str) -> Writer:
    """A bag of ROS 2 whose message, or whose file, unpacks to more than is read."""

    def write(home: Path) -> list[str]:
        from rosbags.rosbag2 import Writer as BagWriter
        from rosbags.typesys import Stores, get_typestore

        store = get_typestore(Stores.ROS2_HUMBLE)
        kind = store.types["std_msgs/msg/Float64"].__msgtype__
        with BagWriter(home / "run", version=9) as bag:
            topic = bag.add_connection("/p", kind, typestore=store)
            bag.write(topic, 1, _packed("zstd", 300) if mode == "message" else bytes(12))
        about = home / "run" / "metadata.yaml"
        text = about.read_text(encoding="utf-8")
        text = re.sub("compression_format:.*", "compression_format: zstd", text)
        text = re.sub("compression_mode:.*", f"compression_mode: {mode}", text)
        if mode == "file":
            text = text.replace("run.db3", "run.db3.zstd")
            (home / "run" / "run.db3.zstd").write_bytes(_packed("zstd", 600))
        about.write_text(text, encoding="utf-8")
        return ["import", str(home / "run")]

    return write


def _linked(home: Path) -> list[str]:
    (home / "case.toml").symlink_to("other.toml")
    (home / "other.toml").symlink_to("case.toml")
    return ["diagnose", str(home)]


def _pipe(home: Path) -> list[str]:
    os.mkfifo(home / "run.csv")
    return ["import", str(home / "run.csv")]


def _system(home: Path) -> list[str]:
    (home / "run.csv").symlink_to("/proc/self/pagemap")
    return ["import", str(home / "run.csv")]


def _columns(count: int) -> str:
    head = ",".join(["time [s]", *(f"p{k}" for k in range(count))])
    return "\n".join([head, *(",".join([str(t), *["1"] * count]) for t in range(3))]) + "\n"


def _json_like(depth: int) -> str:
    return f"{SHOULDER}\n[effects_]\na = {'[' * depth}{']' * depth}\n"


def entries() -> Iterator[Entry]:
    """The corpus."""
    yield Entry("npy whose heading says 8 TB", _log("run.npy", _npy((10**12,))), "rows")
    yield Entry("npy that is cut short", _log("run.npy", _npy((10**6,))), "cut short")
    yield Entry("npy of shape -1", _log("run.npy", _npy((-1, 4))))
    yield Entry("npz bomb of 3.9 GB", _log("run.npz", _npz((500_000_000,))), "rows")
    yield Entry("npz of many arrays", _log("run.npz", _npz(*[(4_000_000,)] * 8)), "cells")
    yield Entry("HDF5 bomb of 3.9 GB", _hdf(_bomb), "rows")
    yield Entry("HDF5 groups in groups in groups", _hdf(_nested), "nested")
    yield Entry("HDF5 group that holds itself", _hdf(_round))
    yield Entry("HDF5 groups with a million paths", _hdf(_doubled))
    yield Entry("MATLAB bomb", _log("run.mat", _mat()), "cells")
    yield Entry("Parquet of too many rows", _arrow("parquet"), "rows")
    yield Entry("Feather of one packed batch", _arrow("feather"), "rows")
    for kind in ("zstd", "lz4"):
        for said in (300 << 20, 100):
            what = f"MCAP bomb, {kind}" + " that says 100 bytes" * (said == 100)
            yield Entry(what, _mcap_bomb(kind, said), "unpacks to more than")
    for kind in ("bz2", "lz4"):
        yield Entry(f"ROS 1 bag bomb, {kind}", _bag_bomb(kind), "unpacks to more than")
    for mode in ("message", "file"):
        yield Entry(f"ROS 2 bag bomb in a {mode}", _bag2_bomb(mode), "unpacks to more than")
    yield Entry("text of 100,000 columns", _log("run.csv", _columns(100_000).encode()), "columns")
    long = f'time [s],p\n0,"{"x" * 200_000}"\n1,2\n2,3\n3,4\n'
    yield Entry("a cell of 200 kB", _log("run.csv", long.encode()))
    digits = "time [s],p\n" + "".join(f"{k},1{'0' * 400}\n" for k in range(50))
    yield Entry("numbers of 400 digits", _log("run.csv", digits.encode()))
    powers = "time [s],p\n" + "".join(f"{k},1e{'9' * 50}\n" for k in range(50))
    yield Entry("absurd exponents", _log("run.csv", powers.encode()))
    far = "time [s],p\n" + "".join(
        f"{t},{k}\n" for k, t in enumerate([0, 1e-9, 2e-9, 1e300, 2e300])
    )
    yield Entry("a clock from 1e-9 to 1e300 s", _log("run.csv", far.encode()))
    forged = "time [s],p\x1b[2J\r\nfake: none\n" + "".join(f"{k},{k}\n" for k in range(50))
    yield Entry("headings with escapes", _log("run.csv", forged.encode()))
    yield Entry("quotes that do not end", _log("run.csv", b'time,"p\n' + b"1,2\n" * 1000))
    yield Entry("no text", _log("run.csv", bytes(range(256)) * 40))
    yield Entry("an empty file", _log("run.csv", b""))
    yield Entry("an empty npz", _log("run.npz", b""))
    for name in ("parquet", "feather", "mat", "h5", "mf4", "tdms", "bag", "mcap", "xlsx", "xls"):
        yield Entry(f"noise called {name}", _log(f"run.{name}", bytes(range(256)) * 8))
    for step in ("1e-9 s", "1e-300 s", "1e300 s", "1e999 s", "nan s"):
        bare = "p,q\n" + "".join(f"{k},{k}\n" for k in range(50))
        yield Entry(
            f"a sample time of {step}", _log("run.csv", bare.encode(), "--sample-time", step)
        )
    yield Entry("a key of 20,000 dots", _rig(f"{'a.' * 20_000}b = 1\n"), "nested")
    yield Entry("a key of 20,000 quoted dots", _rig('"a".' * 20_000 + "b = 1\n"), "nested")
    yield Entry("lists in lists", _rig(_json_like(40)), "nested")
    yield Entry("tables in tables", _rig("a = " + "{a=" * 40 + "1" + "}" * 40), "nested")
    yield Entry("lists in lists without end", _rig(_json_like(100_000)), "nested")
    for size in (400, 5000):
        yield Entry(f"a whole number of {size} digits", _rig(f"{SHOULDER}\nx = 1{'0' * size}\n"))
    yield Entry("a byte order mark", _rig(b"\xef\xbb\xbf" + SHOULDER.encode()), "shoulder")
    for value in ("1e999", "-1e999", "nan", "inf", f"1{'0' * 300}", "true", '"1"', "[1]", "{}"):
        text = "\n".join(
            f"payload = {{ value = {value}, unit = 'kg' }}" if line.startswith("payload") else line
            for line in SHOULDER.splitlines()
        )
        yield Entry(f"a payload of {value[:12]}", _rig(text))
    yield Entry("a rig of bytes", _rig(bytes(range(256))))
    yield Entry("5000 unknown keys", _rig("".join(f"k{k} = 1\n" for k in range(5000))))
    for key in ("sample_time", "start", "stop"):
        for value in ("1e-9", "1e-300", "1e300", "-1.0", "nan", "inf", f"1{'0' * 400}"):
            yield Entry(f"{key} = {value[:12]} in a case", _case(f"{key} = {value}"))
    yield Entry("markup as a name", _case("", head='name = "[/foo]"'))
    yield Entry("escapes as a name", _case("", head='name = "\\u001b[2J\\r\\nx"'))
    yield Entry("a name without end", _case(f'name = "{"x" * 1_000_000}"'))
    yield Entry(
        "a file outside", _case('role = "fit"\n[[recording]]\nfile = "/etc/passwd"'), "outside"
    )
    yield Entry("links in a circle", _linked)
    yield Entry("a pipe as a log", _pipe, "regular")
    yield Entry("a file of the system as a log", _system, "system")


def rig_for_fuzz() -> str:
    """The text of a rig whose values may be changed."""
    return rigs.template("shoulder", "shoulder", "coefficients")
