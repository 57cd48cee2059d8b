"""The points of clouds as state of a context: taken whole or not at all, kept by snapshots."""

from form_checks import check_forms
import numpy as np
import pytest

from scene_graph_ros.geometry import (
    GeometryFrame,
    GeometryInstance,
    PointCloud,
    ProximityProperties,
    QueryObject,
    SceneGraph,
    Sphere,
)
from scene_graph_ros.geometry.errors import (
    InvalidConfigurationError,
    OwnershipError,
    PropertyError,
    UnknownIdError,
)


class Scene:
    """Two clouds of one source, with one radius and with one each, and a ball of another."""

    def __init__(self):
        self.graph = SceneGraph()
        self.camera = self.graph.register_source("camera")
        self.other = self.graph.register_source("other")
        self.frame = self.graph.register_frame(self.camera, GeometryFrame("lens"))
        self.one = self.add(self.camera, self.frame, PointCloud([[1, 0, 0]], 0.25), "one")
        self.each = self.add(self.camera, self.frame, PointCloud([[2, 0, 0]], [0.5]), "each")
        hand = self.graph.register_frame(self.other, GeometryFrame("hand"))
        self.ball = self.add(self.other, hand, Sphere(0.1), "ball")
        self.context = self.graph.create_default_context()

    def add(self, source, frame, shape, name):
        """Register a geometry that collides."""
        instance = GeometryInstance(np.eye(4), shape, name)
        instance.set_proximity_properties(ProximityProperties())
        return self.graph.register_geometry(source, frame, instance)

    def distance(self, cloud, context=None):
        """Return how far the ball is from a cloud."""
        query = QueryObject(context or self.context)
        return query.compute_signed_distance_pair_closest_points(cloud, self.ball).distance


@pytest.fixture(name="scene")
def _scene():
    return Scene()


def test_a_cloud_begins_with_the_points_of_its_shape(scene):
    """In each context, until others are set."""
    assert scene.context.points(scene.one).tolist() == [[1, 0, 0]]
    assert scene.distance(scene.one) == pytest.approx(1 - 0.25 - 0.1, abs=1e-15)
    assert scene.distance(scene.each) == pytest.approx(2 - 0.5 - 0.1, abs=1e-15)


def test_points_that_are_set_are_those_of_now(scene):
    """A snapshot keeps those it has, whatever is set later, or written to the array."""
    before = scene.context.snapshot
    p_GPs = np.array([[0, 3, 0], [0, 2, 0.0]])
    version = scene.context.pose_version
    scene.context.set_points(scene.camera, {scene.one: p_GPs})
    p_GPs[:] = 0.0
    assert scene.context.pose_version > version
    assert scene.context.points(scene.one).tolist() == [[0, 3, 0], [0, 2, 0]]
    assert scene.distance(scene.one) == pytest.approx(2 - 0.25 - 0.1, abs=1e-15)
    assert before.point_set(scene.one).points.tolist() == [[1, 0, 0]]
    assert scene.distance(scene.one, before) == pytest.approx(0.65, abs=1e-15)
    # After a tree was built of them they come in their own order again.
    assert scene.context.points(scene.one).tolist() == [[0, 3, 0], [0, 2, 0]]


def test_radii_come_with_the_points(scene):
    """A cloud with one radius for all takes them, too, and forgets them with the next points."""
    scene.context.set_points(scene.camera, {scene.one: ([[0, 2, 0]], [1.0])})
    assert scene.distance(scene.one) == pytest.approx(0.9, abs=1e-15)
    scene.context.set_points(scene.camera, {scene.one: [[0, 2, 0]]})
    assert scene.distance(scene.one) == pytest.approx(1.65, abs=1e-15)
    with pytest.raises(InvalidConfigurationError, match="a radius each, so set"):
        scene.context.set_points(scene.camera, {scene.each: [[0, 2, 0]]})


def test_two_points_in_a_tuple_are_points(scene):
    """Not points and radii."""
    scene.context.set_points(scene.camera, {scene.one: ((0, 2, 0), (0, 3, 0))})
    assert len(scene.context.points(scene.one)) == 2


def test_points_and_radii_may_be_empty_lists(scene):
    """A pair of them takes all points off a cloud whose points have radii."""
    scene.context.set_points(scene.camera, {scene.each: ([], [])})
    assert scene.context.points(scene.each).shape == (0, 3)


