"""Points against shapes of one kind, so many at once that the processor computes some in step.

A lane is a point Q in the frame G of a shape. The numbers of all lanes are in one array, number k
of lane j at ``k * LANES + j``, with constant strides, so that the compiler sees that nothing
overlaps and vectorizes loops over lanes whose body has no branch. An answer does not depend on
the lanes beside it, and is bit for bit that of the kernel for one point: arithmetic is IEEE's.
"""

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.compiled.places import LAST_PLACE
from scene_graph_ros.geometry.compiled.vector_width import use_widest_vectors
from scene_graph_ros.geometry.query.point.lane_memory import LANES
from scene_graph_ros.geometry.query.point.lanes_to_rows import SQUARE, take_square
from scene_graph_ros.geometry.spatial.vectors import rotate, rotate_inverse, subtract

__all__ = [
    "enter_frame",
    "enter_frames",
    "keep_answer",
    "keep_answers",
    "leave_frames",
    "p_GQ_of_lane",
    "question",
    "read_lane",
    "set_answer",
    "set_triple",
    "take_poses",
    "triple",
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


@inlined_kernel
def p_GQ_of_lane(points, j, R_WG, p_WG):
    """Return the point of a lane, p_WQ, the first triple in ``points``, in the frame G."""
    return rotate_inverse(R_WG, subtract(triple(points, 0, j), p_WG))


@lean_kernel
def enter_frame(lanes, points, size, R_WG, p_WG):
    """Ask all lanes about one shape and a point each, p_WQ, the first triple in ``points``."""
    use_widest_vectors()
    for j in range(LANES):
        write_lane(lanes, j, size, p_GQ_of_lane(points, j, R_WG, p_WG))


@inlined_kernel
def keep_answer(answers, first, j, R_WG, answer):
    """Write a lane's answer (phi, p_GN, grad_G, unique), the gradient expressed in W."""
    phi, p_GN, grad_G, unique = answer
    answers[first + j] = phi
    set_triple(answers, first + LANES, j, p_GN)
    set_triple(answers, first + 4 * LANES, j, rotate(R_WG, grad_G))
    answers[first + 7 * LANES + j] = 1.0 if unique else 0.0


@lean_kernel
def keep_answers(lanes, R_WG, answers, first):
    """Write all lanes' answers from ``answers[first]`` on, the gradients expressed in W.

    They are phi, p_GN, grad_W, and 1 or 0 for unique or not, each for all lanes.
    """
    use_widest_vectors()
    first &= LAST_PLACE
    for j in range(LANES):
        keep_answer(answers, first, j, R_WG, read_lane(lanes, j))


@inlined_kernel
def question(lanes, j):
    """Return what lane j is asked: (size, p_GQ)."""
    return triple(lanes, _SIZE, j), triple(lanes, _POINT, j)


@inlined_kernel
def set_answer(lanes, j, answer):
    """Set what lane j answers: (phi, p_GN, grad_G, unique)."""
    phi, p_GN, grad_G, unique = answer
    lanes[_PHI + j] = phi
    set_triple(lanes, _NEAREST, j, p_GN)
    set_triple(lanes, _GRADIENT, j, grad_G)
    lanes[_UNIQUE + j] = 1.0 if unique else 0.0
