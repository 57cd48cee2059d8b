"""The order of the shapes: it names pairs, files and rows of every table."""

import enum

__all__ = ["ShapeKind"]


class ShapeKind(enum.IntEnum):
    """The kind of a shape. Pairs are computed with ``kind_A <= kind_B`` and swapped back after."""

    SPHERE = 0
    CAPSULE = 1
    BOX = 2
    CYLINDER = 3
    ELLIPSOID = 4
    HALF_SPACE = 5
    CONVEX = 6
    MESH = 7
