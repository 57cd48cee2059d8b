"""The nearest configurations, to first order, at which conditions on links are held with room.

Each step is the shortest that brings all values which are out of their inner bounds back to them:
Gauss-Newton with a little damping (Berenson, Srinivasa and Kuffner, *Task Space Regions*, 2011,
section 4.2, for projections on constraints). Positions at their limits stay there.
"""

import math

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.spatial.elementary import sine_cosine
from scene_graph_ros.planning.constraints.chain_states import cross, place_chain, values_of
from scene_graph_ros.planning.constraints.constraint_table import BETWEEN, BOX, NEAR, SLIDE, TURN

__all__ = ["project"]

_STEPS = 40

_LONGEST = 0.5
"""rad: the change of an angle in a step at most."""

_DAMPING = 1e-9
"""Relative to the sum of the squares of all derivatives."""

_ENOUGH = 0.2
"""Of the room between inner bounds and bounds: what may be used up."""

_FREEZES = 4
"""Times that positions at limits are taken out of a step."""


@inlined_kernel
def _add_angle(table, c, axis, sign, axes, row):
    """Write the derivatives of an angle, times a sign."""
    for e in range(table.firsts[c], table.firsts[c + 1]):
        if table.elements[e] == SLIDE:
            continue
        count = 1 if table.elements[e] == TURN else 3
        for k in range(count):
            a = axes[e, k]
            row[table.columns[e] + k] += sign * (axis[0] * a[0] + axis[1] * a[1] + axis[2] * a[2])


@inlined_kernel
def _add_place(table, c, i, p, sign, axes, origins, row):
    """Write the derivatives of a coordinate of a point, times a sign."""
    for e in range(table.firsts[c], table.firsts[c + 1]):
        if table.elements[e] == SLIDE:
            row[table.columns[e]] += sign * axes[e, 0, i]
            continue
        o = origins[e]
        arm = p[0] - o[0], p[1] - o[1], p[2] - o[2]
        count = 1 if table.elements[e] == TURN else 3
        for k in range(count):
            a = axes[e, k]
            row[table.columns[e] + k] += sign * cross((a[0], a[1], a[2]), arm)[i]


@inlined_kernel
def _linearized(table, inner, q, work):
    """Write rows of what is beyond inner bounds; return their number, and whether that is enough.

    ``inner`` are the bounds ``(2, c, 3)`` and how far beyond is enough ``(c,)``.
    """
    J, r, axes, origins = work[0], work[1], work[2], work[3]
    lower, upper, room = inner
    rows, is_enough = 0, True
    for c in range(len(table.kinds)):
        Q, p = place_chain(table, c, q, axes, origins)
        values, axis = values_of(table, c, Q, p)
        count = 3 if table.kinds[c] == BOX else 1
        for i in range(count):
            sign = 1.0
            beyond = values[i] - upper[c, i]
            if lower[c, i] - values[i] > beyond:
                sign, beyond = -1.0, lower[c, i] - values[i]
            if not beyond > 0.0:
                continue
            is_enough = is_enough and beyond <= _ENOUGH * room[c]
            J[rows, :] = 0.0
            r[rows] = beyond
            if table.kinds[c] == BETWEEN or table.kinds[c] == NEAR:
                _add_angle(table, c, axis, sign, axes, J[rows])
            else:
                _add_place(table, c, i, p, sign, axes, origins, J[rows])
            rows += 1
    return rows, is_enough


@inlined_kernel
def _factor_row(A, i):
    """Write a row of the Cholesky factor in place of a matrix's; tell whether there is one."""
    for j in range(i + 1):
        dot = A[i, j]
        for k in range(j):
            dot -= A[i, k] * A[j, k]
        if i > j:
            A[i, j] = dot / A[j, j]
        elif dot > 0.0:
            A[i, i] = math.sqrt(dot)
        else:
            return False
    return True


