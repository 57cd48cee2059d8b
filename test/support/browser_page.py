"""A page in Python: connects to the view in a browser, and keeps what it is told."""

from __future__ import annotations

from collections.abc import Callable
import contextlib
import io
import json
import struct
from typing import Any

import numpy as np
from PIL import Image
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect

__all__ = ["PageClient", "read_blocks"]

DEADLINE = 60.0
"""Seconds after which a test gives up waiting: far more than anything takes on a busy machine."""

TIME, SCENE, MESH, POSES, VERTICES, CONTACTS, SURFACES, PICTURE, SLIDERS, TROUBLES = range(1, 11)
TEXTURE, MOTION, PLAN = 11, 12, 13


def read_blocks(message: bytes) -> list[tuple[int, Any]]:
    """Return kind and content of each block, read as the layout is documented."""
    blocks, place = [], 0
    while place < len(message):
        kind, length = struct.unpack_from("<II", message, place)
        assert length % 8 == 0
        blocks.append((kind, _READERS[kind](message[place + 8 : place + 8 + length])))
        place += 8 + length
    assert place == len(message)
    return blocks


def _arrays(data: bytes, place: int, *parts: tuple[str, int, int]) -> list[Any]:
    result = []
    for dtype, rows, width in parts:
        array = np.frombuffer(data, dtype, rows * width, place)
        place += array.nbytes
        result.append(array.reshape(rows, width) if width > 1 else array)
    return result


def _mesh(data: bytes) -> Any:
    number, v, t, p, c, r, _ = struct.unpack_from("<dIIIIII", data)
    assert {p, c, r} <= {0, t}
    parts = ("<f4", v, 3), ("<u4", t, 3), ("u1", p, 4), ("<u4", c, 1), ("<f4", c, 6), ("<f4", r, 9)
    return number, *_arrays(data, 32, *parts)


def _texture(data: bytes) -> Any:
    number, count, _ = struct.unpack_from("<dII", data)
    with Image.open(io.BytesIO(data[16 : 16 + count])) as picture:
        return number, np.asarray(picture.convert("RGBA"))


def _poses(data: bytes) -> Any:
    (n,) = struct.unpack_from("<I", data)
    numbers, positions, rotations = _arrays(data, 8, ("<f8", n, 1), ("<f8", n, 3), ("<f4", n, 4))
    return dict(zip(numbers.tolist(), zip(positions, rotations, strict=True), strict=True))


def _vertices(data: bytes) -> Any:
    v, _, number, x, y, z = struct.unpack_from("<IIdddd", data)
    (offsets,) = _arrays(data, 40, ("<f4", v, 3))
    return number, np.array((x, y, z)) + offsets


def _contacts(data: bytes) -> Any:
    (n,) = struct.unpack_from("<I", data)
    return _arrays(data, 8, ("<f8", n, 3), ("<f8", n, 2), ("<f4", n, 3), ("<f4", n, 1))


def _surfaces(data: bytes) -> Any:
    n, _, scale, x, y, z = struct.unpack_from("<IIdddd", data)
    offsets, pressures = _arrays(data, 40, ("<f4", n, 3), ("<f4", n, 1))
    return scale, np.array((x, y, z)) + offsets, pressures


def _picture(data: bytes) -> bytes:
    (n,) = struct.unpack_from("<I", data)
    return data[8 : 8 + n]


def _moving(data: bytes) -> Any:
    n, k = struct.unpack_from("<II", data)
    parts = ("<f8", n, 1), ("<f8", k * n, 3), ("<f4", k * n, 4)
    ids, positions, rotations = _arrays(data, 8, *parts)
    told = json.loads(data[8 + 8 * n + 40 * k * n :])
    bodies = {
        int(i): (positions.reshape(k, n, 3)[:, row], rotations.reshape(k, n, 4)[:, row])
        for row, i in enumerate(ids)
    }
    return told, bodies


_READERS: dict[int, Callable[[bytes], Any]] = {
    TIME: lambda data: struct.unpack("<ddd", data),
    SCENE: json.loads,
    MESH: _mesh,
    POSES: _poses,
    VERTICES: _vertices,
    CONTACTS: _contacts,
    SURFACES: _surfaces,
    PICTURE: _picture,
    SLIDERS: json.loads,
    TROUBLES: json.loads,
    TEXTURE: _texture,
    MOTION: _moving,
    PLAN: _moving,
}


_KEPT = {
    CONTACTS: "contacts",
    SURFACES: "surfaces",
    PICTURE: "picture",
    SLIDERS: "sliders",
    TROUBLES: "troubles",
}
"""Where the content of a block is kept as it is."""


