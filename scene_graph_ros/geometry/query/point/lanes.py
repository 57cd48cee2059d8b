"""Points against shapes of one kind, so many at once that the processor computes some in step.

A lane is a point Q in the frame G of a shape. The numbers of all lanes are in one array, number k
of lane j at ``k * LANES + j``, with constant strides, so that the compiler sees that nothing
overlaps and vectorizes loops over lanes whose body has no branch. An answer does not depend on
the lanes beside it, and is bit for bit that of the kernel for one point: arithmetic is IEEE's.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.compiled.lanes import load_lanes, load_wide, select, store_lanes
from scene_graph_ros.geometry.compiled.vector_width import use_widest_vectors
from scene_graph_ros.geometry.query.point.lane_memory import LANES
from scene_graph_ros.geometry.query.point.lanes_to_rows import SQUARE, take_square
from scene_graph_ros.geometry.spatial.vectors import rotate, rotate_inverse, subtract

__all__ = [
    "Asked",
    "eight_questions",
    "enter_frames",
    "is_answered",
    "is_done",
    "keep_answer",
    "keep_wide_answers",
    "leave_frames",
    "p_GQ_of_lane",
    "question",
    "read_lane",
    "set_answer",
    "set_eight_answers",
    "set_triple",
    "take_poses",
    "triple",
    "wide_p_GQ",
    "write_lane",
]

_POINT, _SIZE, _PHI, _NEAREST, _GRADIENT, _UNIQUE = (LANES * k for k in (0, 3, 6, 7, 10, 13))


@inlined_kernel
def triple(lanes, first, j):
    """Return three numbers of lane j."""
    return (lanes[first + j], lanes[first + LANES + j], lanes[first + 2 * LANES + j])


@inlined_kernel
def set_triple(lanes, first, j, v):
    """Set three numbers of lane j."""
    lanes[first + j] = v[0]
    lanes[first + LANES + j] = v[1]
    lanes[first + 2 * LANES + j] = v[2]


@inlined_kernel
def write_lane(lanes, j, size, p_GQ):
    """Ask lane j about a point and a shape's size."""
    set_triple(lanes, _POINT, j, p_GQ)
    set_triple(lanes, _SIZE, j, size)


@inlined_kernel
def read_lane(lanes, j):
    """Return (phi, p_GN, grad_G, unique) of lane j."""
    unique = lanes[_UNIQUE + j] != 0.0
    return lanes[_PHI + j], triple(lanes, _NEAREST, j), triple(lanes, _GRADIENT, j), unique


@inlined_kernel
def _of_tile(numbers, tile, first, j):
    """Return three numbers of lane j of a tile: its row is looked up once for all lanes."""
    return (
        numbers[tile, first + j],
        numbers[tile, first + LANES + j],
        numbers[tile, first + 2 * LANES + j],
    )


@lean_kernel
def take_poses(X_WG, rows, tile, poses):
    """Write the poses of the rows of a tile as lanes: their first three rows, number by number."""
    for j in range(0, LANES, SQUARE):
        take_square(X_WG, rows, tile, j, 0, poses, j)
        take_square(X_WG, rows, tile, j, SQUARE, poses, SQUARE * LANES + j)


@inlined_kernel
def _rotation(poses, j):
    x, y = triple(poses, 0, j), triple(poses, 4 * LANES, j)
    z = triple(poses, 8 * LANES, j)
    return (x[0], x[1], x[2], y[0], y[1], y[2], z[0], z[1], z[2])


@lean_kernel
def enter_frames(lanes, sizes, tile, poses, p_WQ):
    """Ask each lane about a point and a shape of a tile, whose sizes and poses are given."""
    use_widest_vectors()
    for j in range(LANES):
        p_WG = (poses[3 * LANES + j], poses[7 * LANES + j], poses[11 * LANES + j])
        p_GQ = rotate_inverse(_rotation(poses, j), subtract(p_WQ, p_WG))
        write_lane(lanes, j, _of_tile(sizes, tile, 0, j), p_GQ)


@lean_kernel
def leave_frames(lanes, poses):
    """Express the answers' gradients in W."""
    use_widest_vectors()
    for j in range(LANES):
        gradient = rotate(_rotation(poses, j), triple(lanes, _GRADIENT, j))
        set_triple(lanes, _GRADIENT, j, gradient)


