"""Fill a closed surface that is not convex with tetrahedra: fTetWild, by way of pytetwild.

The library is optional. It runs in a process of its own, since it writes a file where it runs and
ends the process where it fails. Its surface comes within ENVELOPE of the given one. It draws
random numbers that nobody can seed, so its result is kept on disk: a surface is filled once, and
all processes have the same tetrahedra. For the same on all machines save them with
``save_volume_mesh``, and give the file as the mesh.
"""

from __future__ import annotations

import hashlib
import importlib.metadata
import importlib.util
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.errors import MeshError
from scene_graph_ros.geometry.kept_results import kept
from scene_graph_ros.geometry.meshes.other_process import LibraryError, run_library
from scene_graph_ros.geometry.meshes.surfaces import Surface
from scene_graph_ros.geometry.meshes.volume_mesh import VolumeMesh
from scene_graph_ros.geometry.spatial.sums import length

__all__ = ["DEFAULT_EDGE", "ENVELOPE", "PATIENCE", "tetrahedralize"]

DEFAULT_EDGE = 0.1
"""Relative to the diagonal of the bounding box: the wanted length of edges without a hint."""

ENVELOPE = 1e-3
"""Relative to the diagonal of the bounding box: how far the surface may move."""

PATIENCE = 900.0
"""Seconds that the library may take; ordinary meshes take some."""

_REMEDY = (
    "give it as a .vtk or .vtu file with tetrahedra, or as its convex hull by Convex, or install"
    " pytetwild"
)

_PROGRAM = """
import numpy, pytetwild
mesh = numpy.load("given.npz")
vertices, tetrahedra = pytetwild.tetrahedralize(
    mesh["vertices"], mesh["triangles"], edge_length_fac=float(mesh["edge"]),
    epsilon=float(mesh["envelope"]), num_threads=1, quiet=True)
numpy.savez("result.npz", vertices=vertices, tetrahedra=tetrahedra)
"""


def tetrahedralize(surface: Surface, edge: float | None, name: str) -> VolumeMesh:
    """Return the inside of a surface as tetrahedra.

    Args:
        surface: of any form.
        edge: metres, about how long edges shall be; by default DEFAULT_EDGE of the diagonal.
        name: the mesh's name in messages.

    Raises:
        MeshError: the surface is not closed, the library is not installed, or it found no
            tetrahedra, or not within PATIENCE; names a remedy.

    """
    if not surface.is_closed:
        why = f" ({surface.report.reason})" if surface.report.reason else ""
        raise MeshError(
            f"{name} is not closed{why}, so it has no inside to fill with tetrahedra: {_REMEDY}"
        )
    if importlib.util.find_spec("pytetwild") is None:
        raise MeshError(f"{name} is not convex: {_REMEDY}")
    digest = hashlib.blake2b(digest_size=16)
    digest.update(f"{edge} {ENVELOPE} {len(surface.vertices)} {_PROGRAM}".encode())
    digest.update(importlib.metadata.version("pytetwild").encode())
    digest.update(surface.vertices.tobytes())
    digest.update(surface.triangles.tobytes())
    found = kept("fills", digest.hexdigest(), lambda: _fill(surface, edge, name))
    return VolumeMesh.trusted(found["vertices"], found["tetrahedra"])


def _fill(surface: Surface, edge: float | None, name: str) -> dict[str, NDArray[Any]]:
    """Return the arrays of a volume mesh, checked: what is kept is not asked again."""
    lower, upper = surface.vertices.min(axis=0), surface.vertices.max(axis=0)
    diagonal = length(upper - lower)
    # The library's tolerances are made for meshes of about this size, around the origin.
    points = (surface.vertices - 0.5 * (lower + upper)) / diagonal
    relative = DEFAULT_EDGE if edge is None else min(edge / diagonal, 1.0)
    vertices, tetrahedra = _run(points, surface.triangles, relative, name)
    vertices = vertices * diagonal + 0.5 * (lower + upper)
    used, tetrahedra = np.unique(tetrahedra, return_inverse=True)
    vertices, tetrahedra = vertices[used], tetrahedra.reshape(-1, 4).astype(np.int64)
    negative = VolumeMesh.trusted(vertices, tetrahedra).volumes() < 0.0
    tetrahedra[negative, :2] = tetrahedra[negative, 1::-1]
    try:
        VolumeMesh(vertices, tetrahedra)
    except MeshError as error:
        raise MeshError(f"{name} was filled with tetrahedra that overlap: {error}") from error
    return {"vertices": vertices, "tetrahedra": tetrahedra}


def _run(
    vertices: NDArray[np.float64], triangles: NDArray[np.int64], edge: float, name: str
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Run the library; return vertices and tetrahedra."""
    given: dict[str, NDArray[Any]] = {
        "vertices": vertices,
        "triangles": triangles.astype(np.int32),
        "edge": np.array(edge),
        "envelope": np.array(ENVELOPE),
    }
    try:
        found = run_library(
            _PROGRAM, given, patience=PATIENCE, note=f"filling {name} with tetrahedra"
        )
    except LibraryError as error:
        raise MeshError(
            f"{name} could not be filled with tetrahedra, {error}: {_REMEDY}"
        ) from error
    if not len(found["tetrahedra"]):
        raise MeshError(f"{name} could not be filled with tetrahedra: {_REMEDY}")
    return found["vertices"], found["tetrahedra"]