@inlined_kernel
def _solve(J, r, rows, A, y):
    """Write y with ``(J J' + damping) y = r``; tell whether there is one. By Cholesky."""
    total = 0.0
    for i in range(rows):
        for j in range(i + 1):
            dot = 0.0
            for k in range(J.shape[1]):
                dot += J[i, k] * J[j, k]
            A[i, j] = dot
        total += A[i, i]
    if not total > 0.0:
        return False
    for i in range(rows):
        A[i, i] += _DAMPING * total
        if not _factor_row(A, i):
            return False
        y[i] = r[i]
        for k in range(i):
            y[i] -= A[i, k] * y[k]
        y[i] /= A[i, i]
    for i in range(rows - 1, -1, -1):
        for k in range(i + 1, rows):
            y[i] -= A[k, i] * y[k]
        y[i] /= A[i, i]
    return True


@inlined_kernel
def _step(space, q, rows, work):
    """Write the step to take; tell whether there is one."""
    J, r, A, y, step = work[0], work[1], work[4], work[5], work[6]
    moves, turns, lower, upper = space
    for k in range(len(q)):
        if moves[k] == 0:
            J[:rows, k] = 0.0
    for _ in range(_FREEZES):
        if not _solve(J, r, rows, A, y):
            return False
        is_inside = True
        for k in range(len(q)):
            step[k] = 0.0
            for i in range(rows):
                step[k] -= J[i, k] * y[i]
            if (step[k] < 0.0 and q[k] <= lower[k]) or (step[k] > 0.0 and q[k] >= upper[k]):
                is_inside = False
                J[:rows, k] = 0.0
        if is_inside:
            break
    _shorten(turns, step)
    return True


@inlined_kernel
def _shorten(turns, step):
    """Shorten a step in which an angle would change by too much."""
    longest = 0.0
    for k in range(len(step)):
        if turns[k] != 0:
            longest = max(longest, abs(step[k]))
    if longest > _LONGEST:
        for k in range(len(step)):
            step[k] *= _LONGEST / longest


@inlined_kernel
def _go(space, quaternions, q, step):
    """Take the step, as far as limits allow."""
    _, _, lower, upper = space
    for n in range(len(quaternions)):
        s = quaternions[n]
        size = math.sqrt(step[s] ** 2 + step[s + 1] ** 2 + step[s + 2] ** 2)
        if size > 0.0:
            sine, cosine = sine_cosine(0.5 * size)
            f = sine / size
            x, y, z = f * step[s], f * step[s + 1], f * step[s + 2]
            a, b, c, d = q[s], q[s + 1], q[s + 2], q[s + 3]
            q[s] = a * cosine - b * x - c * y - d * z
            q[s + 1] = a * x + b * cosine + c * z - d * y
            q[s + 2] = a * y - b * z + c * cosine + d * x
            q[s + 3] = a * z + b * y - c * x + d * cosine
        step[s] = step[s + 1] = step[s + 2] = step[s + 3] = 0.0
    for k in range(len(q)):
        if step[k] != 0.0:
            q[k] = min(max(q[k] + step[k], lower[k]), upper[k])


@lean_kernel
def project(table, inner, space, quaternions, q, work):
    """Move a configuration ``(nq,)`` to where all conditions are held with room; tell whether.

    ``inner`` are inner bounds ``(c, 3)``, lower and upper, and the room ``(c,)`` from there to the
    bounds. ``space`` are four arrays ``(nq,)``: which positions may move, which are angles, and
    limits, infinite for the entries of quaternions, which begin at ``quaternions`` ``(k,)``.
    ``work`` are arrays of rows ``(3 c, nq)``, ``(3 c,)``, of chains ``(e, 3, 3)`` and ``(e, 3)``,
    and ``(3 c, 3 c)``, ``(3 c,)``, ``(nq,)``.
    """
    for _ in range(_STEPS):
        rows, is_enough = _linearized(table, inner, q, work)
        if is_enough:
            return True
        if not _step(space, q, rows, work):
            return False
        _go(space, quaternions, q, work[6])
    return False
