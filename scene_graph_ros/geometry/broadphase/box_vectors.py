"""World-aligned boxes, all axes of the world at a time."""

from numba.core import cgutils, types
import numba.core.config as numba_config
from numba.extending import intrinsic
import numpy as np

from scene_graph_ros.geometry.broadphase.extents import (
    BOX_PART,
    NUMBERS,
    RADIUS,
    ROUND_PART,
)
from scene_graph_ros.geometry.spatial.vector_code import numbers, VectorCode
from scene_graph_ros.geometry.tolerances import BOX_ROUNDING

__all__ = ["bound_points", "bound_shape"]

_CORNER = 4
"""Numbers of a corner of a box: three coordinates, and one that nobody reads."""


def _columns(code, pose):
    """Return the axes of G, and its origin, in W; their fourth numbers mean nothing."""
    rows = [code.load(pose, row) for row in range(3)]
    left = code.merged(rows[0], rows[1], (0, 4, 1, 5))
    right = code.merged(rows[0], rows[1], (2, 6, 3, 7))
    return [
        code.merged(part, rows[2], places)
        for part, places in (
            (left, (0, 1, 4, 4)),
            (left, (2, 3, 5, 5)),
            (right, (0, 1, 6, 6)),
            (right, (2, 3, 7, 7)),
        )
    ]


def _write_box(code, origin, low, high, lower, upper):
    """Write a box that reaches from low to high around its origin, rounded outwards."""
    builder = code.builder
    largest = code.larger(code.magnitude(low), code.magnitude(high))
    size = builder.fadd(code.magnitude(origin), largest)
    slack = builder.fmul(size, numbers(*[BOX_ROUNDING] * 4))
    below = builder.fsub(builder.fadd(origin, low), slack)
    above = builder.fadd(builder.fadd(origin, high), slack)
    builder.store(below, code.row(lower, 0), align=8)
    builder.store(above, code.row(upper, 0), align=8)


def _bound_shape(code, extents, pose, lower, upper):
    *axes, origin = _columns(code, pose)

    def scaled(first, vectors):
        return [code.product(code.number(extents, first + k), v) for k, v in enumerate(vectors)]

    across = scaled(ROUND_PART, axes)
    half = code.sum(
        [
            code.square_root(code.sum([code.product(v, v) for v in across])),
            *scaled(BOX_PART, [code.magnitude(axis) for axis in axes]),
            code.number(extents, RADIUS),
        ]
    )
    _write_box(code, origin, code.builder.fneg(half), half, lower, upper)


def _bound_points(code, points, count, pose, lower, upper):
    builder = code.builder
    *axes, origin = _columns(code, pose)
    low = cgutils.alloca_once_value(builder, numbers(*[np.inf] * 4))
    high = cgutils.alloca_once_value(builder, numbers(*[-np.inf] * 4))
    with cgutils.for_range(builder, count) as loop:
        point = builder.gep(points, [builder.mul(loop.index, code.integer(3))])
        along = code.sum([code.product(code.number(point, k), axes[k]) for k in range(3)])
        builder.store(code.smaller(along, builder.load(low)), low)
        builder.store(code.larger(along, builder.load(high)), high)
    _write_box(code, origin, builder.load(low), builder.load(high), lower, upper)


def _write_plainly(X, low, high, i, lower, upper):
    origin = X[i, :3, 3]
    slack = BOX_ROUNDING * (abs(origin) + np.maximum(abs(low), abs(high)))
    lower[i, :3], upper[i, :3] = origin + low - slack, origin + high + slack


def _bound_shape_plainly(extents, X, i, lower, upper):
    R, row = X[i, :3, :3], extents[i]
    across = R * row[ROUND_PART : ROUND_PART + 3]
    half = np.sqrt((across * across).sum(axis=1)) + row[RADIUS]
    half += abs(R) @ row[BOX_PART : BOX_PART + 3]
    _write_plainly(X, -half, half, i, lower, upper)


def _bound_points_plainly(points, first, last, X, i, lower, upper):
    along = points[first:last] @ X[i, :3, :3].T
    _write_plainly(X, along.min(axis=0), along.max(axis=0), i, lower, upper)


if numba_config.DISABLE_JIT:
    bound_shape, bound_points = _bound_shape_plainly, _bound_points_plainly
else:

    @intrinsic
    def bound_shape(typing_context, extents, X, i, lower, upper):
        """Write the box of row i of ``extents``, at the pose ``X[i]``, to (n, 4) corners."""

        def generate(context, builder, signature, arguments):
            code = VectorCode(context, builder, signature)
            given, poses, row, *corners = arguments
            _bound_shape(
                code,
                code.place(0, given, row, NUMBERS),
                code.place(1, poses, row),
                *[code.place(3 + k, corners[k], row, _CORNER) for k in range(2)],
            )
            return context.get_dummy_value()

        kinds = (extents, X, types.intp, lower, upper)
        if not all(kind.layout == "C" for kind in (extents, X, lower, upper)):
            return None
        return types.void(*kinds), generate

    @intrinsic
    def bound_points(typing_context, points, first, last, X, i, lower, upper):
        """Write the box of points (m, 3) in G from first to last, at the pose ``X[i]``."""

        def generate(context, builder, signature, arguments):
            code = VectorCode(context, builder, signature)
            given, start, end, poses, row, *corners = arguments
            _bound_points(
                code,
                code.place(0, given, start, 3),
                builder.sub(end, start),
                code.place(3, poses, row),
                *[code.place(5 + k, corners[k], row, _CORNER) for k in range(2)],
            )
            return context.get_dummy_value()

        kinds = (points, types.intp, types.intp, X, types.intp, lower, upper)
        if not all(kind.layout == "C" for kind in (points, X, lower, upper)):
            return None
        return types.void(*kinds), generate
