"""The kinds of cores: convex shapes without their radius.

A core is the tuple ``(core_kind, hull, radius, params)``: an integer of this module, where its
hull's block starts in the array ``hulls`` (see ``tables.hull_blocks``; or -1), the radius by which
the core is inflated (m) and nine floats (m, in the core's own frame):

========== ==================================================================
POINT      the point's coordinates (zeros for a sphere)
SEGMENT    half length along z
BOX        half extents
CYLINDER   radius, half length along z
ELLIPSOID  semi-axes
HULL       nothing: the vertices are those of the block that starts at ``hull``
TRIANGLE   its three vertices
========== ==================================================================

A kind's answers to the narrow phase's questions are in the file of its name; `registry` says
which that is, and `questions` asks.
"""

__all__ = [
    "BOX",
    "CORNERS_ACROSS_SIDE",
    "CORNERS_NOWHERE",
    "CORNERS_OF_ELLIPSOID",
    "CORNERS_UNKNOWN",
    "CURVED",
    "CYLINDER",
    "ELLIPSOID",
    "HULL",
    "IDENTITY",
    "ORIGIN",
    "POINT",
    "SEGMENT",
    "TRIANGLE",
]

POINT = 0
SEGMENT = 1
BOX = 2
CYLINDER = 3
ELLIPSOID = 4
HULL = 5
TRIANGLE = 6

CURVED = -1
"""The index of a support point that is no vertex."""

IDENTITY = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)
ORIGIN = (0.0, 0.0, 0.0)

CORNERS_UNKNOWN = 0
CORNERS_NOWHERE = 1
CORNERS_ACROSS_SIDE = 2
CORNERS_OF_ELLIPSOID = 3
"""In which directions other than normals of its planes a corner of a polytope may leave a core
by a way that is locally the shortest: it is not known, in none (the core is a polytope itself),
across its side, or where ``vertices_in_ellipsoid`` finds them."""
