"""Descents from configurations to a tool's poses, eight at a time.

Each lane is a descent of its own, by steps of Levenberg and Marquardt that are damped in
proportion to the squared error, which needs no care at singular configurations (Sugihara,
*Solvability-Unconcerned Inverse Kinematics by the Levenberg-Marquardt Method*, 2011). Coordinates
at a limit that the gradient pushes outward are held (Bertsekas, *Projected Newton Methods for
Optimization Problems with Simple Constraints*, 1982). The turn that is left is measured by
modified Rodrigues parameters, four times the tangent of a quarter of its angle along its axis,
which are smooth up to a whole turn. A lane whose descent is over takes up the next one, and lanes
do not depend on each other: so a descent ends at the same bits with any others beside it.

Lengths are in the unit of the chain. Notation: B is the robot's base, T the tool, G the pose asked
for.
"""

import math
from typing import NamedTuple

import numpy as np

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, kernel, lean_kernel
from scene_graph_ros.geometry.compiled.lanes import (
    any_of,
    every,
    LANES,
    larger,
    load_lanes,
    magnitude,
    root,
    select,
    smaller,
    store_lanes,
)
from scene_graph_ros.planning.ik.chain_kernels import place_tool, quaternion_product
from scene_graph_ros.planning.ik.lane_equations import solve_in_place

__all__ = ["Descents", "descend"]

_LONGEST = 0.8
"""rad: the change of an angle in a step at most."""

_FIRST_DAMPING = 1e-2
"""Times the squared error, at the start of a descent."""

_MOST_DAMPING = 1e7
"""Where as much is needed no step helps."""

_LESS_DAMPING = 1e-8
"""With less, rounding of the equations would show where the error cannot vanish."""

_LEAST = 1e-13
"""Keeps equations solvable where a coordinate does not move the tool."""

_WINDOW = 6
"""Steps in which the squared error must fall by half, or a descent is given up."""

_PULLED = 25
"""Steps in which a descent is pulled towards home at most."""

_SETTLED = 0.9
"""A pulled descent whose error falls less in a step is where it is pulled to."""

_SERIES = 11
"""Terms of the arctangent's series below tan(pi / 16), for 1e-17."""


class Descents(NamedTuple):
    """The inputs of d descents to m goals."""

    goals: np.ndarray
    """``(m, 7)``: quaternions, w first, and places in B."""
    rows: np.ndarray
    """``(d,)``: to which goal."""
    starts: np.ndarray
    """``(d, n)``."""
    homes: np.ndarray
    """``(d, n)``: those that are pulled shall end as near to it as they can."""
    pulls: np.ndarray
    """``(d,)``: how strongly at first; 0 for not at all."""
    weights: np.ndarray
    """``(n,)``: how much of that each coordinate is pulled."""
    lower: np.ndarray
    """``(n,)``: held at all times, as ``upper``."""
    upper: np.ndarray
    longest: np.ndarray
    """``(n,)``: one over the length of a step at most; 0 for any."""
    allowed: np.ndarray
    """``(2,)``: tolerances that are used up, of the turn and the way, as sizes of residuals."""
    limits: np.ndarray
    """``(2,)``: where a descent is over, squared."""
    steps: int
    """After so many it is given up."""
    is_patient: bool
    """It is not given up sooner, where it hardly goes on."""


class _State(NamedTuple):
    """Where eight descents are: at ``x``, from where they try ``t``."""

    x: np.ndarray
    t: np.ndarray
    home: np.ndarray
    goal: np.ndarray
    e: np.ndarray
    """``(6, LANES)``: the residual at x, and its Jacobian ``(6, n, LANES)``."""
    J: np.ndarray
    numbers: np.ndarray
    """``(12, LANES)``; see below."""
    jobs: np.ndarray
    """``(LANES,)``: which descent it is; -1 for none."""
    done: np.ndarray
    """``(LANES,)``: its steps."""


# Rows of a state's numbers: what was found at t (of the turn, the way and both, squared), the same
# at x, the error at x with the pull's part, the damping, the pull, the amount on the diagonal,
# the error some steps ago, and 1 for a descent that has not begun.
(_TURN_T, _WAY_T, _LEFT_T, _TURN, _WAY, _LEFT, _ERROR, _DAMPING, _PULL, _AMOUNT, _MARK, _FRESH) = (
    range(12)
)


