"""The triangles of a leaf in step: which of them may cross, or lie on, another triangle.

Two triangles do neither if their boxes are apart, or if their normals do not oppose each other and
each is on one side of the other's plane (Tomas Moller, "A Fast Triangle-Triangle Intersection
Test", Journal of Graphics Tools 2(2), 1997). Few pairs are left, which are then looked at one by
one. A leaf has no more triangles than four lanes.
"""

import numpy as np

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, kernel
from scene_graph_ros.geometry.compiled.lanes import (
    bits_of,
    FOUR,
    larger,
    load_four,
    load_number,
    smaller,
)
from scene_graph_ros.geometry.meshes.bvh import LEAF_TRIANGLES

__all__ = ["NUMBERS", "left_of_block", "load_block", "triangle_blocks"]

assert LEAF_TRIANGLES <= FOUR

_NORMAL, _OFFSET = 9, 12
NUMBERS = 13
"""Of a triangle: the coordinates of its corners, its normal, and its plane's offset along it."""

_FACING = -0.98
"""The dot product of the normals of triangles that do not lie on each other is larger; those that
do have one of at most -0.99 (``press``)."""

_UNIT = 0.5
"""A triangle of which the square of the normal is less has no plane."""


@kernel
def triangle_blocks(vertices, triangles, normals, tree):
    """Return (blocks, place): the triangles of the leaves of a tree, number by number.

    ``blocks`` is (b, NUMBERS, FOUR), and ``place`` (nodes,) where a leaf's block begins. Lanes
    without a triangle are nan, and so is the offset of a triangle without a plane.
    """
    _, _, left, right, order = tree
    place = np.full(len(left), -1, np.int64)
    count = 0
    for node in range(len(left)):
        if left[node] < 0:
            place[node] = count * NUMBERS * FOUR
            count += 1
    blocks = np.empty((count, NUMBERS, FOUR))
    block = 0
    for node in range(len(left)):
        if left[node] >= 0:
            continue
        first = -1 - left[node]
        for lane in range(FOUR):
            if lane >= right[node]:
                for number in range(NUMBERS):
                    blocks[block, number, lane] = np.nan
                continue
            t = order[first + lane]
            square, offset = 0.0, 0.0
            for axis in range(3):
                n = normals[t, axis]
                square += n * n
                offset += n * vertices[triangles[t, 0], axis]
                blocks[block, _NORMAL + axis, lane] = n
                for k in range(3):
                    blocks[block, 3 * k + axis, lane] = vertices[triangles[t, k], axis]
            blocks[block, _OFFSET, lane] = offset if square > _UNIT else np.nan
        block += 1
    return blocks, place


@inlined_kernel
def _lanes(blocks, at, number):
    """Return three numbers of a block that begins at a place, from one on."""
    return (
        load_four(blocks, at + number * FOUR),
        load_four(blocks, at + (number + 1) * FOUR),
        load_four(blocks, at + (number + 2) * FOUR),
    )


@inlined_kernel
def load_block(blocks, at):
    """Return (corners, n, offset, lower, upper) of a block's triangles."""
    a, b, c = _lanes(blocks, at, 0), _lanes(blocks, at, 3), _lanes(blocks, at, 6)
    return (
        (a, b, c),
        _lanes(blocks, at, _NORMAL),
        load_four(blocks, at + _OFFSET * FOUR),
        (_least(a[0], b[0], c[0]), _least(a[1], b[1], c[1]), _least(a[2], b[2], c[2])),
        (_most(a[0], b[0], c[0]), _most(a[1], b[1], c[1]), _most(a[2], b[2], c[2])),
    )


@inlined_kernel
def _least(a, b, c):
    return smaller(smaller(a, b), c)


@inlined_kernel
def _most(a, b, c):
    return larger(larger(a, b), c)


@inlined_kernel
def _corner(blocks, at, number):
    """Return a corner, or the normal, of the triangle whose numbers begin at a place."""
    return (
        load_number(blocks, at + number * FOUR),
        load_number(blocks, at + (number + 1) * FOUR),
        load_number(blocks, at + (number + 2) * FOUR),
    )


@inlined_kernel
def _dot(n, p):
    return n[0] * p[0] + n[1] * p[1] + n[2] * p[2]


@inlined_kernel
def _is_aside(n, offset, a, b, c, deep):
    """Tell whether three points are on one side of a plane, or beyond it by less than deep."""
    e, f, g = _dot(n, a) - offset, _dot(n, b) - offset, _dot(n, c) - offset
    return (_most(e, f, g) <= deep) | (_least(e, f, g) >= -deep)


@inlined_kernel
def left_of_block(blocks, at, lane, block, deep):
    """Return bits of the triangles of a loaded block that may cross the one of a lane at a place.

    ``deep`` is by how much a triangle that crosses another one reaches across its plane at least.
    """
    at = at + lane
    corners, normals, offsets, lower, upper = block
    a, b, c = _corner(blocks, at, 0), _corner(blocks, at, 3), _corner(blocks, at, 6)
    meets = lower[0] <= _most(a[0], b[0], c[0])
    meets = meets & (lower[1] <= _most(a[1], b[1], c[1]))
    meets = meets & (lower[2] <= _most(a[2], b[2], c[2]))
    meets = meets & (upper[0] >= _least(a[0], b[0], c[0]))
    meets = meets & (upper[1] >= _least(a[1], b[1], c[1]))
    meets = meets & (upper[2] >= _least(a[2], b[2], c[2]))
    n, offset = _corner(blocks, at, _NORMAL), load_number(blocks, at + _OFFSET * FOUR)
    is_clear = _dot(normals, n) > _FACING
    is_clear = is_clear & _is_aside(n, offset, corners[0], corners[1], corners[2], deep)
    is_clear = is_clear & _is_aside(normals, offsets, a, b, c, deep)
    return bits_of(meets & ~is_clear)
