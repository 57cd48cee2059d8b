"""How near elements may be to a shape, at least: boxes of points against the shape's own box."""

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel
from scene_graph_ros.geometry.compiled.lanes import (
    LANES,
    larger,
    load_lanes,
    magnitude,
    root,
    select,
)
from scene_graph_ros.geometry.shapes.kinds import ShapeKind
from scene_graph_ros.geometry.spatial.vectors import load_vector, rotate
from scene_graph_ros.geometry.tables.point_tree import BOX

__all__ = ["box_cover", "cover_of", "from_boxes", "from_centers", "from_points", "signed"]

_HALF_SPACE = int(ShapeKind.HALF_SPACE)

_ROUNDING = 1e-14
"""Of the lengths that are subtracted: more than rounding can add to a bound."""


@inlined_kernel
def cover_of(table, row, R_CB, p_CB):
    """Return the cover for bounds of row B of a shape table at a pose in the cloud's frame.

    That is (rotation, its entries' sizes, B's origin, its box's centre from there in C and in B,
    half extents of the box in B and of one in C, a length for rounding, whether it is a half
    space).
    """
    if table.kind[row] == _HALF_SPACE:
        zero, sizes = (0.0, 0.0, 0.0), _sizes(R_CB)
        return R_CB, sizes, p_CB, zero, zero, zero, zero, 0.0, True
    lower, upper = load_vector(table.lower, row), load_vector(table.upper, row)
    return box_cover(lower, upper, R_CB, p_CB)


@inlined_kernel
def box_cover(lower, upper, R_CB, p_CB):
    """Return the same for a box with these corners in B."""
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
    sizes = _sizes(R_CB)
    turned = rotate(sizes, half)
    length = sum3(turned) + abs(center[0]) + abs(center[1]) + abs(center[2])
    return R_CB, sizes, p_CB, rotate(R_CB, center), center, half, turned, length, False


@inlined_kernel
def sum3(v):
    """Return the sum of a vector's components."""
    return v[0] + v[1] + v[2]


@inlined_kernel
def _sizes(R):
    return (
        abs(R[0]), abs(R[1]), abs(R[2]), abs(R[3]), abs(R[4]), abs(R[5]), abs(R[6]), abs(R[7]),
        abs(R[8]),
    )  # fmt: skip


@inlined_kernel
def signed(x, y, z):
    """Return the distance of boxes with these gaps along three axes; negative: their depth.

    A body is as deep in a box at least as in anything inside of that.
    """
    most = larger(larger(x, y), z)
    bx, by, bz = larger(x, 0.0), larger(y, 0.0), larger(z, 0.0)
    return select(most > 0.0, root(bx * bx + by * by + bz * bz), most)


@inlined_kernel
def from_centers(cover, px, py, pz, qx, qy, qz):
    """Return lower bounds of distances of boxes in C: centres from B's origin, half extents."""
    R, M, _, c_C, c_B, half, turned, length, is_half_space = cover
    size = magnitude(px) + magnitude(py) + magnitude(pz) + (qx + qy + qz)
    if is_half_space:
        height = R[2] * px + R[5] * py + R[8] * pz
        return height - (M[2] * qx + M[5] * qy + M[8] * qz) - _ROUNDING * size
    along_axes = signed(
        magnitude(px - c_C[0]) - qx - turned[0],
        magnitude(py - c_C[1]) - qy - turned[1],
        magnitude(pz - c_C[2]) - qz - turned[2],
    )
    x = R[0] * px + R[3] * py + R[6] * pz
    y = R[1] * px + R[4] * py + R[7] * pz
    z = R[2] * px + R[5] * py + R[8] * pz
    along_own = signed(
        magnitude(x - c_B[0]) - (M[0] * qx + M[3] * qy + M[6] * qz) - half[0],
        magnitude(y - c_B[1]) - (M[1] * qx + M[4] * qy + M[7] * qz) - half[1],
        magnitude(z - c_B[2]) - (M[2] * qx + M[5] * qy + M[8] * qz) - half[2],
    )
    return larger(along_axes, along_own) - _ROUNDING * (size + length)


@inlined_kernel
def from_boxes(boxes, row, cover):
    """Return lower bounds of the signed distances of the balls below a node's children, lanes."""
    p = cover[2]
    at = row * BOX * LANES
    lx, ux = load_lanes(boxes, at) - p[0], load_lanes(boxes, at + 3 * LANES) - p[0]
    ly, uy = load_lanes(boxes, at + LANES) - p[1], load_lanes(boxes, at + 4 * LANES) - p[1]
    lz, uz = load_lanes(boxes, at + 2 * LANES) - p[2], load_lanes(boxes, at + 5 * LANES) - p[2]
    bound = from_centers(
        cover, 0.5 * (lx + ux), 0.5 * (ly + uy), 0.5 * (lz + uz),
        0.5 * (ux - lx), 0.5 * (uy - ly), 0.5 * (uz - lz),
    )  # fmt: skip
    return bound - load_lanes(boxes, at + 6 * LANES)


@inlined_kernel
def from_points(points, leaf, cover):
    """Return lower bounds of the signed distances of a leaf's points, without radii, lanes."""
    p = cover[2]
    at = leaf * 3 * LANES
    x = load_lanes(points, at) - p[0]
    y, z = load_lanes(points, at + LANES) - p[1], load_lanes(points, at + 2 * LANES) - p[2]
    return from_centers(cover, x, y, z, 0.0, 0.0, 0.0)