class Asked(NamedTuple):
    """All lanes, asked about one shape: points Q in the world, and where answers are kept."""

    R_WG: Any
    """Nine numbers: the shape's rotation."""
    p_WG: Any
    """Three numbers (m): where it is."""
    points: NDArray[np.float64]
    """p_WQ of all lanes, the first triple."""
    answers: NDArray[np.float64]
    """Of each lane eight numbers: phi, p_GN, grad_W, and 1 or 0 for unique or not."""
    first: int
    """Where in ``answers`` those about this shape begin."""


@inlined_kernel
def p_GQ_of_lane(asked, j):
    """Return the point of lane j in the frame G."""
    return rotate_inverse(asked.R_WG, subtract(triple(asked.points, 0, j), asked.p_WG))


@inlined_kernel
def keep_answer(asked, j, answer):
    """Write the answer (phi, p_GN, grad_G, unique) of lane j, its gradient expressed in W."""
    phi, p_GN, grad_G, unique = answer
    answers, first = asked.answers, asked.first
    answers[first + j] = phi
    set_triple(answers, first + LANES, j, p_GN)
    set_triple(answers, first + 4 * LANES, j, rotate(asked.R_WG, grad_G))
    answers[first + 7 * LANES + j] = 1.0 if unique else 0.0


@inlined_kernel
def is_done(asked, j):
    """Tell whether the value written for lane j is its answer: unique, as all in lanes are."""
    return asked.answers[asked.first + 7 * LANES + j] != 0.0


@inlined_kernel
def _load_wide(numbers, at):
    x, y = load_wide(numbers, at), load_wide(numbers, at + LANES)
    return x, y, load_wide(numbers, at + 2 * LANES)


@inlined_kernel
def _load_eight(numbers, at):
    x, y = load_lanes(numbers, at), load_lanes(numbers, at + LANES)
    return x, y, load_lanes(numbers, at + 2 * LANES)


@inlined_kernel
def _store_wide(numbers, at, v):
    store_lanes(numbers, at, v[0])
    store_lanes(numbers, at + LANES, v[1])
    store_lanes(numbers, at + 2 * LANES, v[2])


@inlined_kernel
def wide_p_GQ(asked, lane):
    """Return the points of wide lanes, from ``lane`` on, in the frame G."""
    return rotate_inverse(asked.R_WG, subtract(_load_wide(asked.points, lane), asked.p_WG))


@inlined_kernel
def keep_wide_answers(asked, lane, answer):
    """Write the answers of wide lanes, from ``lane`` on, as ``keep_answer`` does."""
    phi, p_GN, grad_G, unique = answer
    answers, first = asked.answers, asked.first + lane
    store_lanes(answers, first, phi)
    _store_wide(answers, first + LANES, p_GN)
    _store_wide(answers, first + 4 * LANES, rotate(asked.R_WG, grad_G))
    store_lanes(answers, first + 7 * LANES, select(unique, 1.0, 0.0))


@inlined_kernel
def eight_questions(lanes, lane):
    """Return the questions of eight lanes, from ``lane`` on: (size, p_GQ)."""
    return _load_eight(lanes, _SIZE + lane), _load_eight(lanes, _POINT + lane)


@inlined_kernel
def set_eight_answers(lanes, lane, answer):
    """Set the answers of eight lanes, from ``lane`` on, as ``set_answer`` does."""
    phi, p_GN, grad_G, unique = answer
    store_lanes(lanes, _PHI + lane, phi)
    _store_wide(lanes, _NEAREST + lane, p_GN)
    _store_wide(lanes, _GRADIENT + lane, grad_G)
    store_lanes(lanes, _UNIQUE + lane, select(unique, 1.0, 0.0))


@inlined_kernel
def is_answered(lanes, j):
    """Tell whether lane j has its answer: unique, as all that are found in lanes."""
    return lanes[_UNIQUE + j] != 0.0


@inlined_kernel
def question(lanes, j):
    """Return the question of lane j: (size, p_GQ)."""
    return triple(lanes, _SIZE, j), triple(lanes, _POINT, j)


@inlined_kernel
def set_answer(lanes, j, answer):
    """Set the answer of lane j: (phi, p_GN, grad_G, unique)."""
    phi, p_GN, grad_G, unique = answer
    lanes[_PHI + j] = phi
    set_triple(lanes, _NEAREST, j, p_GN)
    set_triple(lanes, _GRADIENT, j, grad_G)
    lanes[_UNIQUE + j] = 1.0 if unique else 0.0
