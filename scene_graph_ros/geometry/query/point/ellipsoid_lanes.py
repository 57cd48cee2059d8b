"""Points and ellipsoids, so many at once that the processor computes some in step.

Halley's steps are taken in all lanes until none is open, by the arithmetic of ``point_ellipsoid``,
which answers the few lanes where they would not converge fast. Where all lanes are about one
ellipsoid, the part that does not depend on the point is computed once.
"""

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.compiled.lanes import all_of, any_of, select, WIDE
from scene_graph_ros.geometry.compiled.vector_width import use_widest_vectors
from scene_graph_ros.geometry.narrowphase.point_ellipsoid import (
    bracket,
    first_sigma,
    halley_step,
    HALLEY_STEPS,
    is_halley_done,
    is_halley_fast,
    place_plain,
    point_ellipsoid,
    set_up,
    sorted_axes,
)
from scene_graph_ros.geometry.query.point.lane_memory import LANES
from scene_graph_ros.geometry.query.point.lanes import (
    is_done,
    keep_answer,
    keep_wide_answers,
    p_GQ_of_lane,
    question,
    set_answer,
    wide_p_GQ,
)

__all__ = ["answer_ellipsoid", "answer_ellipsoids"]

_SIGMA, _IS_OPEN, _IS_HARD = (LANES * k for k in (19, 20, 21))

_USUAL_STEPS = 2
"""Steps that nearly all points need; then they are taken as long as a lane is open."""


@inlined_kernel
def _step(d, c, sigma, is_open):
    """Return (sigma, is_open) after one step, none where the lane is not open."""
    step = halley_step(c, d, sigma)
    sigma = sigma + step if is_open else sigma
    return sigma, is_open and not is_halley_done(step, sigma)


@inlined_kernel
def _begin(lanes, j, axes, p_GQ):
    """Take the usual steps in lane j; return whether it is open after them, and whether hard."""
    d = axes[4]
    _, c, is_plain = set_up(axes, p_GQ)
    low, high = bracket(c, d)
    is_open = is_plain and is_halley_fast(d, low, high)
    is_hard = not is_open
    sigma = first_sigma(c, d, low, high)
    for _ in range(_USUAL_STEPS):
        sigma, is_open = _step(d, c, sigma, is_open)
    lanes[_SIGMA + j] = sigma
    lanes[_IS_OPEN + j] = 1.0 if is_open else 0.0
    lanes[_IS_HARD + j] = 1.0 if is_hard else 0.0
    return is_open, is_hard


@inlined_kernel
def _go_on(lanes, j, axes, p_GQ):
    """Take a step more in lane j; return whether it is open after it."""
    _, c, _ = set_up(axes, p_GQ)
    sigma, is_open = _step(axes[4], c, lanes[_SIGMA + j], lanes[_IS_OPEN + j] != 0.0)
    lanes[_SIGMA + j] = sigma
    lanes[_IS_OPEN + j] = 1.0 if is_open else 0.0
    return is_open


@inlined_kernel
def _end(lanes, j, axes, p_GQ):
    _, c, _ = set_up(axes, p_GQ)
    set_answer(lanes, j, place_plain(axes, p_GQ, c, lanes[_SIGMA + j]))


@lean_kernel
def _answer_hard(lanes):
    """Answer the lanes that are still open, or never were."""
    for j in range(LANES):
        if lanes[_IS_OPEN + j] != 0.0 or lanes[_IS_HARD + j] != 0.0:
            size, p_GQ = question(lanes, j)
            set_answer(lanes, j, point_ellipsoid(size, p_GQ))


@lean_kernel
def _begin_all(lanes):
    use_widest_vectors()
    open_lanes = hard_lanes = 0
    for j in range(LANES):
        size, p_GQ = question(lanes, j)
        is_open, is_hard = _begin(lanes, j, sorted_axes(size), p_GQ)
        open_lanes += 1 if is_open else 0
        hard_lanes += 1 if is_hard else 0
    return open_lanes, hard_lanes


@lean_kernel
def _go_on_all(lanes):
    use_widest_vectors()
    open_lanes = 0
    for j in range(LANES):
        size, p_GQ = question(lanes, j)
        open_lanes += 1 if _go_on(lanes, j, sorted_axes(size), p_GQ) else 0
    return open_lanes


@lean_kernel
def _end_all(lanes):
    use_widest_vectors()
    for j in range(LANES):
        size, p_GQ = question(lanes, j)
        _end(lanes, j, sorted_axes(size), p_GQ)


@lean_kernel
def answer_ellipsoids(lanes):
    """Answer all lanes, about an ellipsoid each."""
    open_lanes, hard_lanes = _begin_all(lanes)
    for _ in range(HALLEY_STEPS - _USUAL_STEPS):
        if open_lanes == 0:
            break
        open_lanes = _go_on_all(lanes)
    _end_all(lanes)
    if open_lanes + hard_lanes > 0:
        _answer_hard(lanes)


@inlined_kernel
def _wide_step(d, c, sigma, is_open):
    """Do the same as ``_step`` with wide lanes."""
    step = halley_step(c, d, sigma)
    sigma = select(is_open, sigma + step, sigma)
    return sigma, is_open & ~is_halley_done(step, sigma)


@inlined_kernel
def _by_halley(axes, p_GQ):
    """Return (phi, p_GN, grad_G, is_answered) of wide lanes and an ellipsoid."""
    d = axes[4]
    _, c, is_plain = set_up(axes, p_GQ)
    low, high = bracket(c, d)
    is_easy = is_open = is_plain & is_halley_fast(d, low, high)
    sigma = first_sigma(c, d, low, high)
    for _ in range(_USUAL_STEPS):
        sigma, is_open = _wide_step(d, c, sigma, is_open)
    for _ in range(HALLEY_STEPS - _USUAL_STEPS):
        if not any_of(is_open):
            break
        sigma, is_open = _wide_step(d, c, sigma, is_open)
    phi, p_GN, grad_G, _ = place_plain(axes, p_GQ, c, sigma)
    return phi, p_GN, grad_G, is_easy & ~is_open


@lean_kernel
def answer_ellipsoid(asked, size):
    """Answer all lanes about the ellipsoid of this size."""
    use_widest_vectors()
    axes, are_answered = sorted_axes(size), True
    for lane in range(0, LANES, WIDE):
        answer = _by_halley(axes, wide_p_GQ(asked, lane))
        keep_wide_answers(asked, lane, answer)
        if not all_of(answer[3]):
            are_answered = False
    if not are_answered:
        for j in range(LANES):
            if not is_done(asked, j):
                keep_answer(asked, j, point_ellipsoid(size, p_GQ_of_lane(asked, j)))
