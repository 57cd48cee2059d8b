"""Split a solid into nearly convex pieces: CoACD (Wei, Liu, Ling and Su, 2022), an extra.

It runs in a process of its own, which it ends where it fails. A closed surface is split as it is;
one that is open, or that the library fails at, it first wraps in one that encloses it. The same
solid, threshold and seed give the same pieces, so they are kept on disk. Where it cuts it leaves a
gap of up to 1e-4 of the size, so pieces are grown until they meet again.
"""

from __future__ import annotations

import functools
import hashlib
import importlib.metadata
import importlib.util

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.errors import MeshError
from scene_graph_ros.geometry.kept_results import kept
from scene_graph_ros.geometry.meshes.hull import convex_hull
from scene_graph_ros.geometry.meshes.other_process import LibraryError, run_library
from scene_graph_ros.geometry.meshes.pieces.piece_hulls import grown
from scene_graph_ros.geometry.meshes.surfaces import Surface
from scene_graph_ros.geometry.shapes.mesh_pieces import MeshPieces
from scene_graph_ros.missing_package import not_installed

__all__ = ["PATIENCE", "split_by_coacd"]

FloatArray = NDArray[np.float64]

_GROWN = 6e-5
"""Relative to the size: as far are the faces of each piece moved outwards."""

PATIENCE = 1800.0
"""Seconds that the library may take; ordinary meshes take some to some tens."""

_PROGRAM = """
import numpy, coacd
coacd.set_log_level("error")
given = numpy.load("given.npz")
pieces = coacd.run_coacd(
    coacd.Mesh(given["vertices"], given["triangles"]),
    threshold=float(given["threshold"]), seed=int(given["seed"]),
    preprocess_mode=str(given["wrapping"]))
points = [numpy.asarray(vertices, dtype=float) for vertices, _ in pieces]
numpy.savez("result.npz", points=numpy.concatenate(points),
    counts=numpy.array([len(p) for p in points]))
"""


def split_by_coacd(surface: Surface, pieces: MeshPieces, name: str) -> list[FloatArray]:
    """Return the corners (k, 3) of each piece, metres.

    Args:
        surface: the mesh to split; the library closes one that is open.
        pieces: with its threshold and seed.
        name: the mesh's name in messages.

    Raises:
        MeshError: the library is not installed and nothing is kept, or it failed, or not within
            PATIENCE.

    """
    digest = hashlib.blake2b(digest_size=16)
    digest.update(f"{pieces} {len(surface.vertices)} {_PROGRAM}".encode())
    digest.update(surface.vertices.tobytes())
    digest.update(surface.triangles.tobytes())
    digest.update(_version(name).encode())
    found = kept("pieces", digest.hexdigest(), lambda: _split(surface, pieces, name))
    pieces_found = np.split(found["points"], np.cumsum(found["counts"])[:-1])
    by = _GROWN * float(np.ptp(surface.vertices, axis=0).max())
    hulls = [convex_hull(points) for points in pieces_found]
    return [grown(hull, by) if len(hull.faces) > 2 else hull.vertices for hull in hulls]


@functools.cache
def _installed() -> str:
    return importlib.metadata.version("coacd") if importlib.util.find_spec("coacd") else ""


def _version(name: str) -> str:
    version = _installed()
    if not version:
        lack = not_installed(f"{name}: 'coacd' of the property ('mesh', 'pieces')", "coacd")
        raise MeshError(f"{lack}, or leave the property out")
    return version


def _split(surface: Surface, pieces: MeshPieces, name: str) -> dict[str, NDArray]:
    given = {
        "vertices": surface.vertices,
        "triangles": surface.triangles.astype(np.int32),
        "threshold": np.array(pieces.threshold),
        "seed": np.array(pieces.seed),
    }
    note = f"splitting {name}, {len(surface.triangles)} triangles, into convex pieces"
    for wrapping in ("off", "on") if surface.is_closed else ("on",):
        given["wrapping"] = np.array(wrapping)
        try:
            found = run_library(_PROGRAM, given, patience=PATIENCE, note=note)
            break
        except LibraryError as error:
            reason = str(error)
    else:
        raise MeshError(f"{name} could not be split into convex pieces: {reason}")
    counts = found["counts"]
    if not len(counts) or not np.isfinite(found["points"]).all():
        raise MeshError(f"{name} could not be split into convex pieces: CoACD found none")
    return {"points": found["points"], "counts": counts.astype(np.int64)}
