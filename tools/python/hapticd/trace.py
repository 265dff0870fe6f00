# SPDX-License-Identifier: Apache-2.0
"""Traces as arrays: the MCAP file that hapticd writes, read by the schemas in it (docs/traces.md)."""
from __future__ import annotations

import ctypes
import mmap
import re
import struct
import zlib
from typing import Any, Sequence

from .error import Error, optional_module

_MAGIC = b"\x89MCAP0\r\n"
_SCHEMA, _CHANNEL, _MESSAGE, _CHUNK, _ATTACHMENT, _METADATA, _DATA_END = 3, 4, 5, 6, 9, 12, 15
_MESSAGE_HEAD_BYTES = 22
_LARGEST_CHUNK = 64 << 20
_CDR_HEAD_BYTES = 4  # before the first field of a message; padding counts from there
_TOPICS = {"/hapticd/tick": "ticks", "/hapticd/model": "models", "/hapticd/directive": "directives",
           "/hapticd/additions": "additions", "/hapticd/frame_pose": "frame_poses", "/hapticd/event": "events"}
_NUMBERS = {"bool": "?", "int8": "b", "uint8": "B", "int16": "h", "uint16": "H", "int32": "i", "uint32": "I",
            "int64": "q", "uint64": "Q", "float32": "f", "float64": "d"}  # for struct and NumPy
_RECOVER = "'hapticctl trace recover FILE' saves what is intact"


class Table(dict[str, Any]):
    """The messages of one channel, oldest first: an array for each field, by its name in the trace.

    `time_s` is the time since the first tick. Numbers have the type of the trace and units at the end of their names, vectors
    the shape (messages, 3), enumerations and texts are `str`, and named texts, as the fields of an event, a `dict` each.
    """

    def __len__(self) -> int:
        """The number of messages."""
        return len(self["time_s"])

    def pandas(self) -> Any:
        """A pandas.DataFrame, with columns NAME_x, NAME_y, NAME_z for a vector."""
        columns = {}
        for name, values in self.items():
            parts = range(values.shape[1]) if values.ndim == 2 else []
            columns |= {f"{name}_{'xyz'[i] if len(parts) == 3 else i}": values[:, i] for i in parts} or {name: values}
        return optional_module("pandas", "python3-pandas", "Table.pandas()").DataFrame(columns)


class Trace:
    """A trace: a table for each channel, and what its writer says of itself."""

    metadata: dict[str, dict[str, str]]
    settings: str  # the configuration it was recorded with, as YAML
    ticks: Table  # of the force loop
    models: Table  # of depth frames
    directives: Table  # sets of parameters
    additions: Table  # fixtures and tissue regions, as YAML
    frame_poses: Table  # of moving frames
    events: Table  # of the journal

    def __init__(self, numpy: Any, content: memoryview, fields: Sequence[str] | None) -> None:
        self.metadata, self.settings = {}, ""
        self._schemas: dict[int, str] = {}
        self._layouts: dict[int, _Layout] = {}
        self._parts: dict[str, list[dict[str, Any]]] = {name: [] for name in _TOPICS.values()}
        self._read(numpy, _Reader(content, len(_MAGIC)), fields)
        start_ns = self._parts["ticks"][0]["stamp"][0] if self._parts["ticks"] else 0
        for table, parts in self._parts.items():
            columns = {field: numpy.concatenate([part[field] for part in parts]) for field in (parts[0] if parts else ())}
            stamp_ns = columns.pop("stamp", numpy.zeros(0, "i8"))
            setattr(self, table, Table(time_s=(stamp_ns - start_ns) / 1e9, **columns))
        del self._parts

    def _read(self, numpy: Any, records: _Reader, fields: Sequence[str] | None) -> None:
        """Takes the records of a file, as far as its data reach, or those of a chunk."""
        messages: dict[int, list[memoryview]] = {}
        while records.at < len(records.content) and (kind := records.number("B")) != _DATA_END:
            body = records.sized("Q")
            record = _Reader(body)
            if kind == _MESSAGE:
                messages.setdefault(record.number("H"), []).append(body[_MESSAGE_HEAD_BYTES:])
            elif kind == _CHUNK:
                self._read(numpy, _Reader(_unpacked(record)), fields)
            elif kind == _SCHEMA:
                number, _, _ = record.number("H"), record.text(), record.text()
                self._schemas[number] = record.text()
            elif kind == _CHANNEL:
                number, schema, topic = record.number("H"), record.number("H"), record.text()
                if topic in _TOPICS:
                    wanted = fields if topic == "/hapticd/tick" else None
                    self._layouts[number] = _Layout(numpy, _TOPICS[topic], self._schemas[schema], wanted)
            elif kind == _METADATA:
                name, pairs = record.text(), _Reader(record.sized())
                self.metadata[name] = {}
                while pairs.at < len(pairs.content):
                    key = pairs.text()
                    self.metadata[name][key] = pairs.text()
            elif kind == _ATTACHMENT:
                record.at = 16  # behind its times
                name, _, content = record.text(), record.text(), record.sized("Q")
                self.settings = bytes(content).decode() if name == "settings.yaml" else self.settings
        for channel in messages.keys() & self._layouts.keys():
            layout = self._layouts[channel]
            self._parts[layout.table].append(layout.columns(messages[channel]))


