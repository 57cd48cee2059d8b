"""Answers of cores without the feature asked for: right for every core, or of kind NONE.

A kind takes from here the answers that it lacks. Where an answer is only asked of cores
that count more than zero of something, it says so.
"""

import math

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel
from scene_graph_ros.geometry.compiled.lanes import every
from scene_graph_ros.geometry.narrowphase.cores.growth_forms import NOTHING
from scene_graph_ros.geometry.narrowphase.cores.kinds import CORNERS_UNKNOWN, ORIGIN
from scene_graph_ros.geometry.narrowphase.features import NO_FEATURE

__all__ = [
    "clamp_to",
    "corner_ways",
    "edge_count",
    "edge_feature",
    "edge_of",
    "face_count",
    "face_feature",
    "growth",
    "has_plane_across",
    "inner_radius",
    "is_curved",
    "is_listed",
    "is_simple",
    "lane_planes",
    "lane_vertices",
    "local_vertex",
    "plane_count",
    "plane_of",
    "side",
    "vertex_count",
]


@inlined_kernel
def is_curved(core):
    """Return False."""
    return False


@inlined_kernel
def is_simple(core, hulls):
    """Return True."""
    return True


@inlined_kernel
def is_listed(core):
    """Return False."""
    return False


@inlined_kernel
def inner_radius(core, hulls, q, m):
    """Return 0: no ball is known."""
    return 0.0


@inlined_kernel
def growth(core, hulls, q, m, t, u, flat, near):
    """Return that no growth is known."""
    return NOTHING


@inlined_kernel
def edge_count(core, hulls):
    """Return 0."""
    return 0


@inlined_kernel
def face_count(core, hulls):
    """Return 0."""
    return 0


@inlined_kernel
def vertex_count(core, hulls):
    """Return 0."""
    return 0


@inlined_kernel
def edge_of(placed, hulls, k):
    """Return no faces and no point; never asked."""
    return 0, 0, ORIGIN


@inlined_kernel
def lane_vertices(core, hulls, first):
    """Return no vertices; never asked."""
    nothing = every(0.0)
    return nothing, nothing, nothing


@inlined_kernel
def local_vertex(core, hulls, k):
    """Return the origin; never asked."""
    return ORIGIN


@inlined_kernel
def has_plane_across(core, k):
    """Return False."""
    return False


@inlined_kernel
def plane_count(core, hulls):
    """Return 0."""
    return 0


@inlined_kernel
def plane_of(core, hulls, k):
    """Return no normal and no offset; never asked."""
    return ORIGIN, 0.0


@inlined_kernel
def lane_planes(core, hulls, first):
    """Return no planes; never asked."""
    nothing = every(0.0)
    return (nothing, nothing, nothing), every(math.inf)


@inlined_kernel
def corner_ways(core, hulls):
    """Return that they are not known."""
    return CORNERS_UNKNOWN


@inlined_kernel
def side(placed):
    """Return no feature."""
    return NO_FEATURE


@inlined_kernel
def face_feature(placed, hulls, k, d):
    """Return no feature."""
    return NO_FEATURE


@inlined_kernel
def edge_feature(placed, hulls, k):
    """Return no feature."""
    return NO_FEATURE


@inlined_kernel
def clamp_to(placed, feature, simplex, side, a):
    """Return a: features without an extent hold every point."""
    return a
