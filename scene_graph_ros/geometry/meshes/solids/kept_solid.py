"""Solids of many triangles, kept on disk by all that they follow from."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict
import functools
import hashlib
import importlib.metadata
import json
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.kept_results import kept
from scene_graph_ros.geometry.meshes.solids.mesh_report import MeshReport, Repair

__all__ = ["LEAST_KEPT", "kept_solid"]

LEAST_KEPT = 5000
"""Triangles: what has fewer is found as fast as a file is read."""

Parts = tuple[NDArray, NDArray, NDArray, int, MeshReport, NDArray]


def kept_solid(
    vertices: NDArray[np.float64],
    triangles: NDArray[np.int64],
    options: tuple[Any, ...],
    find: Callable[[], Parts],
) -> Parts:
    """Return the answer of ``find`` for triangles (m, 3) over vertices (v, 3), or a kept one.

    ``options`` are all else that it depends on, but for the code, which is looked at here.
    """
    if len(triangles) < LEAST_KEPT:
        return find()
    digest = hashlib.blake2b(_code(), digest_size=16)
    digest.update(repr((options, len(vertices))).encode())
    digest.update(vertices.tobytes())
    digest.update(triangles.tobytes())
    return _unpacked(kept("solids", digest.hexdigest(), lambda: _packed(find())))


@functools.cache
def _code() -> bytes:
    """Return a digest of the sources of this folder and of the library's version."""
    digest = hashlib.blake2b(importlib.metadata.version("manifold3d").encode())
    for path in sorted(Path(__file__).parent.glob("*.py")):
        digest.update(path.read_bytes())
    return digest.digest()


def _packed(solid: Parts) -> dict[str, NDArray]:
    vertices, triangles, part, solid_parts, report, open_edges = solid
    text = json.dumps(asdict(report)).encode()
    return {
        "vertices": vertices,
        "triangles": triangles,
        "part": part,
        "solid_parts": np.array(solid_parts),
        "report": np.frombuffer(text, dtype=np.uint8),
        "open_edges": open_edges,
    }


def _unpacked(arrays: Any) -> Parts:
    told = json.loads(arrays["report"].tobytes())
    repairs = tuple(Repair(**{**r, "point": tuple(r["point"])}) for r in told["repairs"])
    report = MeshReport(**{**told, "repairs": repairs})
    return (
        arrays["vertices"],
        arrays["triangles"],
        arrays["part"],
        int(arrays["solid_parts"]),
        report,
        arrays["open_edges"],
    )
