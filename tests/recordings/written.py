"""One simulated log, written by the libraries of every format: what the tests read back."""

from __future__ import annotations

import gzip
import json
import struct
import warnings
import zipfile
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import pamrs
from pamrs.recordings import Case, Proposal, load_case

Array = NDArray[np.float64]
SHOULDER = pamrs.rigs.shoulder()
N, DT = 400, 0.01
UNITS = {"u": "V", "p1": "bar", "angle": "deg"}
#: What goes into a case.toml for this log, whatever its format.
CHANNELS = {"valve_command": "u", "muscle_pressure": "p1", "joint_angle": "angle"}


def signals(seed: int = 5) -> dict[str, Array]:
    """Time [s], valve command [V], pressure [bar] and angle [deg] of a slow lift with noise."""
    rng = np.random.default_rng(seed)
    time = np.round(np.arange(N) * DT, 6)
    lift = np.sin(np.pi * time / time[-1]) ** 2
    return {
        "t": time,
        "u": np.round(5.0 + 2.0 * np.sin(2.0 * time), 6),
        "p1": np.round(3.0 * lift + rng.normal(0.0, 0.004, N), 6),
        "angle": np.round(20.0 + 60.0 * lift + rng.normal(0.0, 0.02, N), 6),
    }


def csv_text(data: dict[str, Array], mark: str, decimal: str, head: list[str]) -> str:
    rows = [
        mark.join(f"{value:.6f}".replace(".", decimal) for value in row)
        for row in zip(*data.values(), strict=True)
    ]
    return "\r\n".join([*head, *rows]) + "\r\n"


def write_excel(path: Path, data: dict[str, Array]) -> None:
    """German Excel: semicolons, decimal commas, a mark of byte order."""
    head = ["Zeit [s];u [V];p1 [bar];angle [°]"]
    path.write_bytes(csv_text(data, ";", ",", head).encode("utf-8-sig"))


def write_utf16(path: Path, data: dict[str, Array]) -> None:
    path.write_bytes(
        csv_text(data, "\t", ".", ["t (s)\tu (V)\tp1 (bar)\tangle (deg)"]).encode("utf-16")
    )


def write_gz(path: Path, data: dict[str, Array]) -> None:
    text = csv_text(data, ",", ".", ["# stand 3", "", "t,u,p1,angle", "s,V,bar,deg"])
    path.write_bytes(gzip.compress(text.encode()))


def write_labview(path: Path, data: dict[str, Array]) -> None:
    head = [
        "LabVIEW Measurement\t",
        "Writer_Version\t2",
        "Separator\tTab",
        "Date\t2024/05/12",
        "***End_of_Header***\t",
        "",
        "t\tu\tp1\tangle\t",
        "s\tV\tbar\t°\t",
    ]
    path.write_bytes(csv_text(data, "\t", ",", head).encode("cp1252"))


def write_frame(path: Path, data: dict[str, Array]) -> None:
    """Parquet or Feather, by the ending."""
    import pandas as pd

    getattr(pd.DataFrame(data), f"to_{path.suffix[1:]}")(path)


def write_npy(path: Path, data: dict[str, Array]) -> None:
    np.save(path, np.rec.fromarrays(list(data.values()), names=",".join(data)))


def write_mat(path: Path, data: dict[str, Array]) -> None:
    import scipy.io

    scipy.io.savemat(path, {"rig": data, "note": "12 May"})


def write_with_time(path: Path, data: dict[str, Array]) -> None:
    """A scope of Simulink that logs a structure with time."""
    import scipy.io

    listed = [{"values": data[name], "label": name, "dimensions": 1.0} for name in UNITS]
    scope = {"time": data["t"], "signals": listed, "blockName": "m/Scope"}
    scipy.io.savemat(path, {"scope": scope})


