"""The bodies that a renderer draws, as arrays for its kernels."""

from typing import NamedTuple

import numpy as np

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel

__all__ = ["MAX_TRIANGLES", "Bodies", "element", "row_of", "triangle_of"]

_BITS = 26
MAX_TRIANGLES = 1 << _BITS
"""Of one body."""


class Bodies(NamedTuple):
    """The bodies in rows that ascend by geometry id. Deformable ones are meshes of the moment."""

    kind: np.ndarray
    """(n,) int32: a ``ShapeKind``; what has no closed form is a mesh."""
    size: np.ndarray
    """(n, 3) metres, as in a ShapeTable."""
    X_WG: np.ndarray
    """(n, 4, 4)."""
    center: np.ndarray
    """(n, 3) metres: the centre of a ball around the body, in G."""
    radius: np.ndarray
    """(n,) metres: that of the ball; infinite for a half space."""
    mesh: np.ndarray
    """(n,) int32: the body's mesh, or -1."""
    vertex_start: np.ndarray
    """(m+1,) int64: mesh k owns ``vertices[vertex_start[k]:vertex_start[k+1]]``."""
    vertices: np.ndarray
    """(V, 3) metres, in G."""
    triangle_start: np.ndarray
    """(m+1,) int64."""
    triangles: np.ndarray
    """(T, 3) int32 indices among the vertices of their mesh; their winding has no meaning."""
    label: np.ndarray
    """(n,) int16."""
    diffuse: np.ndarray
    """(n, 3) red, green and blue, 0 to 1."""
    is_painted: np.ndarray
    """(n,) bool: whether triangles have the colours of their file, where it gives them one."""
    paint: np.ndarray
    """(T,) int32 into ``palette``: the colour of each triangle by its file, -1 for none."""
    palette: np.ndarray
    """(P, 3) red, green and blue, 0 to 1."""


@inlined_kernel
def element(row, triangle):
    """Return the number of a body's triangle, or of the body itself with triangle 0."""
    return float((row << _BITS) | triangle)


@inlined_kernel
def row_of(number):
    """Return the row of an element's body."""
    return int(number) >> _BITS


@inlined_kernel
def triangle_of(number):
    """Return an element's triangle in its mesh."""
    return int(number) & (MAX_TRIANGLES - 1)
