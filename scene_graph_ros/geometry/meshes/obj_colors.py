"""Which material each triangle of a Wavefront OBJ file has, and the colours of MTL files."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.errors import MeshError
from scene_graph_ros.geometry.meshes.obj_file import obj_lines
from scene_graph_ros.geometry.quoting import quoted

__all__ = ["Uses", "obj_materials", "parse_mtl"]

Color = tuple[float, float, float]


class Uses(NamedTuple):
    """What an OBJ file says of materials."""

    libraries: list[str]
    """The names of MTL files, as they stand behind ``mtllib``: a name may have blanks in it."""
    materials: list[str]
    """Names of materials, each once."""
    row: NDArray[np.int32]
    """(m,) into ``materials``: that of each triangle, -1 for those before the first."""


def _statements(contents: bytes, keys: tuple[bytes, ...]) -> Iterator[tuple[int, bytes, bytes]]:
    """Yield (line number, key, the rest of the line) of the lines that begin with a key."""
    for number, line in enumerate(obj_lines(contents), start=1):
        key, _, rest = line.split(b"#", 1)[0].strip().replace(b"\t", b" ").partition(b" ")
        if key in keys:
            yield number, key, rest.strip()


def obj_materials(contents: bytes) -> Uses:
    """Return the materials of the triangles, in the order in which ``parse_obj`` has these."""
    libraries: list[str] = []
    numbers: dict[str, int] = {}
    used, counts = [-1], [0]
    for _, key, rest in _statements(contents, (b"f", b"usemtl", b"mtllib")):
        if key == b"f":
            counts[-1] += len(rest.split()) - 2
        elif key == b"mtllib":
            libraries.append(rest.decode(errors="replace"))
        else:
            name = rest.decode(errors="replace")
            used.append(numbers.setdefault(name, len(numbers)))
            counts.append(0)
    return Uses(libraries, list(numbers), np.repeat(np.array(used, np.int32), counts))


def parse_mtl(contents: bytes, name: str) -> dict[str, Color]:
    """Return the diffuse colours (``Kd``) of a file's materials; those without have none.

    Raises MeshError, with file and line, for what is not one or three numbers from 0 to 1.
    """
    colors: dict[str, Color] = {}
    material = None
    for number, key, rest in _statements(contents, (b"newmtl", b"Kd")):
        if key == b"newmtl":
            material = rest.decode(errors="replace")
        elif material is not None:
            try:
                colors[material] = _color(rest.split())
            except ValueError as error:
                text = quoted(rest.decode(errors="replace"))
                raise MeshError(f"{name}: line {number}: Kd {text}: {error}") from error
    return colors


def _color(words: list[bytes]) -> Color:
    if len(words) not in (1, 3):
        raise ValueError("a colour has one or three numbers")
    shares = [float(word) for word in words]
    if not all(0.0 <= share <= 1.0 for share in shares):
        raise ValueError("must be from 0 to 1")
    red, green, blue = shares * 3 if len(shares) == 1 else shares
    return red, green, blue