class PageClient:
    """What a page knows after the messages that it took."""

    def __init__(self, address: str, *, query: str = "", **options: Any) -> None:
        """Connect to the view at ``http://host:port/``; options are those of `connect`."""
        # With a bound on its queue it would not see the end behind messages that nobody takes.
        limits = {"max_size": None, "max_queue": None, "open_timeout": DEADLINE}
        options = {"proxy": None, **limits, **options}
        self._connected = contextlib.ExitStack()
        self.socket: ClientConnection = self._connected.enter_context(
            connect(f"ws{address.removeprefix('http')}scene{query}", **options)
        )
        self.forget()

    def forget(self) -> None:
        """Know nothing again."""
        self.time: tuple[float, float, float] | None = None
        self.items: dict[int, dict[str, Any]] = {}
        self.poses: dict[int, Any] = {}
        self.meshes: dict[int, Any] = {}
        self.textures: dict[int, Any] = {}
        self.vertices: dict[int, Any] = {}
        self.contacts: Any = None
        self.surfaces: Any = None
        self.picture: bytes | None = None
        self.sliders: dict[str, Any] | None = None
        self.motion: dict[str, Any] = {}
        self.ghost: dict[int, Any] = {}
        self.plan: dict[str, Any] = {"plan": 0}
        self.played: dict[int, Any] = {}
        self.troubles: list[dict[str, str]] = []
        self.scenes: list[dict[str, Any]] = []
        self.messages = 0

    def wish(
        self, roles: list[str] | None = None, *, contacts: bool = False, camera: str = ""
    ) -> None:
        """Ask to be shown something else."""
        self.socket.send(json.dumps({"roles": roles, "contacts": contacts, "camera": camera}))

    def move(self, robot: str, joint: str, position: Any) -> None:
        """Ask that a joint moves."""
        self.socket.send(json.dumps({"robot": robot, "joint": joint, "position": position}))

    def ask(self, motion: str, **fields: Any) -> None:
        """Ask for something about a robot's motion."""
        self.socket.send(json.dumps({"motion": motion, **fields}))

    def take(self) -> None:
        """Wait for the next message and take it."""
        message = self.socket.recv(timeout=DEADLINE)
        assert isinstance(message, bytes)
        self.learn(message)

    def learn(self, message: bytes) -> None:
        """Take a message."""
        blocks = read_blocks(message)
        if any(kind == SCENE and content["begins"] for kind, content in blocks):
            self.items, self.poses, self.meshes, self.vertices = {}, {}, {}, {}
            self.textures = {}
        self.messages += 1
        self.contacts = self.surfaces = None
        for kind, content in blocks:
            if kind == TIME:
                self.time = content
            elif kind == SCENE:
                self._scene(content)
            elif kind in (MESH, TEXTURE):
                {MESH: self.meshes, TEXTURE: self.textures}[kind][content[0]] = content[1:]
            elif kind == POSES:
                assert content.keys() <= self.items.keys()
                self.poses.update(content)
            elif kind == VERTICES:
                self.vertices[content[0]] = content[1]
            elif kind == MOTION:
                self.motion, self.ghost = content
            elif kind == PLAN:
                self.plan, self.played = content
            else:
                setattr(self, _KEPT[kind], content)

    def _scene(self, content: dict[str, Any]) -> None:
        self.scenes.append(content)
        for number in content["vanished"]:
            del self.items[number]
        for number in content["meshes_gone"]:
            del self.meshes[number]
        for number in content["textures_gone"]:
            del self.textures[number]
        self.items.update((entry["number"], entry) for entry in content["appeared"])
        assert {e["mesh"] for e in self.items.values() if "mesh" in e} == self.meshes.keys()

    def take_until(self, condition: Callable[[], Any]) -> Any:
        """Take messages until a condition holds, and return what it is."""
        while not (result := condition()):
            self.take()
        return result

    def named(self, name: str, role: str | None = None) -> dict[str, Any] | None:
        """Return the item called so, None where there is none."""
        found = [
            item
            for item in self.items.values()
            if item["path"][3] == name and role in (None, item["path"][0])
        ]
        assert len(found) <= 1
        return found[0] if found else None

    def position(self, name: str) -> list[float] | None:
        """Return where the item called so is, None where there is none or it has no pose."""
        item = self.named(name)
        pose = None if item is None else self.poses.get(item["number"])
        return None if pose is None else pose[0].tolist()

    def wait_closed(self) -> tuple[int | None, str]:
        """Take messages until the other side ends the connection; return its code and reason."""
        try:
            while True:
                self.socket.recv(timeout=DEADLINE)
        except ConnectionClosed as closed:
            received = closed.rcvd
            return (None, "") if received is None else (received.code, received.reason)

    def close(self) -> None:
        """Leave."""
        with contextlib.suppress(ConnectionClosed):
            self._connected.close()
