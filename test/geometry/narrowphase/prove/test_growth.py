"""Lower bounds of how the extent of a core grows around a contact's normal."""

from convex_bodies import plain_core, rounded_hull, support
import numpy as np
import pytest

from scene_graph_ros.geometry import Box, Capsule, Cylinder, Ellipsoid
from scene_graph_ros.geometry.narrowphase.cores import questions
from scene_graph_ros.geometry.narrowphase.pair import Placed
from scene_graph_ros.geometry.narrowphase.prove import growth
from scene_graph_ros.geometry.tables.shape_table import build_shape_table

CYLINDER = Cylinder(0.1, 0.3)
BOX = Box(0.2, 0.3, 0.4)
BALL = Ellipsoid(0.1, 0.2, 0.3)
CAPSULE = Capsule(0.05, 0.3)
HULL = rounded_hull(0.2, 12)
S = np.sqrt(0.5)
REACHES = [1.5, 0.5, 0.1]
NOTHING = (0.0,) * 8


def read(function):
    """Return a kernel as plain Python."""
    return getattr(function, "py_func", function)


def normals(count):
    """Return random unit vectors."""
    d = np.random.default_rng(2).normal(size=(count, 3))
    return d / np.linalg.norm(d, axis=1)[:, None]


def round_contacts():
    """Yield points of round surfaces and rims, which have all normals."""
    for m in normals(12):
        yield BALL, support_point(BALL, m), m
        yield CYLINDER, support_point(CYLINDER, m), m


def flat_contacts():
    """Yield points inside of edges, sides and faces, with a normal each."""
    yield CYLINDER, np.array([0.06, 0.08, 0.1]), np.array([0.6, 0.8, 0.0])
    yield CYLINDER, np.array([0.03, -0.06, 0.15]), np.array([0.0, 0.0, 1.0])
    yield BOX, np.array([0.1, 0.15, 0.05]), np.array([0.6, 0.8, 0.0])
    yield BOX, np.array([0.1, 0.1, -0.05]), np.array([1.0, 0.0, 0.0])
    yield CAPSULE, np.array([0.0, 0.0, 0.1]), np.array([0.6, 0.8, 0.0])
    hulls = build_shape_table([HULL], [False]).hulls
    for f in range(4):
        rows = hulls.face_vertices[slice(*hulls.face_vertex_start[f : f + 2])]
        corners, m = hulls.vertices[rows], hulls.face_normals[f]
        yield HULL, corners.mean(axis=0), m
        # Half way to the normal of the face beyond the edge.
        a, b = corners[:2]
        for g in range(len(hulls.face_offsets)):
            k = hulls.face_normals[g]
            if g != f and max(abs(k @ a - hulls.face_offsets[g]), abs(k @ b - k @ a)) < 1e-12:
                yield HULL, 0.3 * a + 0.7 * b, (m + k) / np.linalg.norm(m + k)


def support_point(shape, m):
    """Return the point of a round body that lies furthest along m."""
    if isinstance(shape, Ellipsoid):
        axes = np.array([shape.a, shape.b, shape.c])
        return axes**2 * m / np.linalg.norm(axes * m)
    rim = shape.radius * m[:2] / np.linalg.norm(m[:2])
    return np.array([*rim, np.copysign(0.5 * shape.length, m[2])])


def frame(m):
    """Return a rotation whose rows are m and two vectors orthogonal to it."""
    t = np.cross(m, np.eye(3)[np.argmin(np.abs(m))])
    t /= np.linalg.norm(t)
    return np.array([m, t, np.cross(m, t)])


def growth_of(shape, q, m):
    """Return (frame, growth) of a core around the normal m at its point q, in that frame."""
    table = build_shape_table([shape], [False])
    F = frame(m)
    known = read(questions.placed_growth)(
        Placed(plain_core(table, 0), tuple(F.ravel()), (0.0, 0.0, 0.0)),
        table.hulls.blocks,
        tuple(F @ q),
        (1.0, 0.0, 0.0),
        0.3,
    )
    return F, known


def core_extent(shape, d):
    """Return the support function of a shape's core: a capsule's is its segment."""
    return support(shape, d) - (
        shape.radius * np.linalg.norm(d, axis=-1) if isinstance(shape, Capsule) else 0.0
    )


def form_of(known, reach, y):
    """Return the quadratic form at y (n, 2)."""
    tt, tu, uu = read(growth._form)(known, reach)
    return tt * y[:, 0] ** 2 + 2.0 * tu * y[:, 0] * y[:, 1] + uu * y[:, 1] ** 2


@pytest.mark.parametrize("reach", REACHES)
@pytest.mark.parametrize("contacts", [round_contacts, flat_contacts])
def test_extent_is_never_less_than_the_bound(contacts, reach):
    """At every direction within the reach the support function is at least what is claimed."""
    rng = np.random.default_rng(4)
    y = rng.normal(size=(2000, 2))
    y *= reach * np.sqrt(rng.uniform(size=(2000, 1))) / np.linalg.norm(y, axis=1)[:, None]
    for shape, q, m in contacts():
        F, known = growth_of(shape, q, m)
        assert known != NOTHING
        d = np.column_stack([np.ones(len(y)), y]) @ F
        spare = core_extent(shape, d) - d @ q - form_of(known, reach, y)
        assert spare.min() >= -1e-14, (shape, m)


@pytest.mark.parametrize("m", normals(6), ids=str)
def test_round_bound_is_the_curvature_in_the_limit(m):
    """Close to the normal, nothing is lost: the bound is half of the second derivative."""
    for shape in (BALL, CYLINDER):
        q = support_point(shape, m)
        F, known = growth_of(shape, q, m)
        y = 1e-3 * np.array([[1.0, 0.0], [0.0, 1.0], [S, S]])
        d = np.column_stack([np.ones(3), y]) @ F
        rise = core_extent(shape, d) - d @ q
        assert form_of(known, 1e-3, y) == pytest.approx(rise, rel=1e-2, abs=1e-12)


def test_nothing_is_claimed_where_the_witness_does_not_fit():
    """A point off the support point, or beside an edge's line, gives no growth."""
    m = np.array([0.6, 0.0, 0.8])
    assert growth_of(BALL, support_point(BALL, m) + 1e-6, m)[1] == NOTHING
    assert growth_of(CYLINDER, support_point(CYLINDER, m) - 1e-6, m)[1] == NOTHING
    # A corner of a hull has no growth, nor has a normal that is no face's.
    vertices = build_shape_table([HULL], [False]).hulls.vertices
    corner = vertices[np.argmax(vertices @ m)]
    assert growth_of(HULL, corner, m)[1] == NOTHING


def test_reach_ends_where_the_depth_exceeds_the_bend():
    """Two balls of 0.1 and 0.2 m bend by 0.3 m together: less deep is known, deeper is not."""
    m = np.array([1.0, 0.0, 0.0])
    known = [growth_of(Ellipsoid(r, r, r), np.array([r, 0.0, 0.0]), m)[1] for r in (0.1, 0.2)]
    reach = read(growth.known_reach)
    assert reach(*known, 0.1) == growth.WIDEST
    assert 0.0 < reach(*known, 0.29) < 0.5
    assert reach(*known, 0.31) == 0.0
    assert reach(NOTHING, NOTHING, 0.1) == 0.0
