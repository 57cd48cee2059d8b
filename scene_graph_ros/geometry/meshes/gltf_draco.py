"""Meshes in glTF files that Draco packs; DracoPy, an extra, unpacks them."""

from __future__ import annotations

import importlib.util

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.errors import MeshError
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.missing_package import not_installed

__all__ = ["DRACO", "decoded_draco"]

DRACO = "KHR_draco_mesh_compression"


def decoded_draco(data: bytes, where: str) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Return the positions (n, 3) and corners (3 m,) of packed triangles.

    Raises MeshError, beginning with ``where``, without DracoPy and for data that it can't unpack.
    """
    if importlib.util.find_spec("DracoPy") is None:
        raise MeshError(not_installed(f"{where}: {DRACO}", "DracoPy"))
    import DracoPy

    try:
        mesh = DracoPy.decode(data)
        points = np.asarray(mesh.points, dtype=np.float64).reshape(-1, 3)
        corners = np.asarray(mesh.faces, dtype=np.int64).reshape(-1)
    except Exception as error:  # a library's parser raises whatever it meets
        raise MeshError(f"{where}: unreadable {DRACO}: {quoted(error)}") from error
    return points, corners
