"""Where rays are inside the shapes with closed forms, for eight rays at once.

A ray is ``o + t d`` in the shape's frame G: o, numbers, is the camera's centre, and d, lanes, has
depth 1, so that t is the depth. Each function returns the depths ``(enter, leave)`` between which
a ray is inside; there are none where they are not in this order, or no numbers at all.

Quadratic equations are solved about the point of the ray that is nearest to the centre or axis: a
small shape that is far away then loses no digits.
"""

from scene_graph_ros.geometry.compiled.dispatch import by_kind
from scene_graph_ros.geometry.compiled.kernel import inlined_kernel
from scene_graph_ros.geometry.compiled.lanes import every, magnitude, root, select, with_sign
from scene_graph_ros.geometry.shapes.every_kind import every_kind
from scene_graph_ros.geometry.shapes.kinds import ShapeKind
from scene_graph_ros.geometry.tolerances import EPSILON, INFINITY

__all__ = ["inside_of"]

_ALONG_AXIS = EPSILON * EPSILON
"""Squared sine: a ray this parallel to an axis keeps its distance from it to rounding."""


@inlined_kernel
def _larger(a, b):
    """Return the larger of a and b; b where it is not a number."""
    return select(a > b, a, b)


@inlined_kernel
def _smaller(a, b):
    """Return the smaller of a and b; b where it is not a number."""
    return select(a < b, a, b)


@inlined_kernel
def _slab(half, o, d):
    """Return the interval of a coordinate within ``half`` of 0; never a nan."""
    first, second = (-half - o) / d, (half - o) / d
    enter, leave = _smaller(first, second), _larger(first, second)
    is_level = d == 0.0
    inward = with_sign(INFINITY, half - abs(o) + every(0.0))  # a point on the face is inside
    return select(is_level, -inward, enter), select(is_level, inward, leave)


@inlined_kernel
def _ball(radius, o, d):
    square = d[0] * d[0] + d[1] * d[1] + d[2] * d[2]
    middle = -(o[0] * d[0] + o[1] * d[1] + o[2] * d[2]) / square
    x, y, z = o[0] + middle * d[0], o[1] + middle * d[1], o[2] + middle * d[2]
    half = root((radius * radius - (x * x + y * y + z * z)) / square)
    return middle - half, middle + half


@inlined_kernel
def _sphere(size, o, d):
    return _ball(size[0], o, d)


@inlined_kernel
def _tube(radius, o, d):
    """Return the interval of a ray inside the infinite cylinder about the z axis."""
    square = d[0] * d[0] + d[1] * d[1]
    is_along = square <= _ALONG_AXIS * (d[2] * d[2])
    middle = select(is_along, every(0.0), -(o[0] * d[0] + o[1] * d[1]) / square)
    x, y = o[0] + middle * d[0], o[1] + middle * d[1]
    room = radius * radius - (x * x + y * y)
    half = root(select(is_along, room * INFINITY, room / square))
    return middle - half, middle + half


@inlined_kernel
def _cylinder(size, o, d):
    enter, leave = _tube(size[0], o, d)
    down, up = _slab(size[1], o[2], d[2])
    return _larger(down, enter), _smaller(up, leave)


@inlined_kernel
def _capsule(size, o, d):
    """Return the side where a ray meets it between the ends, else the ball at the nearer end."""
    enter, leave = _tube(size[0], o, d)
    z_enter, z_leave = o[2] + enter * d[2], o[2] + leave * d[2]
    ball_enter, _ = _ball(size[0], (o[0], o[1], o[2] - with_sign(size[1], z_enter)), d)
    _, ball_leave = _ball(size[0], (o[0], o[1], o[2] - with_sign(size[1], z_leave)), d)
    return (
        select(magnitude(z_enter) <= size[1], enter, ball_enter),
        select(magnitude(z_leave) <= size[1], leave, ball_leave),
    )


@inlined_kernel
def _box(size, o, d):
    enter, leave = _slab(size[0], o[0], d[0])
    for_y, to_y = _slab(size[1], o[1], d[1])
    for_z, to_z = _slab(size[2], o[2], d[2])
    return _larger(_larger(enter, for_y), for_z), _smaller(_smaller(leave, to_y), to_z)


@inlined_kernel
def _ellipsoid(size, o, d):
    scaled_o = (o[0] / size[0], o[1] / size[1], o[2] / size[2])
    scaled_d = (d[0] / size[0], d[1] / size[1], d[2] / size[2])
    return _ball(1.0, scaled_o, scaled_d)


@inlined_kernel
def _half_space(o, d):
    """Return the crossing of a ray and the plane, twice: it is seen from both sides."""
    crossing = -o[2] / d[2]
    return crossing, crossing


_INTERVALS = every_kind(
    "intervals of rays",
    {
        ShapeKind.SPHERE: _sphere,
        ShapeKind.CAPSULE: _capsule,
        ShapeKind.BOX: _box,
        ShapeKind.CYLINDER: _cylinder,
        ShapeKind.ELLIPSOID: _ellipsoid,
        ShapeKind.HALF_SPACE: _half_space,
        # Hulls and meshes are seen by their triangles.
        ShapeKind.CONVEX: _half_space,
        ShapeKind.MESH: _half_space,
    },
)


@by_kind(inlined_kernel, ["kind"], _INTERVALS)
def inside_of(kind, size, o, d):
    """Return the depths (enter, leave) between which rays are inside a shape of a kind.

    Of a half space, the depth of its surface twice.
    """