@pytest.mark.parametrize("argument", ["points", "radii"])
@pytest.mark.filterwarnings("ignore:the matrix subclass")
@pytest.mark.filterwarnings("error::numpy.exceptions.ComplexWarning")
def test_arrays_of_any_form_are_taken_or_refused(scene, argument):
    """By a shape, and by a context."""

    def shape(points, radii):
        cloud = PointCloud(points, radii)
        return cloud.points, cloud.radius

    def state(points, radii):
        scene.context.set_points(scene.camera, {scene.each: (points, radii)})
        distance = scene.distance(scene.each)
        scene.context.set_points(scene.camera, {scene.one: points})
        return scene.context.points(scene.each), distance, scene.context.points(scene.one)

    arrays = {"points": [[1.0, 2, 3], [4, 5, 6]], "radii": [1.0, 2]}
    for call in (shape, state):
        check_forms(call, arrays, argument)


def test_all_is_taken_or_nothing(scene):
    """A point that is not finite is named by its index."""
    good, bad = [[5, 0, 0]], ([[0, 0, 0], [0, np.nan, 0]], [0.1, 0.1])
    with pytest.raises(InvalidConfigurationError, match=r"'each' of source 'camera'.*point 1"):
        scene.context.set_points(scene.camera, {scene.one: good, scene.each: bad})
    assert scene.context.points(scene.one).tolist() == [[1, 0, 0]]


@pytest.mark.parametrize(
    ("value", "told"),
    [
        (np.zeros((2, 2)), r"\(n, 3\)"),
        ("points", "must be numbers"),
        (([[0, 0, 0]], [-1.0]), "radii of point 0"),
        (([[0, 0, 0]], [0.1, 0.1]), r"radii must be \(1,\)"),
        (([[0, 0, 0]], 0.1), r"radii must be \(1,\)"),
        (([[0, 0, 0]], [np.inf]), "radii of point 0"),
    ],
)
def test_what_are_no_points_is_refused(scene, value, told):
    """The message names geometry and source."""
    with pytest.raises(InvalidConfigurationError, match=f"'one' of source 'camera'.*{told}"):
        scene.context.set_points(scene.camera, {scene.one: value})


def test_only_the_owner_sets_points_of_clouds(scene):
    """Nobody else, nothing else, and of nothing that is not there."""
    set_points = scene.context.set_points
    with pytest.raises(OwnershipError, match="'one'"):
        set_points(scene.other, {scene.one: [[0, 0, 0]]})
    with pytest.raises(InvalidConfigurationError, match="a Sphere, whose points"):
        set_points(scene.other, {scene.ball: [[0, 0, 0]]})
    with pytest.raises(InvalidConfigurationError, match="a Sphere, which has no points"):
        scene.context.points(scene.ball)
    with pytest.raises(UnknownIdError):
        set_points(scene.camera, {7: [[0, 0, 0]]})
    with pytest.raises(TypeError, match="geometry ids must map to p_GPs"):
        set_points(scene.camera, [[0, 0, 0]])


def test_another_shape_has_its_own_points(scene):
    """Those that were set for the one before are gone, and so are those of a removed geometry."""
    scene.context.set_points(scene.camera, {scene.one: [[0, 2, 0]]})
    scene.graph.change_shape(
        scene.camera, scene.one, PointCloud([[0, 0, 4]], 0.0), context=scene.context
    )
    assert scene.context.points(scene.one).tolist() == [[0, 0, 4]]
    assert scene.distance(scene.one) == pytest.approx(3.9, abs=1e-15)
    scene.graph.remove_geometry(scene.camera, scene.one, context=scene.context)
    scene.context.set_points(scene.camera, {scene.each: ([[0, 1, 0]], [0.0])})
    assert list(scene.context.snapshot.configurations) == [scene.each]


def test_what_if_and_clones_have_the_points(scene):
    """Moved by the poses that are asked about."""
    scene.context.set_points(scene.camera, {scene.one: [[0, 2, 0]]})
    X = np.eye(4)
    X[1, 3] = 1.0
    asked = QueryObject(scene.context).ask_what_if(
        [{scene.frame: X}], lambda query: scene.distance(scene.one, query.snapshot)
    )
    assert asked == pytest.approx([3 - 0.35], abs=1e-15)
    assert scene.distance(scene.one, scene.context.clone()) == pytest.approx(1.65, abs=1e-15)


def test_a_cloud_has_no_contact_surface(scene):
    """Properties that ask for one are refused."""
    properties = ProximityProperties()
    properties.add_property("hydroelastic", "compliance_type", "rigid")
    instance = GeometryInstance(np.eye(4), PointCloud([], 0.1), "pressed")
    instance.set_proximity_properties(properties)
    with pytest.raises(PropertyError, match="a PointCloud has no contact surfaces"):
        scene.graph.register_geometry(scene.camera, scene.frame, instance)
