"""Checks and proofs against height fields: as those against a hull for each of their prisms."""

from height_prisms import prisms_of
import numpy as np
import pytest
from searching import times
from sensed_cell import SensedCell

from scene_graph_ros.geometry import (
    GeometryFrame,
    GeometryInstance,
    HeightField,
    PointCloud,
    ProximityProperties,
)
from scene_graph_ros.geometry.errors import UnsupportedPairError
from scene_graph_ros.planning.checker.carried_checker import pack


def ground(rng, rows=9, cols=11):
    """Return hills of which some are as high as the arm, lower around its base."""
    heights = rng.uniform(-0.3, 0.02, (rows, cols))
    heights[3:6, 4:7] = -0.3
    return HeightField(heights, (2.6, 2.4), -0.6)


class Cell(SensedCell):
    """An arm above a height field, or above a hull for each of its prisms."""

    def __init__(self, tmp_path, field, *, as_hulls=False, padding=0.0):
        super().__init__(tmp_path)
        X = np.eye(4)
        X[:3, :3] = [[0.6, -0.8, 0.0], [0.8, 0.6, 0.0], [0.0, 0.0, 1.0]]
        if as_hulls:
            for k, (center, hull) in enumerate(prisms_of(field)):
                X_WG = X.copy()
                X_WG[:3, 3] = X[:3, :3] @ center
                self.add(hull, X_WG, f"prism_{k}")
        else:
            self.field = self.add(field, X, "ground")
        self.context = self.graph.create_default_context()
        self.checker = self.new_checker(padding)


@pytest.mark.search
@pytest.mark.parametrize("padding", [0.0, 0.03])
def test_configurations_collide_where_they_do_with_each_prism(tmp_path, padding):
    """A field is as good as its prisms, in answers about configurations, in threads as well."""
    rng = np.random.default_rng(4)
    shape = ground(rng)
    field = Cell(tmp_path, shape, padding=padding)
    hulls = Cell(tmp_path, shape, as_hulls=True, padding=padding)
    q = rng.uniform(-2.5, 2.5, (times(600), 2))
    free = field.checker.check_configs_collision_free(q, threads=2)
    assert (free == hulls.checker.check_configs_collision_free(q)).all()
    assert 0.05 < free.mean() < 0.95
    found, expected = (
        field.checker.find_collisions(q[:100]),
        hulls.checker.find_collisions(q[:100]),
    )
    assert set(found.rows.tolist()) == set(expected.rows.tolist())


@pytest.mark.search
def test_edges_that_are_proven_free_are_free(tmp_path):
    """Each edge: proven where samples of it are free of all prisms, and clearances agree."""
    rng = np.random.default_rng(6)
    shape = ground(rng)
    field, hulls = Cell(tmp_path, shape), Cell(tmp_path, shape, as_hulls=True)
    q = rng.uniform(-2.5, 2.5, (times(60), 1, 2)) + rng.uniform(-0.2, 0.2, (times(60), 2, 2))
    statuses = [field.checker.check_edge_collision_free(a, b) for a, b in q]
    for (a, b), is_free in zip(q, statuses, strict=True):
        samples = a + np.linspace(0.0, 1.0, 100)[:, np.newaxis] * (b - a)
        if is_free:
            assert hulls.checker.check_configs_collision_free(samples).all()
        elif hulls.checker.check_configs_collision_free(samples).all():
            assert not hulls.checker.check_edge_collision_free(a, b)
    assert 0 < sum(map(bool, statuses)) < len(statuses)
    for at in q[:5, 0]:
        own = field.checker.calc_robot_clearance(at, 0.2).distances
        other = hulls.checker.calc_robot_clearance(at, 0.2).distances
        assert min(own, default=1.0) == pytest.approx(min(other, default=1.0), abs=1e-12)


def test_checkers_see_the_heights_of_their_moment(tmp_path):
    """A checker at a later context has the heights of that; the one before keeps its own."""
    field = ground(np.random.default_rng(1))
    cell = Cell(tmp_path, field)
    q = np.zeros((1, 2))
    flat = np.full(field.heights.shape, -0.5)
    cell.context.set_heights(cell.sensor, {cell.field: flat})
    low = cell.new_checker()
    cell.context.set_heights(cell.sensor, {cell.field: flat + 0.6})
    high = cell.new_checker()
    assert low.check_config_collision_free(q[0])
    assert not high.check_config_collision_free(q[0])
    assert pack(low) is not None


def test_two_fields_are_refused_by_name(tmp_path):
    """A checker of a robot that carries a field above another one says what it can't do."""
    cell = Cell(tmp_path, ground(np.random.default_rng(1)))
    frame = cell.graph.register_frame(cell.sensor, GeometryFrame("plate"))
    carried = GeometryInstance(np.eye(4), HeightField(np.ones((2, 2)), (0.1, 0.1), 0.0), "tray")
    carried.set_proximity_properties(ProximityProperties())
    cell.graph.register_geometry(cell.sensor, frame, carried)
    cell.context = cell.graph.create_default_context()
    with pytest.raises(UnsupportedPairError, match=r"sensor/world/ground .* sensor/plate/tray"):
        cell.new_checker()


def test_fields_beside_clouds(tmp_path):
    """Where both are, configurations are free of both."""
    rng = np.random.default_rng(2)
    shape, q = ground(rng), rng.uniform(-2.5, 2.5, (300, 2))
    alone = Cell(tmp_path, shape).checker.check_configs_collision_free(q)
    cell = Cell(tmp_path, shape)
    points = np.column_stack([rng.uniform(-1.0, 1.0, (40, 2)), rng.uniform(-0.1, 0.1, 40)])
    cell.add(PointCloud(points, 0.02), np.eye(4), "seen")
    cell.context = cell.graph.create_default_context()
    both = cell.new_checker().check_configs_collision_free(q)
    assert (alone | ~both).all()
    assert both.sum() < alone.sum()
