"""The pictures that a mesh's file names or holds, as the file says it: none is looked for here."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

__all__ = ["AS_IT_IS", "FilePicture", "FilePictures", "Placement"]

Placement = tuple[tuple[float, float, float], tuple[float, float, float]]
"""Rows of a matrix that takes (u, v, 1) at a corner to (u, v) on the picture, v upwards."""

AS_IT_IS: Placement = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0))


class FilePicture(NamedTuple):
    """The picture of one material."""

    address: str
    """The picture's file as the mesh's file writes it; of one that is held, what tells it."""
    contents: bytes | None = None
    """What a PNG or JPEG file would hold, of a picture that is in the mesh's own file."""
    placement: Placement = AS_IT_IS
    folder: str = ""
    """What the address is relative to, itself relative to the mesh's file."""


class FilePictures(NamedTuple):
    """The pictures of a file's materials."""

    pictures: tuple[FilePicture, ...]
    row: NDArray[np.int32]
    """(m,) into ``pictures``: that of each triangle, -1 for none."""
