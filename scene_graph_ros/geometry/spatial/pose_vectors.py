"""Products and checks of poses, four numbers at a time.

The compiler finds no such instructions in loops over rows and columns of single poses. All arrays
are C-contiguous, ``(n, 4, 4)``.
"""

from llvmlite import ir
from numba.core import types
import numba.core.config as numba_config
from numba.extending import intrinsic

from scene_graph_ros.geometry.spatial.vector_code import numbers, VectorCode
from scene_graph_ros.geometry.tolerances import (
    MAX_COORDINATE,
    ROTATION_DEFECT,
    ROTATION_ROUNDING,
)

__all__ = [
    "INVALID",
    "ROUGH",
    "compose_pose",
    "copy_pose",
    "pose_defects",
    "remember_pose",
]

ROUGH = 1
"""The rotation is not orthonormal to rounding."""
INVALID = 2
"""The pose is not rigid, or so far away that it has to be looked at again."""

_NEXT = (1, 2, 0, 3)
_BEFORE = (2, 0, 1, 3)
"""Columns of a row, the first three in a circle."""


def _write_product(code, left, right, product):
    builder = code.builder
    axes = [code.load(right, row) for row in range(3)]
    rows = []
    for row in range(3):
        factors = [
            builder.load(builder.gep(left, [code.integer(4 * row + column)]))
            for column in range(4)
        ]
        terms = [
            code.product(code.repeated(factor), axis)
            for factor, axis in zip(factors, axes, strict=False)
        ]
        offset = builder.insert_element(
            numbers(0.0, 0.0, 0.0, 0.0), factors[3], ir.Constant(ir.IntType(32), 3)
        )
        rows.append(code.sum([*terms, offset]))
    code.write(rows, product)


def _defects(code, pose):
    builder = code.builder
    rows = [code.load(pose, row) for row in range(3)]
    ahead = [code.order(row, _NEXT) for row in rows]
    # The squares of the columns, the last being the place, and the products of two of the others.
    squares = code.sum([code.product(row, row) for row in rows])
    lengths = code.magnitude(builder.fsub(squares, numbers(1.0, 1.0, 1.0, 0.0)))
    pairs = zip(rows, ahead, strict=True)
    angles = code.magnitude(code.sum([code.product(row, next_row) for row, next_row in pairs]))
    bottom = code.magnitude(builder.fsub(code.load(pose, 3), numbers(0.0, 0.0, 0.0, 1.0)))
    far = MAX_COORDINATE * MAX_COORDINATE
    valid, smooth = [
        numbers(limit, limit, limit, far) for limit in (ROTATION_DEFECT, ROTATION_ROUNDING)
    ]
    across = builder.fsub(
        code.product(ahead[1], code.order(rows[2], _BEFORE)),
        code.product(code.order(rows[1], _BEFORE), ahead[2]),
    )
    # Its last number is no part of the determinant, whatever it is.
    volume = code.product(rows[0], across)
    parts = [
        builder.extract_element(volume, ir.Constant(ir.IntType(32), column)) for column in range(3)
    ]
    is_valid = builder.and_(
        code.all_within(
            [(lengths, valid), (angles, valid), (bottom, numbers(*[ROTATION_DEFECT] * 4))]
        ),
        builder.fcmp_ordered(">=", code.sum(parts), ir.Constant(ir.DoubleType(), 0.0)),
    )
    is_smooth = code.all_within([(lengths, smooth), (angles, smooth)])
    return builder.or_(
        builder.select(is_smooth, code.integer(0), code.integer(ROUGH)),
        builder.select(is_valid, code.integer(0), code.integer(INVALID)),
    )


def _remember(code, given, known):
    builder = code.builder
    rows = [code.load(given, row) for row in range(3)]
    is_other = ir.Constant(ir.IntType(4), 0)
    for row, vector in enumerate(rows):
        differs = builder.fcmp_unordered("!=", vector, code.load(known, row))
        is_other = builder.or_(is_other, builder.bitcast(differs, ir.IntType(4)))
    code.write(rows, known)
    return builder.icmp_unsigned("!=", is_other, ir.Constant(ir.IntType(4), 0))


