"""Products and checks of poses, four numbers at a time.

The compiler finds no such instructions in loops over rows and columns of single poses. All arrays
are C-contiguous, ``(n, 4, 4)``.
"""

from scene_graph_ros.geometry.compiled.code import ARRAY, generated, PLACE, YES_OR_NO
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

_POSE = 16
"""Numbers of a pose."""
_NEXT = (1, 2, 0, 3)
_BEFORE = (2, 0, 1, 3)
"""Columns of a row, the first three in a circle."""


def _rows(pose):
    return [pose.vector(4 * row, 4) for row in range(3)]


def _write(code, rows, pose):
    """Write the first three rows of a pose, and the last as it has to be."""
    for row, vector in enumerate([*rows, code.numbers(0.0, 0.0, 0.0, 1.0)]):
        pose.write(4 * row, vector)


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


@generated(ARRAY, PLACE, ARRAY, PLACE, ARRAY, PLACE, plain=_compose_plainly)
def compose_pose(code, X_AB, i, X_BC, j, X_AC, k):
    """Write ``X_AB[i] X_BC[j]`` to ``X_AC[k]``."""
    left, axes = X_AB.start(i * _POSE), _rows(X_BC.start(j * _POSE))
    rows = []
    for row in range(3):
        factors = [left.number(4 * row + column) for column in range(4)]
        terms = [code.repeated(factors[axis], 4) * axes[axis] for axis in range(3)]
        offset = code.replaced(code.numbers(0.0, 0.0, 0.0, 0.0), 3, factors[3])
        rows.append(code.sum([*terms, offset]))
    _write(code, rows, X_AC.start(k * _POSE))


@generated(ARRAY, PLACE, ARRAY, PLACE, plain=_copy_plainly)
def copy_pose(code, X, i, copy, k):
    """Write ``X[i]`` to ``copy[k]``, with a last row as it has to be."""
    _write(code, _rows(X.start(i * _POSE)), copy.start(k * _POSE))


@generated(ARRAY, PLACE, ARRAY, PLACE, plain=_remember_plainly, returns=YES_OR_NO)
def remember_pose(code, X, i, known, k):
    """Write ``X[i]`` to ``known[k]``; return whether another pose was there."""
    rows, place = _rows(X.start(i * _POSE)), known.start(k * _POSE)
    x, y, z = [row.differs(before) for row, before in zip(rows, _rows(place), strict=True)]
    _write(code, rows, place)
    return code.any_of(x | y | z)


@generated(ARRAY, PLACE, plain=_defects_plainly, returns=PLACE)
def pose_defects(code, X, i):
    """Return what there is against ``X[i]``: ROUGH, INVALID, both or 0."""
    pose = X.start(i * _POSE)
    rows = _rows(pose)
    ahead, behind = [[code.reordered(row, order) for row in rows] for order in (_NEXT, _BEFORE)]
    # The squares of the columns, the last being the place, and the products of two of the others.
    lengths = code.magnitude(code.dot(rows, rows) - code.numbers(1.0, 1.0, 1.0, 0.0))
    angles = code.magnitude(code.dot(rows, ahead))
    bottom = code.magnitude(pose.vector(12, 4) - code.numbers(0.0, 0.0, 0.0, 1.0))
    far = MAX_COORDINATE * MAX_COORDINATE
    valid, smooth = [
        code.numbers(limit, limit, limit, far) for limit in (ROTATION_DEFECT, ROTATION_ROUNDING)
    ]
    # Its last number is no part of the determinant, whatever it is.
    volume = rows[0] * (ahead[1] * behind[2] - behind[1] * ahead[2])
    is_valid = code.all_of(
        (lengths <= valid) & (angles <= valid) & (bottom <= ROTATION_DEFECT)
    ) & (code.sum([volume[column] for column in range(3)]) >= 0.0)
    is_smooth = code.all_of((lengths <= smooth) & (angles <= smooth))
    none = code.place(0)
    return code.select(is_smooth, none, code.place(ROUGH)) | code.select(
        is_valid, none, code.place(INVALID)
    )