def write_controldesk(path: Path, data: dict[str, Array]) -> None:
    """A capture of dSPACE ControlDesk: clocks in X, measurements in Y."""
    import scipy.io

    record = np.zeros((1, 1), dtype=[("Name", "O"), ("Data", "O"), ("Unit", "O")])
    record[0, 0] = ("HostService", data["t"][None, :], "s")
    y = np.zeros((1, 3), dtype=[("Name", "O"), ("Data", "O"), ("Unit", "O"), ("XIndex", "O")])
    for index, (name, unit) in enumerate(UNITS.items()):
        y[0, index] = (f"Model Root/{name}", data[name][None, :], unit, 1.0)
    scipy.io.savemat(path, {"capture_001": {"X": record, "Y": y, "Capture": {"Length": 4.0}}})


def write_timeseries(path: Path, data: dict[str, Array], version: str = "v7.3") -> None:
    """Objects ``timeseries`` in the subsystem of the file, as MATLAB lays them out: even times are
    not stored but for their start, increment and length.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        from matio import save_to_mat
        from matio.utils.matclass import MatlabOpaque

    def column(values: Any) -> Array:
        return np.asarray(values, dtype=np.float64).reshape(-1, 1)

    def timeseries(name: str, even: bool) -> MatlabOpaque:
        about = {"Units": np.array(["seconds"]), "Start_": column(0.0), "Length": column(N)}
        about["Increment_"] = column(DT if even else np.nan)
        parts = {
            "Name": np.array([name]),
            "Data_": column(data[name]),
            "Time_": np.empty((0, 0)) if even else column(data["t"]),
            "TimeInfo": MatlabOpaque(about, "tsdata.timemetadata", "MCOS"),
            "DataInfo": MatlabOpaque(
                {"Units": np.array([UNITS[name]])}, "tsdata.datametadata", "MCOS"
            ),
        }
        return MatlabOpaque(parts, "timeseries", "MCOS")

    made = {name: timeseries(name, name == "u") for name in UNITS}
    save_to_mat(str(path), made, version=version)


def write_mat73(path: Path, data: dict[str, Array]) -> None:
    """Arrays and a struct of version 7.3: HDF5 with MATLAB's head of 512 bytes, axes reversed."""
    import h5py

    with h5py.File(path, "w", userblock_size=512) as file:
        group = file.create_group("rig")
        group.attrs["MATLAB_class"] = np.bytes_("struct")
        for name, values in data.items():
            item = group.create_dataset(name, data=values[None, :])
            item.attrs["MATLAB_class"] = np.bytes_("double")
    with path.open("r+b") as stream:
        stream.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM")


def write_hdf5(path: Path, data: dict[str, Array]) -> None:
    import h5py

    with h5py.File(path, "w") as file:
        group = file.create_group("daq")
        for name, values in data.items():
            group[name] = values
            group[name].attrs["units"] = UNITS.get(name, "s")


def write_mf4(path: Path, data: dict[str, Array]) -> None:
    from asammdf import MDF, Signal

    with MDF() as file:
        file.append([Signal(data[name], data["t"], unit=UNITS[name], name=name) for name in UNITS])
        file.save(path, overwrite=True)


def write_tdms(path: Path, data: dict[str, Array]) -> None:
    from nptdms import ChannelObject, TdmsWriter

    told = {
        "wf_increment": DT,
        "wf_start_offset": 0.0,
        "wf_start_time": np.datetime64("2024-05-12T10:00:00"),
    }
    channels = [
        ChannelObject("daq", name, data[name], properties=told | {"unit_string": unit})
        for name, unit in UNITS.items()
    ]
    with TdmsWriter(path) as writer:
        writer.write_segment(channels)


def messages(data: dict[str, Array]) -> Iterator[tuple[int, dict[str, float]]]:
    """Nanoseconds and numbers of each row."""
    for row, seconds in enumerate(data["t"]):
        nanos = 1_715_500_000 * 10**9 + round(seconds * 1e9)
        yield nanos, {name: float(data[name][row]) for name in UNITS}