def read_trace(path: str, fields: Sequence[str] | None = None) -> Trace:
    """Reads a finished trace. `fields`: which fields of the ticks; None: all, about 800 bytes of memory for each tick. Depth and
    the picture for viewers are left out. Errors: the file is not a trace, is damaged, or is not finished."""
    numpy = optional_module("numpy", "python3-numpy", "read_trace()")
    try:
        with open(path, "rb") as file:
            content = memoryview(mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ))
        trace = Trace(numpy, content, fields) if content[:len(_MAGIC)] == _MAGIC else None
    except (OSError, ValueError) as error:
        what = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        raise Error(path, what, f"give a finished trace, NAME.mcap; {_RECOVER}") from error
    except (struct.error, IndexError, KeyError) as error:
        raise Error(path, "damaged, or not finished", _RECOVER) from error
    if trace is None or "hapticd_trace" not in trace.metadata:
        raise Error(path, "not a trace of hapticd", "give a trace, NAME.mcap")
    return trace


class _Reader:
    """Reads little-endian numbers, and texts with their length before them, as MCAP has them; `aligned`: as CDR has them."""

    def __init__(self, content: memoryview, at: int = 0, aligned: bool = False) -> None:
        self.content, self.at, self.aligned = content, at, aligned

    def number(self, form: str) -> Any:
        if self.aligned:
            self.at += -(self.at - _CDR_HEAD_BYTES) % struct.calcsize(form)
        (value,) = struct.unpack_from("<" + form, self.content, self.at)
        self.at += struct.calcsize("<" + form)
        return value

    def sized(self, form: str = "I") -> memoryview:
        size = self.number(form)
        self.at += size
        if self.at > len(self.content):
            raise IndexError
        return self.content[self.at - size:self.at]

    def text(self) -> str:
        return bytes(self.sized()).decode().rstrip("\0")


def _unpacked(chunk: _Reader) -> memoryview:
    """The records of a chunk."""
    _, _, size, crc = (chunk.number(form) for form in "QQQI")
    compression, records = chunk.text(), bytes(chunk.sized("Q"))
    if compression == "zstd" and size <= _LARGEST_CHUNK:
        zstd = ctypes.CDLL("libzstd.so.1")
        zstd.ZSTD_decompress.restype = ctypes.c_size_t
        zstd.ZSTD_decompress.argtypes = (ctypes.c_void_p, ctypes.c_size_t, ctypes.c_char_p, ctypes.c_size_t)
        buffer = ctypes.create_string_buffer(size)
        if zstd.ZSTD_decompress(buffer, size, records, len(records)) != size:
            raise ValueError("a chunk cannot be decompressed")
        records = buffer.raw
    elif compression:
        raise ValueError(f"a chunk of {size} bytes with compression {compression!r}; hapticd writes zstd and at most 64 MB")
    if crc and zlib.crc32(records) != crc:
        raise ValueError("the checksum of a chunk does not match")
    return memoryview(records)


class _Layout:
    """How the messages of a channel are laid out, by their ros2msg schema: CDR, little-endian, numbers aligned to their size."""

    def __init__(self, numpy: Any, table: str, schema: str, wanted: Sequence[str] | None) -> None:
        self.numpy, self.table, self.wanted = numpy, table, wanted
        self.fields: list[tuple[str, str, Any, int]] = []  # name; type: "" for numbers; their form, how many or 0 for a single one
        self.words: dict[str, Any] = {}  # of an enumeration, by number
        constants = {}
        for line in schema.split("\n==")[0].splitlines():
            if constant := re.fullmatch(r"uint8 (\w+)=(\d+)", line):
                constants[int(constant[2])] = constant[1]
            elif field := re.fullmatch(r"(\S+) (\w+)", line):
                kind, _, count = field[1].replace("builtin_interfaces/Time", "uint32[2]").partition("[")
                fixed = kind in _NUMBERS and count != "]"
                self.fields.append((field[2], "" if fixed else field[1], numpy.dtype(_NUMBERS.get(kind, "I")), int(count[:-1] or 0)))
                if constants:
                    words = [constants[n][len(field[2]) + 1:].lower() if n in constants else str(n) for n in range(256)]
                    self.words[field[2]], constants = numpy.array(words), {}

    def columns(self, messages: Sequence[memoryview]) -> dict[str, Any]:
        """An array for each field that is wanted (None: all), and `stamp` in ns."""
        if any(kind for _, kind, _, _ in self.fields):
            values = zip(*map(self._values, messages))
            columns = {name: self.numpy.array(column, object if kind else form)
                       for (name, kind, form, _), column in zip(self.fields, values)}
        else:
            row = self.numpy.dtype([(name, form, count) if count else (name, form) for name, _, form, count in self.fields], align=True)
            bodies = (bytes(message[_CDR_HEAD_BYTES:]).ljust(row.itemsize, b"\0") for message in messages)
            rows = self.numpy.frombuffer(b"".join(bodies), row)
            columns = {name: self.numpy.ascontiguousarray(rows[name]) for name in rows.dtype.names
                       if name == "stamp" or self.wanted is None or name in self.wanted}
        if missing := set(self.wanted or ()) - set(columns):
            raise Error("fields", f"ticks have no {', '.join(sorted(missing))}", "without fields read_trace() gives all of them")
        stamp = columns["stamp"].astype("i8")
        columns["stamp"] = stamp[:, 0] * 1_000_000_000 + stamp[:, 1]
        return {name: self.words[name][values] if name in self.words else values for name, values in columns.items()}

    def _values(self, message: memoryview) -> list[Any]:
        """The fields of a message that has texts in it."""
        reader, values = _Reader(message, _CDR_HEAD_BYTES, aligned=True), []
        for _, kind, form, count in self.fields:
            if not kind:
                numbers = [reader.number(form.char) for _ in range(count or 1)]
                values.append(numbers if count else numbers[0])
            elif kind == "string":
                values.append(reader.text())
            elif kind == "uint8[]":
                values.append(bytes(reader.sized()))
            else:  # hapticd_msgs/NamedText[]
                pairs = [(reader.text(), reader.text()) for _ in range(reader.number("I"))]
                values.append(dict(pairs))
        return values
