"""The heights of fields as state of a context: taken whole or not at all, kept by snapshots."""

import numpy as np
import pytest

from scene_graph_ros.geometry import (
    GeometryFrame,
    GeometryInstance,
    HeightField,
    ProximityProperties,
    QueryObject,
    SceneGraph,
    Sphere,
)
from scene_graph_ros.geometry.errors import (
    InvalidConfigurationError,
    OwnershipError,
    UnknownIdError,
)

FLAT = np.zeros((3, 4))


class Scene:
    """A field, and a ball of another source 1 m above it."""

    def __init__(self):
        self.graph = SceneGraph()
        self.map = self.graph.register_source("map")
        self.other = self.graph.register_source("other")
        self.field = self.add(self.map, HeightField(FLAT, (2.0, 2.0), -1.0), "ground")
        self.ball = self.add(self.other, Sphere(0.25), "ball", height=1.25)
        self.context = self.graph.create_default_context()

    def add(self, source, shape, name, height=0.0):
        """Register a geometry that collides."""
        frame = self.graph.register_frame(source, GeometryFrame(name))
        X = np.eye(4)
        X[2, 3] = height
        instance = GeometryInstance(X, shape, name)
        instance.set_proximity_properties(ProximityProperties())
        return self.graph.register_geometry(source, frame, instance)

    def distance(self, context=None):
        """Return the distance of the ball from the field, m."""
        query = QueryObject(context or self.context)
        return query.compute_signed_distance_pair_closest_points(self.field, self.ball).distance


@pytest.fixture(name="scene")
def _scene():
    return Scene()


def test_heights_are_state_of_a_context(scene):
    """Contexts, clones and snapshots have their own; what was handed over may change after."""
    assert (scene.context.heights(scene.field) == FLAT).all()
    assert scene.graph.model_inspector().get_all_height_field_ids() == [scene.field]
    assert scene.distance() == pytest.approx(1.0, abs=1e-15)
    before, frozen = scene.context.clone(), scene.graph.query_object(scene.context).bake()
    heights = np.full((3, 4), 0.5)
    scene.context.set_heights(scene.map, {scene.field: heights})
    heights[:] = 0.75
    assert scene.distance() == pytest.approx(0.5, abs=1e-15)
    assert scene.distance(before) == pytest.approx(1.0, abs=1e-15)
    pair = frozen.compute_signed_distance_pair_closest_points(scene.field, scene.ball)
    assert pair.distance == pytest.approx(1.0, abs=1e-15)
    with pytest.raises(ValueError, match="read-only"):
        scene.context.heights(scene.field)[0, 0] = 1.0
    before.set_heights(scene.map, {scene.field: scene.context.heights(scene.field)})
    assert scene.distance(before) == pytest.approx(0.5, abs=1e-15)


def test_what_are_no_heights_is_refused_and_nothing_is_taken(scene):
    """With source, geometry and the value; all of a call or nothing."""
    set_heights = scene.context.set_heights
    bad = np.full((3, 4), 0.5)
    bad[2, 1] = np.nan
    for value, told in (
        (bad, r"ground.*heights\[2, 1\] must be finite"),
        (np.zeros((4, 3)), r"heights must be \(3, 4\), as it was registered with"),
        (np.full((3, 4), -1.0), r"heights\[0, 0\] must lie above the floor"),
        ("high", "heights must be numbers"),
    ):
        with pytest.raises(InvalidConfigurationError, match=told):
            set_heights(scene.map, {scene.field: value})
    with pytest.raises(OwnershipError):
        set_heights(scene.other, {scene.field: FLAT})
    with pytest.raises(InvalidConfigurationError, match="Sphere, whose heights can't be set"):
        set_heights(scene.other, {scene.ball: FLAT})
    with pytest.raises(InvalidConfigurationError, match="whose points can't be set"):
        scene.context.set_points(scene.map, {scene.field: np.zeros((1, 3))})
    with pytest.raises(InvalidConfigurationError, match="Sphere, which has no heights"):
        scene.context.heights(scene.ball)
    scene.graph.remove_geometry(scene.map, scene.field)
    with pytest.raises(UnknownIdError):
        scene.graph.create_default_context().heights(scene.field)
    assert scene.distance() == pytest.approx(1.0, abs=1e-15)