def write_bag(path: Path, data: dict[str, Array]) -> None:
    """A bag of ROS 2 with one message of three numbers at each time."""
    from rosbags.rosbag2 import Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    joint = store.types["sensor_msgs/msg/JointState"]
    header = store.types["std_msgs/msg/Header"]
    stamp = store.types["builtin_interfaces/msg/Time"]
    empty = np.array([])
    with Writer(path, version=9) as writer:
        topic = writer.add_connection("/rig", joint.__msgtype__, typestore=store)
        for nanos, numbers in messages(data):
            head = header(stamp(nanos // 10**9, nanos % 10**9), "")
            values = np.array(list(numbers.values()))
            message = joint(head, list(UNITS), values, empty, empty)
            writer.write(topic, nanos, store.serialize_cdr(message, joint.__msgtype__))


def write_mcap(path: Path, data: dict[str, Array]) -> None:
    from mcap_ros2.writer import Writer

    with path.open("wb") as stream:
        writer = Writer(stream)
        schema = writer.register_msgdef("rig/msg/State", "\n".join(f"float64 {n}" for n in UNITS))
        for nanos, numbers in messages(data):
            writer.write_message("/rig", schema, numbers, log_time=nanos, publish_time=nanos)
        writer.finish()


def write_json_mcap(path: Path, data: dict[str, Array]) -> None:
    write_json_messages(path, "/rig", ((at, at, numbers) for at, numbers in messages(data)))


def write_json_messages(
    path: Path, topic: str, sent: Iterable[tuple[int, int, Any]], kind: str = "State"
) -> None:
    """An MCAP file of messages in JSON: when each was logged and published [ns], and what it is."""
    from mcap.writer import Writer

    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        schema = writer.register_schema(kind, "jsonschema", b"{}")
        channel = writer.register_channel(topic, "json", schema)
        for logged, published, body in sent:
            writer.add_message(channel, logged, json.dumps(body).encode(), published)
        writer.finish()


def write_protobuf_mcap(path: Path, data: dict[str, Array]) -> None:
    """A message type made here, with a stamp, nested numbers, and a repeated field."""
    from google.protobuf import descriptor_pb2, descriptor_pool, message_factory, timestamp_pb2
    from mcap_protobuf.writer import Writer

    file = descriptor_pb2.FileDescriptorProto(
        name="rig.proto",
        package="rig",
        syntax="proto3",
        dependency=["google/protobuf/timestamp.proto"],
    )
    kinds = descriptor_pb2.FieldDescriptorProto
    state = file.message_type.add(name="State")
    for number, name in enumerate(UNITS, 1):
        state.field.add(
            name=name, number=number, type=kinds.TYPE_DOUBLE, label=kinds.LABEL_OPTIONAL
        )
    state.field.add(
        name="stamp", number=90, type=kinds.TYPE_MESSAGE, label=kinds.LABEL_OPTIONAL,
        type_name=".google.protobuf.Timestamp",
    )  # fmt: skip
    state.field.add(name="spare", number=91, type=kinds.TYPE_DOUBLE, label=kinds.LABEL_REPEATED)
    pool = descriptor_pool.DescriptorPool()
    pool.AddSerializedFile(timestamp_pb2.DESCRIPTOR.serialized_pb)
    pool.Add(file)
    kind = message_factory.GetMessageClass(pool.FindMessageTypeByName("rig.State"))
    with path.open("wb") as stream, Writer(stream) as writer:
        for nanos, numbers in messages(data):
            message = kind(**numbers, spare=[1.0, 2.0])
            message.stamp.seconds, message.stamp.nanos = divmod(nanos, 10**9)
            writer.write_message("/rig", message, log_time=nanos, publish_time=nanos)


def _sheet(data: dict[str, Array]) -> list[list[Any]]:
    above = [["Stand 3", "12 May"], [], ["t [s]", "u [V]", "p1 [bar]", "angle [deg]"]]
    return [*above, *map(list, zip(*data.values(), strict=True))]


def write_xlsx(path: Path, data: dict[str, Array]) -> None:
    """A workbook of one sheet with a title above its table."""
    write_workbook(path, _sheet(data))


def write_workbook(path: Path, *tables: list[list[Any]], names: Sequence[str] = ("Run",)) -> None:
    """A workbook of some sheets, with as little as Excel needs."""
    main = "http://schemas.openxmlformats.org/spreadsheetml/2006/main"
    office = "http://schemas.openxmlformats.org/officeDocument/2006/relationships"
    package = "http://schemas.openxmlformats.org/package/2006"
    places = range(1, len(tables) + 1)
    sheets = "".join(
        f'<sheet name="{name}" sheetId="{i}" r:id="r{i}"/>'
        for i, name in zip(places, names, strict=True)
    )
    links = "".join(
        f'<Relationship Id="r{i}" Type="{office}/worksheet" Target="worksheets/sheet{i}.xml"/>'
        for i in places
    )
    parts = {
        "[Content_Types].xml": f'<Types xmlns="{package}/content-types"/>',
        "_rels/.rels": f'<Relationships xmlns="{package}/relationships"><Relationship Id="r1" '
        f'Type="{office}/officeDocument" Target="xl/workbook.xml"/></Relationships>',
        "xl/workbook.xml": f'<workbook xmlns="{main}" xmlns:r="{office}"><sheets>{sheets}'
        "</sheets></workbook>",
        "xl/_rels/workbook.xml.rels": f'<Relationships xmlns="{package}/relationships">{links}'
        "</Relationships>",
    }
    for i, table in zip(places, tables, strict=True):
        parts[f"xl/worksheets/sheet{i}.xml"] = (
            f'<worksheet xmlns="{main}"><sheetData>{_rows(table)}</sheetData></worksheet>'
        )
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as packed:
        for name, text in parts.items():
            packed.writestr(name, text)


def _rows(table: list[list[Any]]) -> str:
    rows = []
    for number, row in enumerate(table, start=1):
        cells = [
            f'<c r="{chr(65 + place)}{number}" t="inlineStr"><is><t>{cell}</t></is></c>'
            if isinstance(cell, str)
            else f'<c r="{chr(65 + place)}{number}"><v>{float(cell)!r}</v></c>'
            for place, cell in enumerate(row)
        ]
        rows.append(f'<row r="{number}">{"".join(cells)}</row>')
    return "".join(rows)


def write_xls(path: Path, data: dict[str, Array]) -> None:
    """The same as Excel 97 writes it: records in a stream of a compound file."""

    def record(kind: int, body: bytes) -> bytes:
        return struct.pack("<HH", kind, len(body)) + body

    def begin(kind: int) -> bytes:
        return record(0x809, struct.pack("<HHHHII", 0x600, kind, 0, 0, 0, 0))

    cells = b""
    for number, row in enumerate(_sheet(data)):
        for place, cell in enumerate(row):
            at = struct.pack("<HHH", number, place, 0)
            if isinstance(cell, str):
                cells += record(0x204, at + struct.pack("<HB", len(cell), 0) + cell.encode())
            else:
                cells += record(0x203, at + struct.pack("<d", cell))
    end, name = record(0x0A, b""), b"Run"
    sheet = struct.pack("<IBBBB", len(begin(5)) + 4 + 8 + len(name) + 4, 0, 0, len(name), 0) + name
    book = begin(5) + record(0x85, sheet) + end + begin(0x10) + cells + end
    blocks = -(-max(len(book), 4096) // 512)
    follow = [*range(1, blocks), 0xFFFFFFFE, 0xFFFFFFFE, 0xFFFFFFFD]  # the book, the folder, this
    follow += [0xFFFFFFFF] * (128 - len(follow))

    def entry(title: str, kind: int, child: int, first: int, size: int) -> bytes:
        text = title.encode("utf-16-le")
        return struct.pack(
            "<64sHBBIII36xIII", text, len(text) + 2, kind, 1, 2**32 - 1, 2**32 - 1, child,
            first, size, 0,
        )  # fmt: skip

    folder = entry("Root Entry", 5, 1, 0xFFFFFFFE, 0)
    folder += entry("Workbook", 2, 2**32 - 1, 0, blocks * 512)
    head = bytes.fromhex("d0cf11e0a1b11ae1") + bytes(16)
    head += struct.pack("<HHHHH6xIIIIIIIII", 0x3E, 3, 0xFFFE, 9, 6, 0, 1, blocks, 0, 4096,
                        0xFFFFFFFE, 0, 0xFFFFFFFE, 0)  # fmt: skip
    head += struct.pack("<109I", blocks + 1, *[0xFFFFFFFF] * 108)
    body = book.ljust(blocks * 512, b"\0") + folder.ljust(512, b"\0")
    path.write_bytes(head + body + struct.pack("<128I", *follow))


#: Name of the file, who writes it, where its channels are, its times.
FORMATS: dict[str, tuple[str, Callable[[Path, dict[str, Array]], None], str, Any]] = {
    "excel": ("run.csv", write_excel, "{}", "Zeit"),
    "utf16": ("run.txt", write_utf16, "{}", "t"),
    "gz": ("run.csv.gz", write_gz, "{}", "t"),
    "labview": ("run.lvm", write_labview, "{}", "t"),
    "parquet": ("run.parquet", write_frame, "{}", "t"),
    "feather": ("run.feather", write_frame, "{}", "t"),
    "npz": ("run.npz", lambda path, data: np.savez(path, **data), "{}", "t"),
    "npy": ("run.npy", write_npy, "{}", "t"),
    "mat": ("run.mat", write_mat, "rig/{}", "rig/t"),
    "structure with time": ("run.mat", write_with_time, "scope/{}", None),
    "ControlDesk": ("run.mat", write_controldesk, "{}", None),
    "timeseries": ("run.mat", write_timeseries, "{}", None),
    "timeseries 7": ("run.mat", lambda p, d: write_timeseries(p, d, "v7"), "{}", None),
    "mat 7.3": ("run.mat", write_mat73, "rig/{}", "t"),
    "hdf5": ("run.h5", write_hdf5, "daq/{}", "daq/t"),
    "mf4": ("run.mf4", write_mf4, "{}", None),
    "tdms": ("run.tdms", write_tdms, "daq/{}", None),
    "xlsx": ("run.xlsx", write_xlsx, "{}", "t"),
    "xls": ("run.xls", write_xls, "{}", "t"),
    "bag": ("run_bag", write_bag, "/rig/position[{}]", None),
    "mcap": ("run.mcap", write_mcap, "/rig/{}", None),
    "json mcap": ("run.mcap", write_json_mcap, "/rig/{}", None),
    "protobuf mcap": ("run.mcap", write_protobuf_mcap, "/rig/{}", None),
}


def mapping(pattern: str) -> dict[str, dict[str, Any]]:
    """The table ``channels`` of this log."""
    return {
        channel: {"column": pattern.format(name), "unit": UNITS[name]}
        for channel, name in CHANNELS.items()
    }


def written(folder: Path, kind: str, data: dict[str, Array] | None = None) -> tuple[Path, str, Any]:
    """The log in one format: file, where its channels are, its times."""
    name, write, pattern, time = FORMATS[kind]
    write(folder / name, signals() if data is None else data)
    return folder / name, pattern, time


def write_table(file: Path, columns: Mapping[str, Sequence[object]], mark: str = ";") -> Path:
    """A text of columns by their headings; numbers have seven digits."""
    rows = ([f"{x:.7g}" if isinstance(x, float) else str(x) for x in row]
            for row in zip(*columns.values(), strict=True))  # fmt: skip
    file.write_text("\n".join(map(mark.join, [list(columns), *rows])) + "\n", encoding="utf-8")
    return file


def npz(folder: Path, **series: Any) -> Path:
    """A file of arrays by their names."""
    arrays = {name: np.asarray(values, dtype=float) for name, values in series.items()}
    np.savez(folder / "run.npz", **arrays)
    return folder / "run.npz"


def case_of(home: Path, toml: str | Proposal, rig: pamrs.Rig = SHOULDER) -> Case:
    """The case of a description, or of what is proposed for logs, with its rig beside it."""
    rig.to_toml(home / "rig.toml")
    text = toml if isinstance(toml, str) else toml.case_toml(home)
    (home / "case.toml").write_text(text, encoding="utf-8")
    return load_case(home, allow_outside=True)
