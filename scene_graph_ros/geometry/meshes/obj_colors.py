"""Which material each triangle of a Wavefront OBJ file has, and the materials of MTL files."""

from __future__ import annotations

from collections.abc import Iterator
import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.errors import MeshError
from scene_graph_ros.geometry.meshes.file_pictures import FilePicture
from scene_graph_ros.geometry.meshes.obj_file import obj_lines
from scene_graph_ros.geometry.quoting import quoted

__all__ = ["MtlMaterial", "Uses", "obj_materials", "parse_mtl"]

Color = tuple[float, float, float]


class Uses(NamedTuple):
    """An OBJ file's uses of materials."""

    libraries: list[str]
    """The names of MTL files, as they stand behind ``mtllib``: a name may have blanks in it."""
    materials: list[str]
    """Names of materials, each once."""
    row: NDArray[np.int32]
    """(m,) into ``materials``: that of each triangle, -1 for those before the first."""


class MtlMaterial(NamedTuple):
    """A material's colour in an MTL file."""

    color: Color | None = None
    """``Kd``."""
    picture: FilePicture | None = None
    """``map_Kd``."""


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


def parse_mtl(contents: bytes, name: str) -> dict[str, MtlMaterial]:
    """Return the materials of a file by name, with colour (``Kd``) and picture (``map_Kd``).

    Raises MeshError, with file and line, for a colour that is not one or three numbers from 0 to
    1, and for a picture without a file or with options that are no numbers.
    """
    materials: dict[str, MtlMaterial] = {}
    material = None
    for number, key, rest in _statements(contents, (b"newmtl", b"Kd", b"map_Kd")):
        text = rest.decode(errors="replace")
        if key == b"newmtl":
            material = text
            materials.setdefault(material, MtlMaterial())
        elif material is not None:
            try:
                if key == b"Kd":
                    told = materials[material]._replace(color=_color(text.split()))
                else:
                    told = materials[material]._replace(picture=_picture(text))
            except ValueError as error:
                where = f"{name}: line {number}: {key.decode()} {quoted(text)}"
                raise MeshError(f"{where}: {error}") from error
            materials[material] = told
    return materials


def _color(words: list[str]) -> Color:
    if len(words) not in (1, 3):
        raise ValueError("a colour has one or three numbers")
    shares = [float(word) for word in words]
    if not all(0.0 <= share <= 1.0 for share in shares):
        raise ValueError("must be from 0 to 1")
    red, green, blue = shares * 3 if len(shares) == 1 else shares
    return red, green, blue


_MOST_WORDS = {"-s": 3, "-o": 3, "-t": 3, "-mm": 2}
"""Behind an option; behind another there is one."""


def _picture(text: str) -> FilePicture:
    """Read options and a file's name, which may have blanks in it; -o and -s place the picture."""
    placed = {"-o": (0.0, 0.0), "-s": (1.0, 1.0)}
    while text.startswith("-"):
        option, _, text = text.partition(" ")
        text = text.lstrip()
        numbers: list[float] = []
        for k in range(_MOST_WORDS.get(option, 1)):
            word, _, rest = text.partition(" ")
            number = _number(word)
            # One to three numbers stand behind an option of three; the file's name is no number.
            if k > 0 and number is None:
                break
            numbers.append(0.0 if number is None else number)
            text = rest.lstrip()
            if option in placed and number is None:
                raise ValueError(f"a number is missing behind {option}")
        if option in placed:
            placed[option] = (numbers[0], numbers[1] if len(numbers) > 1 else placed[option][1])
    if not text:
        raise ValueError("names no file")
    (u, v), (s, t) = placed["-o"], placed["-s"]
    return FilePicture(text, placement=((s, 0.0, u), (0.0, t, v)))


def _number(word: str) -> float | None:
    try:
        value = float(word)
    except ValueError:
        return None
    return value if math.isfinite(value) else None