@inlined_kernel
def _jacobian(chain, axes, origins, p, J, n):
    """Write the Jacobian ``(6, n, LANES)`` of the tool: turning, then sliding, in B."""
    for i in range(6 * n):
        store_lanes(J, i * LANES, every(0.0))
    for i in range(len(chain.slides)):
        column, factor, at = chain.columns[i], chain.multipliers[i], 3 * i * LANES
        if column < 0:
            continue
        ax, ay = load_lanes(axes, at), load_lanes(axes, at + LANES)
        az = load_lanes(axes, at + 2 * LANES)
        if chain.slides[i]:
            added = (every(0.0), every(0.0), every(0.0), ax, ay, az)
        else:
            rx, ry = p[0] - load_lanes(origins, at), p[1] - load_lanes(origins, at + LANES)
            rz = p[2] - load_lanes(origins, at + 2 * LANES)
            added = (ax, ay, az, ay * rz - az * ry, az * rx - ax * rz, ax * ry - ay * rx)
        for row in range(6):
            place = (row * n + column) * LANES
            store_lanes(J, place, load_lanes(J, place) + factor * added[row])


@inlined_kernel
def _left(size_squared, tolerance):
    """Return the part of a residual of that size, squared, that is beyond a tolerance."""
    size = root(size_squared)
    return larger(1.0 - tolerance / larger(size, every(1e-300)), every(0.0))


@inlined_kernel
def _shrink(J, n, first, v, share, size_squared):
    """Make three rows of J those of the excess over a tolerance: of length and of direction."""
    s = 1.0 / larger(size_squared, every(1e-300))
    # Along v the residual changes as it did, across it as far as it is still there.
    is_out = select(share > 0.0, every(1.0), every(0.0))
    for column in range(n):
        at, row = (first * n + column) * LANES, n * LANES
        a, b, c = load_lanes(J, at), load_lanes(J, at + row), load_lanes(J, at + 2 * row)
        along = (is_out - share) * s * (a * v[0] + b * v[1] + c * v[2])
        store_lanes(J, at, share * a + along * v[0])
        store_lanes(J, at + row, share * b + along * v[1])
        store_lanes(J, at + 2 * row, share * c + along * v[2])


@inlined_kernel
def _evaluate(chain, goal, x, tolerances, axes, origins, work, J, e, n):
    """Write the residual ``(6, LANES)`` and its Jacobian at x; return three squared sizes.

    Those of the turn's Rodrigues parameters, of the way, and of the residual.
    """
    Q, p = place_tool(chain, x, axes, origins, work)
    _jacobian(chain, axes, origins, p, J, n)
    G = (
        load_lanes(goal, 0),
        load_lanes(goal, LANES),
        load_lanes(goal, 2 * LANES),
        load_lanes(goal, 3 * LANES),
    )
    w, a, b, c = quaternion_product(G, (Q[0], -Q[1], -Q[2], -Q[3]))
    scale = 4.0 / (1.0 + magnitude(w))
    scale = select(w < 0.0, -scale, scale)
    r = scale * a, scale * b, scale * c
    d = (
        load_lanes(goal, 4 * LANES) - p[0],
        load_lanes(goal, 5 * LANES) - p[1],
        load_lanes(goal, 6 * LANES) - p[2],
    )
    turn, way = r[0] * r[0] + r[1] * r[1] + r[2] * r[2], d[0] * d[0] + d[1] * d[1] + d[2] * d[2]
    left = turn + way
    if tolerances[0] > 0.0:
        share = _left(turn, tolerances[0])
        _shrink(J, n, 0, r, share, turn)
        r = share * r[0], share * r[1], share * r[2]
        left = share * share * turn + way
    if tolerances[1] > 0.0:
        share = _left(way, tolerances[1])
        _shrink(J, n, 3, d, share, way)
        d = share * d[0], share * d[1], share * d[2]
        left = r[0] * r[0] + r[1] * r[1] + r[2] * r[2] + share * share * way
    for m in range(3):
        store_lanes(e, m * LANES, r[m])
        store_lanes(e, (3 + m) * LANES, d[m])
    return turn, way, left


