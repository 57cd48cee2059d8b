"""Pairs of bodies that are near at a configuration, and how each velocity changes their distance.

Witness points are stationary to first order (envelope theorem): a distance changes as the bodies'
own points there move along the normal.
"""

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.planning.bodies import (
    distance_at,
    place_bodies,
    place_still_bodies,
    sure_distances,
)
from scene_graph_ros.robots.tree_kernels import FLOATING, PLANAR, PRISMATIC

__all__ = ["near_distances"]


@inlined_kernel
def _to_world(X, v, place):
    """Return what a vector, or a point where ``place`` is 1, of a body's frame is in W."""
    return (
        X[0, 0] * v[0] + X[1, 0] * v[1] + X[2, 0] * v[2] + place * X[3, 0],
        X[4, 0] * v[0] + X[5, 0] * v[1] + X[6, 0] * v[2] + place * X[7, 0],
        X[8, 0] * v[0] + X[9, 0] * v[1] + X[10, 0] * v[2] + place * X[11, 0],
    )


@inlined_kernel
def _add_rates(tree, joint, X_WJ, p, nhat, sign, gradient):
    """Add how fast a point that a joint and those below move goes along the normal, in W."""
    while joint > 0:
        kind, column = tree.kinds[joint], tree.velocity_starts[joint]
        X, before, X_PJ = X_WJ[joint], X_WJ[tree.parents[joint]], tree.X_PJ[joint]
        # A point that turns about the axis a at r goes along the normal by a . (r x normal).
        rx, ry, rz = p[0] - X[3, 0], p[1] - X[7, 0], p[2] - X[11, 0]
        mx, my, mz = (
            ry * nhat[2] - rz * nhat[1],
            rz * nhat[0] - rx * nhat[2],
            rx * nhat[1] - ry * nhat[0],
        )
        for axis in range(3):
            # The axes along which it slides are those that it has before it turns.
            u, v, w = X_PJ[0, axis], X_PJ[1, axis], X_PJ[2, axis]
            ax = before[0, 0] * u + before[1, 0] * v + before[2, 0] * w
            ay = before[4, 0] * u + before[5, 0] * v + before[6, 0] * w
            az = before[8, 0] * u + before[9, 0] * v + before[10, 0] * w
            turn = sign * (ax * mx + ay * my + az * mz)
            slide = sign * (ax * nhat[0] + ay * nhat[1] + az * nhat[2])
            if kind == FLOATING:
                gradient[column + axis] += turn
                gradient[column + 3 + axis] += slide
            elif kind == PLANAR:
                gradient[column + axis] += slide if axis < 2 else turn
            elif axis == 2:
                rate = slide if kind == PRISMATIC else turn
                gradient[column] += tree.multipliers[joint] * rate
        joint = tree.parents[joint]


@lean_kernel
def near_distances(
    held, tree, bodies, pairs, q, X_WB, influence, places, rows, distances, gradients
):  # fmt: skip
    """Write the pairs that are near at q ``(1, nq)``; return how many there are.

    ``rows`` ``(p,)`` are pairs that are at most ``influence`` (m) farther apart than their
    padding, ``distances`` ``(p,)`` how far less that, ``gradients`` ``(p, nv)`` derivatives.
    """
    place_still_bodies(bodies, places)
    place_bodies(tree, bodies, q, 0, X_WB, places)
    robots, count = len(bodies.joints), 0
    for p in range(len(pairs.bodies)):
        a, b, limit = pairs.bodies[p, 0], pairs.bodies[p, 1], influence + pairs.paddings[p]
        sure_distances(bodies, a, b, places, limit)
        if places.sure[0] > limit:
            continue
        phi, p_ACa, p_ACb, nhat_A, _, _, _ = distance_at(
            held, bodies, pairs, p, 0, places, max(limit, 0.0), 0.0
        )
        if not phi <= limit:
            continue
        if pairs.swaps[p]:
            a, b = b, a
        X_WA = places.X_WG[a]
        nhat = _to_world(X_WA, nhat_A, 0.0)
        gradient = gradients[count]
        gradient[:] = 0.0
        if a < robots:
            p_WCa = _to_world(X_WA, p_ACa, 1.0)
            _add_rates(tree, bodies.joints[a], places.X_WJ, p_WCa, nhat, 1.0, gradient)
        if b < robots:
            p_WCb = _to_world(X_WA, p_ACb, 1.0)
            _add_rates(tree, bodies.joints[b], places.X_WJ, p_WCb, nhat, -1.0, gradient)
        rows[count], distances[count] = p, phi - pairs.paddings[p]
        count += 1
    return count
