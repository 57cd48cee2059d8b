"""A point."""

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.compiled.lanes import every
from scene_graph_ros.geometry.narrowphase.cores.corners import clamp_to, feature_at, vertex_at
from scene_graph_ros.geometry.narrowphase.cores.without import (
    corner_ways,
    edge_count,
    edge_feature,
    edge_of,
    face_count,
    face_feature,
    growth,
    has_plane_across,
    inner_radius,
    is_curved,
    is_listed,
    is_simple,
    lane_planes,
    lane_vertices,
    local_vertex,
    plane_count,
    plane_of,
    side,
    vertex_count,
)
from scene_graph_ros.geometry.narrowphase.features import NO_FEATURE
from scene_graph_ros.geometry.spatial.vectors import add, rotate

__all__ = [
    "candidate",
    "clamp_to",
    "corner_ways",
    "edge_count",
    "edge_feature",
    "edge_of",
    "face_count",
    "face_feature",
    "feature_at",
    "growth",
    "has_plane_across",
    "inner_radius",
    "is_curved",
    "is_listed",
    "is_simple",
    "lane_planes",
    "lane_support",
    "lane_vertices",
    "local_vertex",
    "neighbor",
    "plane_count",
    "plane_of",
    "side",
    "support",
    "touched",
    "vertex_count",
]


@inlined_kernel
def support(core, hulls, d):
    """Return (point, index): the point."""
    c = core[3]
    return (c[0], c[1], c[2]), 0


@inlined_kernel
def lane_support(core, hulls, d):
    """Return the point, in any directions."""
    c = core[3]
    return every(c[0]), every(c[1]), every(c[2])


@lean_kernel
def touched(placed, hulls, d, tie):
    """Return the point."""
    core, R, p = placed
    c = core[3]
    return vertex_at(add(rotate(R, (c[0], c[1], c[2])), p))


@lean_kernel
def neighbor(placed, hulls, now, a, d, allowed):
    """Return the same feature."""
    return now


@lean_kernel
def candidate(placed, hulls, simplex, side, d, index):
    """Return the point twice: as the simplex knows it, and from its coordinates."""
    if index == 0:
        return feature_at(placed, simplex, side, d)
    return touched(placed, hulls, d, 0.0) if index == 1 else NO_FEATURE