@inlined_kernel
def _equations(task, state, H, g, A, held, n):
    """Write ``J^T J + damping`` by rows below its diagonal, and ``J^T e``, of moving ones."""
    J, e, is_any_held = state.J, state.e, False
    pull = load_lanes(state.numbers, _PULL * LANES)
    amount = load_lanes(state.numbers, _AMOUNT * LANES)
    for j in range(n):
        here = load_lanes(state.x, j * LANES)
        total = pull * task.weights[j] * (load_lanes(state.home, j * LANES) - here)
        for row in range(6):
            total = total + load_lanes(J, (row * n + j) * LANES) * load_lanes(e, row * LANES)
        lower, upper = task.lower[j], task.upper[j]
        is_held = ((here <= lower) & (total < 0.0)) | ((here >= upper) & (total > 0.0))
        store_lanes(g, j * LANES, select(is_held, every(0.0), total))
        store_lanes(held, j * LANES, select(is_held, every(0.0), every(1.0)))
        if any_of(is_held):
            is_any_held = True
    if is_any_held:
        for j in range(6 * n):
            entry = load_lanes(J, j * LANES) * load_lanes(held, (j % n) * LANES)
            store_lanes(A, j * LANES, entry)
    A = A if is_any_held else J
    for i in range(n):
        for j in range(i + 1):
            total = load_lanes(A, i * LANES) * load_lanes(A, j * LANES)
            for row in range(1, 6):
                at = row * n
                total = total + load_lanes(A, (at + i) * LANES) * load_lanes(A, (at + j) * LANES)
            if i == j:
                total = total + amount + pull * task.weights[i]
            store_lanes(H, (i * (i + 1) // 2 + j) * LANES, total)


@inlined_kernel
def _step(task, state, g, n):
    """Write x and the step g, shortened and within limits, to t, but for fresh lanes."""
    most = every(1.0)
    for j in range(n):
        most = larger(magnitude(load_lanes(g, j * LANES)) * task.longest[j], most)
    scale, stays = 1.0 / most, load_lanes(state.numbers, _FRESH * LANES) > 0.0
    for j in range(n):
        at = j * LANES
        moved = load_lanes(state.x, at) + scale * load_lanes(g, at)
        moved = larger(smaller(moved, every(task.upper[j])), every(task.lower[j]))
        store_lanes(state.t, at, select(stays, load_lanes(state.t, at), moved))


@lean_kernel
def _angle(squared):
    """Return the angle (rad) of a turn, of the squared size of its Rodrigues parameters."""
    u = 0.25 * math.sqrt(squared)
    for _ in range(2):
        u = u / (1.0 + math.sqrt(1.0 + u * u))
    total, square = 0.0, u * u
    for k in range(_SERIES - 1, -1, -1):
        term = 1.0 / (2 * k + 1)
        total = (term if k % 2 == 0 else -term) + square * total
    return 16.0 * u * total


@inlined_kernel
def _load(task, state, k, job, n):
    """Put the start of a descent into lane k; of none, if there is none."""
    numbers = state.numbers
    numbers[_ERROR, k], numbers[_FRESH, k], numbers[_AMOUNT, k] = np.inf, 1.0, 1.0
    if job >= len(task.rows):
        state.jobs[k] = -1
        return
    state.jobs[k], row = job, task.rows[job]
    numbers[_PULL, k] = task.pulls[job]
    for j in range(n):
        state.t[j, k], state.home[j, k] = task.starts[job, j], task.homes[job, j]
    for i in range(7):
        state.goal[i, k] = task.goals[row, i]


@inlined_kernel
def _measure(task, state, turn, way, left, n):
    """Note the error at t, and return the error with the pull's part."""
    store_lanes(state.numbers, _TURN_T * LANES, turn)
    store_lanes(state.numbers, _WAY_T * LANES, way)
    store_lanes(state.numbers, _LEFT_T * LANES, left)
    total = every(0.0)
    for j in range(n):
        gap = load_lanes(state.home, j * LANES) - load_lanes(state.t, j * LANES)
        total = total + task.weights[j] * gap * gap
    return left + load_lanes(state.numbers, _PULL * LANES) * total


@inlined_kernel
def _take(state, J_t, e_t, error, n):
    """Take over values that are better than before."""
    is_better = error < load_lanes(state.numbers, _ERROR * LANES)
    for j in range(n):
        at = j * LANES
        here = select(is_better, load_lanes(state.t, at), load_lanes(state.x, at))
        store_lanes(state.x, at, here)
    for j in range(6):
        at = j * LANES
        here = select(is_better, load_lanes(e_t, at), load_lanes(state.e, at))
        store_lanes(state.e, at, here)
    for j in range(6 * n):
        at = j * LANES
        here = select(is_better, load_lanes(J_t, at), load_lanes(state.J, at))
        store_lanes(state.J, at, here)


@inlined_kernel
def _count(state, k, error):
    """Note that lane k is where it tried to be, if that is better, and set its damping."""
    numbers = state.numbers
    if not error < numbers[_ERROR, k]:
        numbers[_DAMPING, k] *= 8.0
    else:
        for i in range(3):
            numbers[_TURN + i, k] = numbers[_TURN_T + i, k]
        if numbers[_FRESH, k] > 0.0:
            numbers[_DAMPING, k], numbers[_MARK, k], state.done[k] = _FIRST_DAMPING, error, 0
            numbers[_FRESH, k] = 0.0
        else:
            numbers[_DAMPING, k] = max(0.25 * numbers[_DAMPING, k], _LESS_DAMPING)
        numbers[_ERROR, k] = error
    state.done[k] += 1


@inlined_kernel
def _is_over(task, state, k, before):
    """Tell whether the descent in lane k is over; ``before`` is its error before its last step.

    One that is pulled, and is as near to home as it can be, goes the rest of the way the shortest
    way.
    """
    numbers, done = state.numbers, state.done[k]
    if numbers[_PULL, k] > 0.0:
        if numbers[_ERROR, k] > _SETTLED * before or done >= _PULLED:
            numbers[_PULL, k], numbers[_ERROR, k] = 0.0, numbers[_LEFT, k]
            numbers[_MARK, k], numbers[_DAMPING, k] = np.inf, _FIRST_DAMPING
        return False
    if numbers[_TURN, k] <= task.limits[0] and numbers[_WAY, k] <= task.limits[1]:
        return True
    if done > task.steps or not numbers[_DAMPING, k] < _MOST_DAMPING:
        return True
    if done % _WINDOW > 0:
        return False
    is_slow = numbers[_ERROR, k] > 0.5 * numbers[_MARK, k]
    numbers[_MARK, k] = numbers[_ERROR, k]
    return is_slow and not task.is_patient


@inlined_kernel
def _finish(state, k, ends, errors, n):
    """Write where the descent in lane k is."""
    job, numbers = state.jobs[k], state.numbers
    for j in range(n):
        ends[job, j] = state.x[j, k]
    errors[job, 0], errors[job, 1] = math.sqrt(numbers[_WAY, k]), _angle(numbers[_TURN, k])


@kernel
def descend(chain, task, ends, errors):
    """Write where descents end, ``ends`` ``(d, n)``, and ``errors`` ``(d, 2)`` of way and turn."""
    n, count, total = task.starts.shape[1], len(chain.slides), len(task.rows)
    axes, origins = np.empty((count, 3, LANES)), np.empty((count, 3, LANES))
    work, e_t = np.empty((3, LANES)), np.empty((6, LANES))
    J_t, A = np.empty((6, n, LANES)), np.empty((6, n, LANES))
    H, g = np.empty((n * (n + 1) // 2, LANES)), np.empty((n, LANES))
    v, inverse = np.empty((n, LANES)), np.empty((n, LANES))
    state = _State(
        *(np.zeros((n, LANES)), np.zeros((n, LANES)), np.zeros((n, LANES)), np.zeros((7, LANES))),
        *(np.zeros((6, LANES)), np.zeros((6, n, LANES)), np.zeros((12, LANES))),
        *(np.full(LANES, -1), np.zeros(LANES, dtype=np.int64)),
    )
    state.goal[0] = 1.0
    next_job = 0
    for k in range(LANES):
        _load(task, state, k, next_job, n)
        next_job += 1
    finished = 0
    while finished < total:
        turn, way, left = _evaluate(
            chain, state.goal, state.t, task.allowed, axes, origins, work, J_t, e_t, n
        )
        error = _measure(task, state, turn, way, left, n)
        _take(state, J_t, e_t, error, n)
        store_lanes(work, 0, error)
        for k in range(LANES):
            if state.jobs[k] < 0:
                continue
            before = state.numbers[_ERROR, k]
            _count(state, k, work[0, k])
            if _is_over(task, state, k, before):
                _finish(state, k, ends, errors, n)
                _load(task, state, k, next_job, n)
                next_job, finished = next_job + 1, finished + 1
            else:
                numbers = state.numbers
                part = numbers[_DAMPING, k] * numbers[_ERROR, k]
                numbers[_AMOUNT, k] = part + _LEAST
        _equations(task, state, H, g, A, v, n)
        solve_in_place(H, g, v, inverse, n)
        _step(task, state, g, n)
