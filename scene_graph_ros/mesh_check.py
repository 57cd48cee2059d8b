"""The report of `check` on one mesh file, and a picture of its open edges."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry import Mesh
from scene_graph_ros.geometry.errors import MeshError
from scene_graph_ros.geometry.meshes.solids.mesh_report import MeshReport
from scene_graph_ros.geometry.meshes.sources import (
    load_surface,
    MESH_FILE_TYPES,
    open_edges_of,
    report_of,
)
from scene_graph_ros.geometry.model.contact_properties import MESH_GROUP, PIECES
from scene_graph_ros.geometry.model.mesh_properties import mesh_meant
from scene_graph_ros.geometry.model.properties import ProximityProperties
from scene_graph_ros.missing_package import not_installed

__all__ = ["draw_open_edges", "is_mesh_file", "mesh_file_report", "mesh_summary"]

_SHOWN = 20_000
"""Triangles of a mesh that are drawn; of more, some are left out evenly."""

_RING = 0.1
"""Relative to half the size: how far rings around open edges are apart."""


def is_mesh_file(path: Path) -> bool:
    """Tell by its suffix whether a file is a mesh."""
    return path.suffix.lower().lstrip(".") in MESH_FILE_TYPES


def mesh_file_report(path: Path, pieces: str | None = None) -> MeshReport:
    """Return the report on a file's triangles, and on the hulls of its pieces.

    Raises MeshError for a file that is no mesh, or has no such pieces.
    """
    properties = ProximityProperties()
    if pieces is not None:
        properties.add_property(MESH_GROUP, PIECES, pieces)
    return report_of(mesh_meant(Mesh(path), properties))


def mesh_summary(path: Path, report: MeshReport) -> str:
    """Return the size and the report's counts, repairs and pieces in one line."""
    vertices, triangles = load_surface(Mesh(path))
    size = " x ".join(f"{s:.4g}" for s in np.ptp(vertices, axis=0))
    counts = str(report).removesuffix(f": {report.reason}")
    return f"{len(triangles)} triangles, {size} m; {counts}"


def draw_open_edges(path: Path, picture: Path) -> None:
    """Write a picture of a mesh with its open edges in red, and a repair of each kind in orange.

    Raises MeshError for a file that is no mesh, where matplotlib is not installed, and for a
    picture that can't be written.
    """
    if importlib.util.find_spec("matplotlib") is None:
        raise MeshError(not_installed("a picture", "matplotlib"))
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8.0, 8.0), layout="constrained")
    _draw(figure, path)
    try:
        figure.savefig(picture)
    except (OSError, ValueError) as error:  # the latter for a suffix that is no picture's
        reason = error.strerror if isinstance(error, OSError) else error
        raise MeshError(f"the picture {str(picture)!r} can't be written: {reason}") from error


def _draw(figure: Any, path: Path) -> None:
    from mpl_toolkits.mplot3d.art3d import Line3DCollection, Poly3DCollection

    mesh = Mesh(path)
    vertices, triangles = load_surface(mesh)
    edges, report = open_edges_of(mesh), report_of(mesh)
    axes = figure.add_subplot(projection="3d", computed_zorder=False)
    step = 1 + len(triangles) // _SHOWN
    body = Poly3DCollection(
        vertices[triangles[::step]],
        facecolor=(0.6, 0.7, 0.8, 0.3),
        edgecolor=(0.3, 0.4, 0.5, 0.3),
        linewidths=0.3,
    )
    axes.add_collection3d(body)
    lower, upper = vertices.min(axis=0), vertices.max(axis=0)
    middle, half = 0.5 * (lower + upper), 0.5 * float((upper - lower).max())
    if len(edges):
        axes.add_collection3d(Line3DCollection(edges, colors="red", linewidths=2.0, zorder=3))
        places = _spread(edges.mean(axis=1), _RING * half)
        ring = {"facecolors": "none", "edgecolors": "red", "s": 150, "depthshade": False}
        axes.scatter(*places.T, label="open edges", zorder=4, **ring)
        x, y, z = edges[0].mean(axis=0) - middle
        axes.view_init(  # from outside, on the edge that is told
            elev=float(np.clip(np.degrees(np.arctan2(z, np.hypot(x, y))), -60.0, 60.0)),
            azim=float(np.degrees(np.arctan2(y, x))) + 15.0,
        )
    for repair in report.repairs:
        dot = {"color": "tab:orange", "s": 30, "depthshade": False, "zorder": 5}
        axes.scatter(*np.array(repair.point)[:, None], label=str(repair), **dot)
    axes.set(
        xlim=(middle[0] - half, middle[0] + half),
        ylim=(middle[1] - half, middle[1] + half),
        zlim=(middle[2] - half, middle[2] + half),
        xlabel="x (m)",
        ylabel="y (m)",
        zlabel="z (m)",
        title=f"{path.name}: {_count_of(edges)}",
    )
    axes.set_box_aspect((1.0, 1.0, 1.0))
    if len(edges) or report.repairs:
        figure.legend(loc="outside lower center")


def _count_of(edges: NDArray[np.float64]) -> str:
    return f"{len(edges)} open edge{'' if len(edges) == 1 else 's'}" if len(edges) else "closed"


def _spread(points: NDArray[np.float64], apart: float) -> NDArray[np.float64]:
    """Return the first of (n, 3) points in each cell of a grid, so that rings are apart."""
    cells = np.floor((points - points.min(axis=0)) / apart)
    return points[np.unique(cells, axis=0, return_index=True)[1]]
