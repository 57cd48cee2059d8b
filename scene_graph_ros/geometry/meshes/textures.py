"""Pictures that surfaces are covered with: PNG and JPEG files, read by Pillow when one is named.

Pictures are kept by path, so that a hundred geometries share one picture, and a file that goes
away later takes nothing from a scene. A file that has changed is read again when it is named
again.
"""

from __future__ import annotations

import hashlib
import io
import os
from pathlib import Path
from typing import Any, NamedTuple
import warnings

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.errors import MeshError
from scene_graph_ros.geometry.files import FileMark, find_file, MAX_MESH_BYTES, read_marked
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.missing_package import not_installed

__all__ = [
    "MAX_TEXELS",
    "PictureFile",
    "Texture",
    "known_texture",
    "picture_texture",
    "place_of",
    "read_texture",
]

MAX_TEXELS = 2**26
"""Of one picture, 8192 x 8192; each takes four bytes."""

_MOST_KEPT = 2**28
"""Texels of all pictures that are kept, 1 GiB; those that were read first go."""

_FORMATS = ("PNG", "JPEG")
_DEEP = ("I;16", "I;16B", "I;16L", "I")
"""Modes of grey pictures with 16 bits, as Pillow calls them."""
_SHARE = 257.0
"""65535 / 255: what turns levels of 16 bits into levels of 8."""


class PictureFile(NamedTuple):
    """A picture as files have it: a file of its own, or part of a mesh's."""

    place: str
    """The absolute path of its file; of a part, what messages call it."""
    contents: bytes | None = None
    """What a PNG or JPEG file would hold, of a part."""


class Texture(NamedTuple):
    """A picture, as numbers that its file has: no curve is applied to them or undone."""

    name: str
    """The path of its file, or what else tells it from others."""
    texels: NDArray[np.uint8]
    """(height, width, 4) red, green, blue and alpha, from the upper row down."""
    is_opaque: bool
    """Whether alpha is 255 everywhere."""
    stamp: tuple[int, int]
    """When the file was changed, in ns, and its bytes: what tells it from an older one."""
    mark: FileMark | None = None
    """Which file it was read from; None for a part of a mesh's."""


_known: dict[str, Texture] = {}
"""By name, the newest last. Each step is one operation of a dict: no lock is left behind."""


def place_of(path: str | os.PathLike[str]) -> str:
    """Return the absolute path of a file, by which its picture is known."""
    return os.path.normpath(Path.cwd() / path)


def read_texture(path: str | os.PathLike[str]) -> Texture:
    """Return the picture of a PNG or JPEG file, read again if the file has changed.

    Raises MeshError, naming the file, where it is missing, unreadable, of another format or of
    more than MAX_TEXELS, and where Pillow is not installed.
    """
    place = place_of(path)
    name = f"texture file {quoted(place)}"
    try:
        status = find_file(place)
        stamp = (status.st_mtime_ns, status.st_size)
        known = _known.get(place)
        if known is not None and known.stamp == stamp:
            return known
        contents, mark = read_marked(place, MAX_MESH_BYTES)
    except FileNotFoundError as error:
        raise MeshError(f"{name} does not exist") from error
    except OSError as error:
        raise MeshError(f"{name}: {error.strerror}") from error
    texels = _decoded(contents, name)
    texture = Texture(place, texels, bool((texels[..., 3] == 255).all()), stamp, mark)
    _keep(texture)
    return texture


def picture_texture(picture: PictureFile) -> Texture:
    """Return a mesh's picture, that of a file as ``known_texture`` does. Raises MeshError."""
    if picture.contents is None:
        return known_texture(picture.place)
    digest = hashlib.blake2b(picture.contents, digest_size=16).hexdigest()
    known = _known.get(digest)
    if known is not None:
        return known
    texels = _decoded(picture.contents, picture.place)
    texture = Texture(digest, texels, bool((texels[..., 3] == 255).all()), (0, 0))
    _keep(texture)
    return texture


def _keep(texture: Texture) -> None:
    _known.pop(texture.name, None)
    _known[texture.name] = texture
    kept = list(_known.values())
    count = sum(one.texels.size // 4 for one in kept)
    for oldest in kept:
        if count <= _MOST_KEPT:
            return
        _known.pop(oldest.name, None)
        count -= oldest.texels.size // 4


def known_texture(path: str | os.PathLike[str]) -> Texture:
    """Return the picture that was read of a file, also if the file has changed since.

    Raises MeshError as ``read_texture`` does if it was not read yet.
    """
    known = _known.get(place_of(path))
    return read_texture(path) if known is None else known


def _decoded(contents: bytes, name: str) -> NDArray[np.uint8]:
    try:
        from PIL import Image
    except ImportError as error:
        raise MeshError(not_installed(f"{name}: reading it", "pillow")) from error
    try:
        with warnings.catch_warnings():
            # Pillow warns of sizes, which are checked here.
            warnings.simplefilter("ignore", Image.DecompressionBombWarning)
            with Image.open(io.BytesIO(contents), formats=_FORMATS) as picture:
                width, height = picture.size
                if width * height > MAX_TEXELS:
                    raise _too_large(name, f"{width} x {height} are")
                return _levels(picture)
    except MeshError:
        raise
    except Image.UnidentifiedImageError as error:
        raise MeshError(f"{name} is no readable {' or '.join(_FORMATS)} file") from error
    except Image.DecompressionBombError as error:
        raise _too_large(name, "it has") from error
    except Exception as error:  # decoders raise whatever they meet
        raise MeshError(f"{name} is unreadable: {quoted(error)}") from error


def _too_large(name: str, what: str) -> MeshError:
    return MeshError(f"{name}: {what} more than {MAX_TEXELS} pixels")


def _levels(picture: Any) -> NDArray[np.uint8]:
    """Return red, green, blue and alpha of a picture, each from 0 to 255."""
    if picture.mode in _DEEP:
        grey = np.asarray(picture, np.float64) / _SHARE
        texels = np.full((*grey.shape, 4), 255, np.uint8)
        texels[..., :3] = np.floor(np.clip(grey, 0.0, 255.0) + 0.5)[..., None]
        return texels
    return np.ascontiguousarray(picture.convert("RGBA"), np.uint8)
