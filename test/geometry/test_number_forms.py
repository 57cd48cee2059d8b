"""Whatever NumPy calls numbers is taken in every form, or refused in words of our own."""

import contextlib

from number_forms import equal_forms, HUGE, no_numbers
import numpy as np
import pytest

from scene_graph_ros.convex.errors import ConvexSetError
from scene_graph_ros.geometry import (
    add_rigid_hydroelastic_properties,
    Box,
    Capsule,
    Convex,
    Cylinder,
    Ellipsoid,
    GeometryFrame,
    GeometryInstance,
    HalfSpace,
    Mesh,
    ProximityProperties,
    Rgba,
    SceneGraph,
    Sphere,
)
from scene_graph_ros.geometry.errors import SceneGraphError
from scene_graph_ros.geometry.optimization import HPolyhedron, Hyperrectangle, Point, VPolytope
from scene_graph_ros.geometry.spatial.poses import (
    as_pose,
    as_poses,
    pose_from_xyz_rpy,
    poses_from_quaternions,
)
from scene_graph_ros.trajectories import BezierCurve, PiecewisePolynomial

REFUSALS = SceneGraphError, ConvexSetError
TURNED = [[0.0, 0, 1, 3], [1, 0, 0, 4], [0, 1, 0, 5], [0, 0, 0, 1]]
POINTS = [[1.0, 2, 3], [4, 5, 6], [7, 8, 10]]
ROWS = [[1.0, 0], [0, 1], [1, 1]]


@pytest.fixture(scope="module", name="scene")
def _scene():
    graph = SceneGraph()
    source = graph.register_source("s")
    frames = [graph.register_frame(source, GeometryFrame(f"f{k}")) for k in range(2)]
    for frame in frames:
        ball = GeometryInstance(np.eye(4), Sphere(0.5), "ball")
        ball.set_proximity_properties(ProximityProperties())
        graph.register_geometry(source, frame, ball)
    context = graph.create_default_context()
    return source, frames, context, graph.query_object(context)


def moved(scene, poses):
    """Return where a context has frames that were set."""
    source, _, context, _ = scene
    context.set_frame_poses(source, poses)
    return context.frame_poses(source)


BORDERS = {
    "set_frame_poses, an array": (
        moved,
        [TURNED, TURNED],
    ),
    "set_frame_poses, a mapping": (
        lambda scene, X: moved(scene, {scene[1][0]: X, scene[1][1]: X}),
        TURNED,
    ),
    "GeometryInstance": (lambda scene, X: GeometryInstance(X, Sphere(1), "x").pose(), TURNED),
    "as_pose": (lambda scene, X: as_pose(X, "X_AB"), TURNED),
    "as_poses": (lambda scene, X: as_poses(X, "X_ABs"), [TURNED, TURNED]),
    "poses_from_quaternions, p": (
        lambda scene, p: poses_from_quaternions(p, [[0, 0, 0, 1]] * 3),
        POINTS,
    ),
    "pose_from_xyz_rpy": (lambda scene, p: pose_from_xyz_rpy(p, p), POINTS[0]),
    "compute_signed_distance_to_points": (
        lambda scene, p: scene[3].compute_signed_distance_to_points(p).distance,
        POINTS,
    ),
    "compute_signed_distance_to_point": (
        lambda scene, p: scene[3].compute_signed_distance_to_point(p).distance,
        POINTS[0],
    ),
    "Convex": (lambda scene, p: Convex(vertices=p).vertices, POINTS),
    "Mesh, scale": (
        lambda scene, x: Mesh(vertices=POINTS, faces=[[0, 1, 2]], scale=x).scale,
        POINTS[0],
    ),
    "HalfSpace.make_pose": (lambda scene, x: HalfSpace.make_pose(x, x), POINTS[0]),
    "Point": (lambda scene, x: Point(x).x, POINTS[0]),
    "VPolytope": (lambda scene, x: VPolytope(x).vertices, POINTS),
    "Hyperrectangle": (lambda scene, x: Hyperrectangle(x, [20, 20, 20]).lb, POINTS[0]),
    "HPolyhedron": (lambda scene, A: HPolyhedron(A, [1, 1, 1]).A, ROWS),
    "BezierCurve": (lambda scene, p: BezierCurve(0, 1, p).value(0.5), POINTS),
    "PiecewisePolynomial, samples": (
        lambda scene, p: PiecewisePolynomial.first_order_hold([0, 1, 2], p).value(0.5),
        POINTS,
    ),
    "PiecewisePolynomial, breaks": (
        lambda scene, t: PiecewisePolynomial.first_order_hold(t, POINTS).value(1.5),
        [1.0, 2, 3],
    ),
}


@pytest.mark.parametrize("border", BORDERS)
@pytest.mark.filterwarnings("ignore:the matrix subclass")
def test_every_form_of_numbers_is_the_same_or_refused(scene, border):
    """The result is that of the plain array, or an error of ours says why there is none."""
    ask, values = BORDERS[border]
    expected = np.array(ask(scene, np.array(values)))
    taken = []
    for name, form in equal_forms(values).items():
        try:
            found = np.array(ask(scene, form))
        except REFUSALS:
            # Only a matrix, whose rows are matrices, is another thing than numbers.
            assert name == "matrix", name
            continue
        assert np.array_equal(found, expected), name
        taken.append(name)
    assert len(taken) >= 23


@pytest.mark.parametrize("border", BORDERS)
@pytest.mark.filterwarnings("error::numpy.exceptions.ComplexWarning")
def test_no_numbers_are_refused_in_words_of_ours(scene, border):
    """Nothing is cut off, read out of text or a mask, and no error of others comes through."""
    ask, values = BORDERS[border]
    for name, form in no_numbers(values).items():
        if name in ("zero size", "nothing"):
            with contextlib.suppress(*REFUSALS):
                ask(scene, form)
        else:
            with pytest.raises((*REFUSALS, TypeError)) as caught:
                ask(scene, form)
            ours = isinstance(caught.value, REFUSALS) or "must map" in str(caught.value)
            assert ours or name == "a mapping", (name, caught.value)


NUMBERS = {
    "Sphere": lambda value: Sphere(value).radius,
    "Box": lambda value: Box(value, 1, 1).width,
    "Capsule": lambda value: Capsule(value, 1).radius,
    "Cylinder": lambda value: Cylinder(1, value).length,
    "Ellipsoid": lambda value: Ellipsoid(value, 1, 1).a,
    "Rgba": lambda value: Rgba(value, 0, 0, 1).r,
    "resolution_hint": lambda value: add_rigid_hydroelastic_properties(
        ProximityProperties(), value
    ),
}


@pytest.mark.parametrize("border", NUMBERS)
def test_every_form_of_one_number_is_the_same_or_refused(border):
    """Of whatever type of Python or NumPy; huge integers are refused."""
    ask = NUMBERS[border]
    expected = ask(1.0)
    for kind in ("f2", "f4", "f8", "g", "i1", "u8", "i8"):
        assert ask(np.dtype(kind).type(1)) == expected, kind
    for value in (HUGE, -HUGE, np.longdouble("1e4000"), 1j, "1", None, np.complex64(1)):
        if border == "resolution_hint" and value is None:
            continue  # it means that there is none
        with pytest.raises((SceneGraphError, TypeError), match=r"."):
            ask(value)