def _compose_plainly(X_AB, i, X_BC, j, X_AC, k):
    x, y, z = [[X_BC[j, row, column] for column in range(4)] for row in range(3)]
    for row in range(3):
        r0, r1, r2, p = [X_AB[i, row, column] for column in range(4)]
        for column in range(4):
            offset = p if column == 3 else 0.0
            X_AC[k, row, column] = r0 * x[column] + r1 * y[column] + r2 * z[column] + offset
    for column in range(4):
        X_AC[k, 3, column] = 1.0 if column == 3 else 0.0


def _copy_plainly(X, i, copy, k):
    copy[k, :3] = X[i, :3]
    copy[k, 3] = [0.0, 0.0, 0.0, 1.0]


def _remember_plainly(X, i, known, k):
    is_other = bool((X[i, :3] != known[k, :3]).any())
    _copy_plainly(X, i, known, k)
    return is_other


def _defects_plainly(X, i):
    R, p, bottom = X[i, :3, :3], X[i, :3, 3], X[i, 3]
    # As below: the sums over rows, one after the other.
    defect = abs(R[0, :, None] * R[0] + R[1, :, None] * R[1] + R[2, :, None] * R[2])
    for axis in range(3):
        square = R[0, axis] ** 2 + R[1, axis] ** 2 + R[2, axis] ** 2
        defect[axis, axis] = abs(square - 1.0)
    volume = R[0] @ [
        R[1, 1] * R[2, 2] - R[1, 2] * R[2, 1],
        R[1, 2] * R[2, 0] - R[1, 0] * R[2, 2],
        R[1, 0] * R[2, 1] - R[1, 1] * R[2, 0],
    ]
    is_valid = (
        (defect <= ROTATION_DEFECT).all()
        and (abs(bottom - [0.0, 0.0, 0.0, 1.0]) <= ROTATION_DEFECT).all()
        and p @ p <= MAX_COORDINATE * MAX_COORDINATE
        and volume >= 0.0
    )
    is_smooth = (defect <= ROTATION_ROUNDING).all()
    return (0 if is_smooth else ROUGH) | (0 if is_valid else INVALID)


if numba_config.DISABLE_JIT:
    compose_pose, copy_pose, pose_defects = _compose_plainly, _copy_plainly, _defects_plainly
    remember_pose = _remember_plainly
else:

    @intrinsic
    def compose_pose(typing_context, X_AB, i, X_BC, j, X_AC, k):
        """Write ``X_AB[i] X_BC[j]`` to ``X_AC[k]``."""

        def lower(context, builder, signature, arguments):
            code = VectorCode(context, builder, signature)
            places = [code.place(k, *arguments[k : k + 2]) for k in (0, 2, 4)]
            _write_product(code, *places)
            return context.get_dummy_value()

        kinds = (X_AB, types.intp, X_BC, types.intp, X_AC, types.intp)
        if not all(kind.layout == "C" for kind in kinds[::2]):
            return None
        return types.void(*kinds), lower

    @intrinsic
    def copy_pose(typing_context, X, i, copy, k):
        """Write ``X[i]`` to ``copy[k]``, with a last row as it has to be."""

        def lower(context, builder, signature, arguments):
            code = VectorCode(context, builder, signature)
            given, place = code.place(0, *arguments[:2]), code.place(2, *arguments[2:])
            code.write([code.load(given, row) for row in range(3)], place)
            return context.get_dummy_value()

        kinds = (X, types.intp, copy, types.intp)
        if not all(kind.layout == "C" for kind in kinds[::2]):
            return None
        return types.void(*kinds), lower

    @intrinsic
    def remember_pose(typing_context, X, i, known, k):
        """Write ``X[i]`` to ``known[k]``; return whether another pose was there."""

        def lower(context, builder, signature, arguments):
            code = VectorCode(context, builder, signature)
            given, place = code.place(0, *arguments[:2]), code.place(2, *arguments[2:])
            return _remember(code, given, place)

        kinds = (X, types.intp, known, types.intp)
        if not all(kind.layout == "C" for kind in kinds[::2]):
            return None
        return types.boolean(*kinds), lower

    @intrinsic
    def pose_defects(typing_context, X, i):
        """Return what there is against ``X[i]``: ROUGH, INVALID, both or 0."""

        def lower(context, builder, signature, arguments):
            code = VectorCode(context, builder, signature)
            return _defects(code, code.place(0, *arguments))

        return (types.intp(X, types.intp), lower) if X.layout == "C" else None
