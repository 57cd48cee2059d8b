"""The report of `check` on one mesh file, and a picture of its open edges."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import numpy as np

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

__all__ = ["draw_open_edges", "is_mesh_file", "mesh_file_report", "mesh_summary"]

_SHOWN = 20_000
"""Triangles of a mesh that are drawn; of more, some are left out evenly."""


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
    """Write a picture of a mesh with its open edges in red.

    Raises MeshError for a file that is no mesh, and where matplotlib is not installed.
    """
    if importlib.util.find_spec("matplotlib") is None:
        raise MeshError("a picture takes matplotlib: pip install matplotlib")
    from matplotlib.figure import Figure
    from mpl_toolkits.mplot3d.art3d import Line3DCollection, Poly3DCollection

    mesh = Mesh(path)
    vertices, triangles = load_surface(mesh)
    edges = open_edges_of(mesh)
    figure = Figure(figsize=(8.0, 8.0))
    axes = figure.add_subplot(projection="3d")
    step = 1 + len(triangles) // _SHOWN
    body = Poly3DCollection(vertices[triangles[::step]], facecolor=(0.6, 0.7, 0.8, 0.3))
    axes.add_collection3d(body)
    axes.add_collection3d(Line3DCollection(edges, colors="red", linewidths=2.0))
    lower, upper = vertices.min(axis=0), vertices.max(axis=0)
    middle, half = 0.5 * (lower + upper), 0.5 * float((upper - lower).max())
    axes.set(
        xlim=(middle[0] - half, middle[0] + half),
        ylim=(middle[1] - half, middle[1] + half),
        zlim=(middle[2] - half, middle[2] + half),
        title=f"{path.name}: {len(edges)} open edges",
    )
    axes.set_box_aspect((1.0, 1.0, 1.0))
    figure.savefig(picture)
