"""The boundary of the space that closed triangles wind around, by cutting where they cross."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.meshes.bvh import build_bvh
from scene_graph_ros.geometry.meshes.distinct_rows import used_indices
from scene_graph_ros.geometry.meshes.solids.crossings import first_crossing
from scene_graph_ros.geometry.meshes.solids.folds import unfolded
from scene_graph_ros.geometry.meshes.solids.mesh_report import Repair, repair_at
from scene_graph_ros.geometry.meshes.solids.piercing import TooManyError
from scene_graph_ros.geometry.meshes.solids.probes import probes, wound_otherwise
from scene_graph_ros.geometry.meshes.solids.resolve import resolved
from scene_graph_ros.geometry.meshes.solids.slivers import Corners, SHORT, without_short_edges
from scene_graph_ros.geometry.meshes.solids.winding import Tree, winding_numbers
from scene_graph_ros.geometry.meshes.triangle_boxes import triangle_boxes

__all__ = [
    "Cut",
    "NotUnitedError",
    "Piece",
    "Shell",
    "collapsed",
    "cut_where_they_cross",
    "hold_to_winding",
    "self_crossing",
    "used_part",
]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
Shell = tuple[FloatArray, IntArray]
"""Points (v, 3), and triangles (m, 3) over them."""


class Piece(NamedTuple):
    """The boundary of the solid of a group of parts."""

    vertices: FloatArray
    """(v, 3)."""
    triangles: IntArray
    """(m, 3), counter-clockwise seen from outside of the solid."""
    repairs: list[Repair]
    """Features that were too small, slits pressed together, crossings that were cut."""
    cavities: int = 0
    """How many of the parts are cavities."""
    doubt: str = ""
    """Why some of it may be wrong, or nothing."""


class Cut(NamedTuple):
    """A piece that was cut, and boxes around the points that its triangles wound otherwise."""

    piece: Piece
    negative: FloatArray
    """(r, 2, 3): lower and upper corners, around points with winding number -1 or less."""
    multiple: FloatArray
    """(r, 2, 3): the same with 2 or more."""


class NotUnitedError(Exception):
    """The library refuses a part, or a result is not the parts' union by winding numbers."""

    def __init__(self, reason: str, at: FloatArray | None = None) -> None:
        super().__init__(reason)
        self._at = at

    def told(self, origin: FloatArray) -> str:
        """Return the reason, and the place where the group's origin (3,) is at ``origin``."""
        if self._at is None:
            return f"parts can't be united: {self}"
        place = ", ".join(f"{x:.6g}" for x in self._at + origin)
        return f"parts can't be united near ({place})"


def self_crossing(vertices: FloatArray, triangles: IntArray) -> FloatArray | None:
    """Return a point (3,) where closed triangles (m, 3) cross or lie on themselves, or None.

    Or one around which they wind neither once nor not at all, as far as tried.
    """
    # Among the vertices of many parts it would take as long as those are many.
    first, last = int(triangles.min()), int(triangles.max())
    vertices, triangles = vertices[first : last + 1], triangles - first
    tree = build_bvh(*triangle_boxes(vertices, triangles))
    at = first_crossing(vertices, triangles, tree)
    return wound_otherwise(vertices, triangles, tree) if at is None else at


def cut_where_they_cross(
    points: FloatArray, oriented: IntArray, of: IntArray, crossing: FloatArray | None = None
) -> Cut:
    """Return the boundary of the space triangles (m, 3) wind around, by cutting their crossings.

    ``of`` (v,) is the part that each point is a corner of, and ``crossing`` (3,) is reported.
    Raises NotUnitedError where that is too much work, does not close or winds otherwise.
    """
    try:
        found = resolved(unfolded(points, oriented), oriented)
    except TooManyError as error:
        raise NotUnitedError(str(error)) from error
    if found is None:
        raise NotUnitedError("where they cross, they do not close")
    piece = collapsed(found.points, found.triangles, Corners(found.moved, of))
    hold_to_winding((points, oriented), piece[:2])
    if crossing is not None:
        piece.repairs.append(repair_at("bodies cut where they cross themselves", 1, crossing))
    return Cut(piece, found.negative, found.multiple)


def collapsed(points: FloatArray, triangles: IntArray, corners: Corners) -> Piece:
    """Return triangles (m, 3) without needles of rounding, and the features that they lost."""
    triangles, lost, size = without_short_edges(points, triangles, corners)
    repairs = []
    if len(lost):
        kind = f"features smaller than {SHORT:g} of the size dropped"
        repairs.append(repair_at(kind, len(lost), points[lost[0]], size))
    return Piece(*used_part(points, triangles), repairs)


def used_part(vertices: FloatArray, triangles: IntArray) -> Shell:
    """Return the vertices that triangles (m, 3) have, and the triangles over these."""
    used, triangles = used_indices(triangles, len(vertices))
    return vertices[used], triangles


def hold_to_winding(
    given: Shell, united: Shell, trees: tuple[Tree | None, Tree | None] = (None, None)
) -> None:
    """Compare a union with its parts at random points, in the box and beside vertices.

    It winds once around the points around which they wind once or more, else NotUnitedError is
    raised. ``trees`` are of the parts' triangles and of the union's, where they are known.
    """
    vertices, oriented = given
    samples = probes(vertices, oriented)
    wanted = winding_numbers(samples, vertices, oriented, tree=trees[0]) >= 1
    found = np.zeros(len(samples), dtype=np.int64)
    if len(united[1]):
        found = winding_numbers(samples, *united, tree=trees[1])
    # A part that is nested in itself, along edges of four, would leave walls inside of the solid.
    wrong = np.flatnonzero(found != wanted)
    if len(wrong):
        raise NotUnitedError("the result winds otherwise", samples[wrong[0]])
