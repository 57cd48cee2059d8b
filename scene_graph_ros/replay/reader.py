"""Messages of a recording in the order of the file, as far as it is whole.

The file is read from its beginning and needs no index, so that one left by a kill or a full disk
can be read, too. Format: the MCAP specification, https://mcap.dev/spec.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
import struct
import sys
from typing import Any, BinaryIO, NamedTuple

if sys.version_info >= (3, 14):
    from compression import zstd
else:
    from backports import zstd

from scene_graph_ros.replay.layouts import check_layout

__all__ = ["Recorded", "RecordingError", "RecordingReader"]

_MAGIC = b"\x89MCAP0\r\n"
_HEAD = struct.Struct("<BQ")
_U16, _U32, _U64 = struct.Struct("<H"), struct.Struct("<I"), struct.Struct("<Q")
_MESSAGE = struct.Struct("<HIQQ")
_SCHEMA_RECORD, _CHANNEL_RECORD, _MESSAGE_RECORD, _CHUNK_RECORD, _DATA_END = 3, 4, 5, 6, 15
_CHUNK_HEAD = 8 + 8 + 8 + 4
_MOST_BYTES = 1 << 28
"""Of a record of the file, and of an unpacked chunk: 256 MiB. Messages have 64 MiB at most."""


class RecordingError(ValueError):
    """A file is no recording, or can't be read; names the file and the fault."""


class Recorded(NamedTuple):
    """A message: ``qos`` is the profile that the node offered, "" for its inputs."""

    topic: str
    kind: str
    qos: str
    time: int
    data: bytes


class RecordingReader:
    """Reads one recording; iterate over it for its messages."""

    def __init__(self, folder: Path) -> None:
        """Find the file. Raises RecordingError where ``folder`` is no recording."""
        if not folder.is_dir():
            raise RecordingError(f"{folder}: no folder; a recording is one, with an .mcap file")
        files = sorted(folder.glob("*.mcap"))
        if len(files) != 1:
            raise RecordingError(f"{folder}: has {len(files)} .mcap files, a recording has one")
        self.path = files[0]
        self.size = self.path.stat().st_size
        self.is_complete = False
        self.position = 0
        self._kinds: dict[int, str] = {}
        self._channels: dict[int, tuple[str, str, str]] = {}

    def __iter__(self) -> Iterator[Recorded]:
        """Yield all messages that are whole.

        Raises RecordingError for a file that is not MCAP, and where messages of this project's
        types have other fields than those that are installed.
        """
        with self.path.open("rb") as file:
            if file.read(len(_MAGIC)) != _MAGIC:
                raise RecordingError(f"{self.path}: is no MCAP file")
            for code, content in self._records(file):
                if code == _DATA_END:
                    file.seek(max(file.tell(), self.size - len(_MAGIC)))
                    self.is_complete = file.read(len(_MAGIC)) == _MAGIC
                    self.position = self.size
                    return
                self.position = file.tell()
                yield from self._messages(code, content)

    def _records(self, file: BinaryIO) -> Iterator[tuple[int, bytes]]:
        """Yield codes and contents, to the end of the last that is whole."""
        while len(head := file.read(_HEAD.size)) == _HEAD.size:
            code, length = _HEAD.unpack(head)
            if length > self.size - file.tell():
                return
            if length > _MOST_BYTES:
                raise RecordingError(
                    f"{self.path}: a record of {length} bytes; at most {_MOST_BYTES} are read"
                )
            yield code, file.read(length)

    def _messages(self, code: int, content: bytes) -> Iterator[Recorded]:
        try:
            if code == _CHUNK_RECORD:
                for inner, part in _parts(_unpacked(content)):
                    yield from self._message(inner, part)
            else:
                yield from self._message(code, content)
        except (KeyError, UnicodeDecodeError, struct.error, zstd.ZstdError) as error:
            raise RecordingError(
                f"{self.path}: damaged before byte {self.position}: {error!r}"
            ) from error

    def _message(self, code: int, content: bytes) -> Iterator[Recorded]:
        if code == _SCHEMA_RECORD:
            self._kinds[_U16.unpack_from(content)[0]] = self._kind(content)
        elif code == _CHANNEL_RECORD:
            number, schema = struct.unpack_from("<HH", content)
            topic, offset = _text(content, 4)
            _, offset = _text(content, offset)
            qos = _map(content, offset).get("offered_qos_profiles", "")
            self._channels[number] = (topic, self._kinds[schema], "" if qos == "[]" else qos)
        elif code == _MESSAGE_RECORD:
            number, _, time, _ = _MESSAGE.unpack_from(content)
            yield Recorded(*self._channels[number], time, content[_MESSAGE.size :])

    def _kind(self, schema: bytes) -> str:
        """Return the type that a schema describes, if the installed one reads its messages."""
        kind, offset = _text(schema, 2)
        _, offset = _text(schema, offset)
        definition, _ = _text(schema, offset)
        try:
            check_layout(kind, definition)
        except ValueError as error:
            raise RecordingError(f"{self.path}: {error}") from error
        return kind


def _unpacked(chunk: bytes) -> bytes:
    """Return the records of a chunk. Raises struct.error where it is none."""
    compression, offset = _text(chunk, _CHUNK_HEAD)
    length = _U64.unpack_from(chunk, offset)[0]
    packed = chunk[offset + 8 : offset + 8 + length]
    if compression == "":
        return packed
    if compression == "zstd":
        # A hundred kilobytes may unpack to gigabytes: no more is unpacked than is taken.
        records = zstd.ZstdDecompressor().decompress(packed, _MOST_BYTES + 1)
        if len(records) > _MOST_BYTES:
            raise struct.error(f"a chunk unpacks to more than {_MOST_BYTES} bytes")
        return records
    raise struct.error(f"compression {compression!r} is not one that the node writes")


def _parts(records: bytes) -> Iterator[tuple[int, bytes]]:
    offset = 0
    while offset < len(records):
        code, length = _HEAD.unpack_from(records, offset)
        offset += _HEAD.size
        if length > len(records) - offset:
            raise struct.error(f"a record of {length} bytes is cut off")
        yield code, records[offset : offset + length]
        offset += length


def _text(data: bytes, offset: int) -> tuple[str, int]:
    """Return a text and where it ends."""
    length = _U32.unpack_from(data, offset)[0]
    begin = offset + 4
    if length > len(data) - begin:
        raise struct.error(f"a text of {length} bytes is cut off")
    return data[begin : begin + length].decode(), begin + length


def _map(data: bytes, offset: int) -> dict[str, Any]:
    length = _U32.unpack_from(data, offset)[0]
    found, offset = {}, offset + 4
    end = offset + length
    while offset < end:
        key, offset = _text(data, offset)
        found[key], offset = _text(data, offset)
    return found
