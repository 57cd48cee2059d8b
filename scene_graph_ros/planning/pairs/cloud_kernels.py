"""Which configurations keep their distance from clouds that do not move."""

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.compiled.lanes import (
    LANES,
    larger,
    load_lanes,
    lowest_bit,
    magnitude,
    smaller,
    store_lanes,
)
from scene_graph_ros.geometry.query.elements.element_places import tree_of
from scene_graph_ros.planning.pairs.bodies import place_bodies
from scene_graph_ros.planning.pairs.cloud_grid import lanes_near, may_be_near
from scene_graph_ros.planning.pairs.cloud_scan import any_near
from scene_graph_ros.robots.tree_kernels import LANES as CONFIGURATIONS

__all__ = [
    "body_in_cloud",
    "box_of",
    "box_of_lanes",
    "check_clouds",
    "joined_lanes",
    "place_in_cloud",
]


@inlined_kernel
def place_in_cloud(bodies, places, X, scratch):
    """Write where robots' bodies, and boxes around them, are in a cloud's frame, in lanes."""
    for a in range(len(bodies.joints)):
        own, out, box = places.X_WG[a], scratch.X_CG[a], scratch.boxes[a]
        lower, upper = bodies.lower[a], bodies.upper[a]
        for row in range(3):
            x, y, z = X[row, 0], X[row, 1], X[row, 2]
            for column in range(4):
                at = column * LANES
                value = load_lanes(own, at) * x + load_lanes(own, at + 4 * LANES) * y
                value = value + load_lanes(own, at + 8 * LANES) * z
                if column == 3:
                    value = value + X[row, 3]
                store_lanes(out, at + 4 * row * LANES, value)
        for row in range(3):
            at = 4 * row * LANES
            r0, r1 = load_lanes(out, at), load_lanes(out, at + LANES)
            r2 = load_lanes(out, at + 2 * LANES)
            center = r0 * (0.5 * (lower[0] + upper[0])) + r1 * (0.5 * (lower[1] + upper[1]))
            center = center + r2 * (0.5 * (lower[2] + upper[2]))
            half = magnitude(r0) * (0.5 * (upper[0] - lower[0]))
            half = half + magnitude(r1) * (0.5 * (upper[1] - lower[1]))
            half = half + magnitude(r2) * (0.5 * (upper[2] - lower[2]))
            store_lanes(box, row * LANES, center + load_lanes(out, at + 3 * LANES))
            store_lanes(box, (3 + row) * LANES, half)


@inlined_kernel
def box_of(scratch, a, k, need):
    """Return the corners of a body's box in configuration k, larger by ``need``."""
    box = scratch.boxes[a]
    x, y, z = box[3, k] + need, box[4, k] + need, box[5, k] + need
    return (
        (box[0, k] - x, box[1, k] - y, box[2, k] - z),
        (box[0, k] + x, box[1, k] + y, box[2, k] + z),
    )


@inlined_kernel
def body_in_cloud(bodies, table, scratch, a, k):
    """Return the arguments of ``any_near`` for a body in configuration k.

    That is (rotation in C, its entries' sizes, its box's centre in C and in G, where its planes
    begin and end, its box's half extents, its row of the shape table, what is inside).
    """
    X, lower, upper = scratch.X_CG[a], bodies.lower[a], bodies.upper[a]
    R = (
        X[0, k], X[1, k], X[2, k], X[4, k], X[5, k], X[6, k], X[8, k], X[9, k], X[10, k]
    )  # fmt: skip
    M = (
        abs(R[0]), abs(R[1]), abs(R[2]), abs(R[3]), abs(R[4]), abs(R[5]), abs(R[6]), abs(R[7]),
        abs(R[8]),
    )  # fmt: skip
    box = scratch.boxes[a]
    center = (
        0.5 * (lower[0] + upper[0]),
        0.5 * (lower[1] + upper[1]),
        0.5 * (lower[2] + upper[2]),
    )
    half = (
        0.5 * (upper[0] - lower[0]),
        0.5 * (upper[1] - lower[1]),
        0.5 * (upper[2] - lower[2]),
    )
    middle = box[0, k], box[1, k], box[2, k]
    first, last = table.plane_starts[a], table.plane_starts[a + 1]
    own = table.inner[a]
    inside = own[0], own[1], own[2], own[3]
    return R, M, middle, center, first, last, half, bodies.rows[a], inside


@inlined_kernel
def box_of_lanes(scratch, a, need):
    """Return the corners of a body's boxes, larger by ``need``, in lanes."""
    box = scratch.boxes[a]
    x, y, z = load_lanes(box, 0), load_lanes(box, LANES), load_lanes(box, 2 * LANES)
    u, v = load_lanes(box, 3 * LANES) + need, load_lanes(box, 4 * LANES) + need
    w = load_lanes(box, 5 * LANES) + need
    return (x - u, y - v, z - w), (x + u, y + v, z + w)


@inlined_kernel
def joined_lanes(one, other):
    """Return the corners of boxes around two, in lanes."""
    (a, b), (c, d) = one, other
    return (
        (smaller(a[0], c[0]), smaller(a[1], c[1]), smaller(a[2], c[2])),
        (larger(b[0], d[0]), larger(b[1], d[1]), larger(b[2], d[2])),
    )


@inlined_kernel
def _lanes_of_group(table, scratch, tree, c, group, bits):
    """Return those of the bits of configurations in which a group may be near to balls."""
    first, slack = table.groups[group, 0], table.slacks[c]
    box = box_of_lanes(scratch, table.bodies[first], table.paddings[first] + slack)
    for m in range(first + 1, table.groups[group, 1]):
        own = box_of_lanes(scratch, table.bodies[m], table.paddings[m] + slack)
        box = joined_lanes(box, own)
    return lanes_near(tree, table, c, box[0], box[1], bits)


@inlined_kernel
def _first_in_group(held, bodies, table, scratch, tree, c, group, k, found, places):
    """Return the first pair of a group that is too near in configuration k, else ``found``."""
    slack = table.slacks[c]
    for m in range(table.groups[group, 0], table.groups[group, 1]):
        if table.pairs[m] >= found:
            continue
        a, need = table.bodies[m], table.paddings[m] + slack
        lower, upper = box_of(scratch, a, k, need)
        if not may_be_near(tree, table, c, lower, upper):
            continue
        body, where = body_in_cloud(bodies, table, scratch, a, k), (places, table, c, k)
        limit = table.paddings[m] - table.touching[m]
        if any_near(held, tree, body, where, need, limit, True, scratch.guesses, a):
            found = table.pairs[m]
    return found


@lean_kernel
def check_clouds(held, tree, bodies, table, q, X_WB, first_pair, places, scratch):
    """Write the first pair that is nearer than its padding where it comes before the one written.

    That is a pair of a plan; where none is too near, ``first_pair`` has a number above all.
    """
    for first in range(0, len(q), CONFIGURATIONS):
        place_bodies(tree, bodies, q, first, X_WB, places)
        every_one = (1 << min(CONFIGURATIONS, len(q) - first)) - 1
        for c in range(len(table.clouds)):
            place_in_cloud(bodies, places, table.X_CW[c], scratch)
            points = tree_of(held, table.clouds[c, 0])
            for group in range(table.clouds[c, 1], table.clouds[c, 2]):
                bits = _lanes_of_group(table, scratch, points, c, group, every_one)
                while bits != 0:
                    k = lowest_bit(bits)
                    bits &= bits - 1
                    found = first_pair[first + k]
                    first_pair[first + k] = _first_in_group(
                        held, bodies, table, scratch, points, c, group, k, found, places
                    )
