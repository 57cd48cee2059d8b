"""Checks and proofs against voxel grids: as those against a box for each of their voxels."""

import numpy as np
import pytest
from searching import times
from small_arm import ARM
from voxel_boxes import boxes_of

from scene_graph_ros.geometry import (
    GeometryInstance,
    HeightField,
    ProximityProperties,
    SceneGraph,
    VoxelGrid,
)
from scene_graph_ros.planning import RobotDiagram, SceneGraphCollisionChecker
from scene_graph_ros.planning.checker.carried_checker import pack
from scene_graph_ros.scene_files import load_urdf, register_robot

LINK = """
  <link name="{name}">
    <collision><origin xyz="0.25 0 0"/><geometry><box size="0.5 0.1 0.1"/></geometry></collision>
    <collision><origin xyz="0.1 0.1 0.1"/><geometry><sphere radius="0.06"/></geometry></collision>
  </link>"""


def around(rng, part=0.02):
    """Return a grid about the arm's base, some of it occupied or unknown."""
    states = rng.choice([0, 1, 2], (20, 20, 8), p=[1.0 - 2 * part, part, part])
    states[8:12, 8:12] = 0
    return VoxelGrid(states, 0.1)


class Cell:
    """An arm in a voxel grid, or among a box for each of its voxels."""

    def __init__(self, tmp_path, grid, *, as_boxes=False):
        file = tmp_path / "arm.urdf"
        links = ARM[: ARM.index('<link name="upper">')]
        joints = ARM[ARM.index('<joint name="shoulder"') :]
        file.write_text(links + LINK.format(name="upper") + LINK.format(name="lower") + joints)
        self.model = load_urdf(file)
        self.graph = SceneGraph()
        arm = self.graph.register_source("arm")
        self.arm, self.frames = arm, register_robot(self.model, self.graph, arm)
        self.map = self.graph.register_source("map")
        X = np.eye(4)
        X[:3, 3] = [-1.0, -1.0, -0.4]
        shapes = boxes_of(grid)[0] if as_boxes else [(np.zeros(3), grid)]
        self.ids = []
        for k, (center, shape) in enumerate(shapes):
            X_WG = X.copy()
            X_WG[:3, 3] += center
            instance = GeometryInstance(X_WG, shape, f"still_{k}")
            instance.set_proximity_properties(ProximityProperties())
            self.ids.append(self.graph.register_anchored_geometry(self.map, instance))
        self.checker = self.new_checker()

    def new_checker(self):
        """Return a checker of the scene by now."""
        self.context = self.graph.create_default_context()
        tree = self.model.kinematic_tree()
        diagram = RobotDiagram(self.graph, self.context, tree, self.frames)
        return SceneGraphCollisionChecker(diagram)


def configurations(rng, count):
    """Return positions of the arm's joints."""
    return rng.uniform(-2.0, 2.0, (count, 2))


@pytest.mark.search
def test_configurations_and_edges_are_those_of_the_boxes(tmp_path):
    """Free or not, and by how much; an edge is free in one where it is in the other."""
    rng = np.random.default_rng(11)
    for _ in range(times(2)):
        grid = around(rng)
        own, boxes = Cell(tmp_path, grid), Cell(tmp_path, grid, as_boxes=True)
        q = configurations(rng, times(300))
        free = own.checker.check_configs_collision_free(q)
        assert (free == boxes.checker.check_configs_collision_free(q)).all()
        assert 0 < free.sum() < len(q)
        ends = configurations(rng, len(q))
        edges, same = (
            [cell.checker.check_edge_collision_free(a, b) for a, b in zip(q, ends, strict=True)]
            for cell in (own, boxes)
        )
        assert edges == same
        assert any(edges)


def test_a_checker_of_another_moment_sees_its_voxels(tmp_path):
    """Cleared in one moment, as they were in the other."""
    rng = np.random.default_rng(12)
    cell = Cell(tmp_path, around(rng))
    q = configurations(rng, 100)
    free = cell.checker.check_configs_collision_free(q)
    cell.context.set_voxels(cell.map, {cell.ids[0]: np.zeros((2, 2, 2), int)})
    cleared = cell.checker.at(cell.context.snapshot)
    alone = Cell(tmp_path, VoxelGrid([[[0]]], 0.1)).checker.check_configs_collision_free(q)
    assert (cleared.check_configs_collision_free(q) == alone).all()
    assert free.sum() < alone.sum()
    assert (cell.checker.check_configs_collision_free(q) == free).all()
    assert pack(cleared) is not None


def test_a_checker_takes_unknown_for_free_or_not_as_it_is_asked(tmp_path):
    """Of one grid, as of two with either rule; the checker itself goes on as it was."""
    rng = np.random.default_rng(13)
    grid, q = around(rng), configurations(rng, 100)
    cell = Cell(tmp_path, grid)
    query = cell.graph.query_object(cell.context)
    for is_free in (True, False):
        other = VoxelGrid(grid.occupancy, grid.voxel, unknown_is_free=is_free)
        expected = Cell(tmp_path, other).checker.check_configs_collision_free(q)
        asked = cell.checker.at(query.with_unknown_voxels(is_free=is_free).snapshot)
        assert (asked.check_configs_collision_free(q) == expected).all()
        free = cell.checker.check_configs_collision_free(q)
        assert (expected | ~free).all()
        assert (free == expected).all() == (not is_free)


def test_a_grid_that_the_arm_carries_is_free_of_another(tmp_path):
    """Configurations and proven edges are those of its voxels as boxes; fields are the same."""
    rng = np.random.default_rng(14)
    load = VoxelGrid(rng.choice([0, 1], (3, 4, 3), p=[0.6, 0.4]), 0.04)
    heights = HeightField(rng.uniform(-0.2, 0.1, (6, 6)), (3.0, 3.0), -1.0)
    q = configurations(rng, 60)
    for still in (around(rng), heights):
        cells = []
        for shapes in ([(np.zeros(3), load)], boxes_of(load)[0]):
            cell = Cell(tmp_path, around(rng, 0.0))
            for name, frame, center, shape in (
                ("other", cell.graph.world_frame_id(), np.array([-1.0, -1.0, -0.4]), still),
                *(
                    (f"load_{k}", cell.frames["lower"], center, shape)
                    for k, (center, shape) in enumerate(shapes)
                ),
            ):
                X = np.eye(4)
                X[:3, 3] = center + (0.0 if name == "other" else np.array([0.5, 0.0, 0.0]))
                instance = GeometryInstance(X, shape, name)
                instance.set_proximity_properties(ProximityProperties())
                cell.graph.register_geometry(cell.arm, frame, instance)
            cells.append(cell.new_checker())
        own, boxes = cells
        free = own.check_configs_collision_free(q)
        assert (free == boxes.check_configs_collision_free(q)).all()
        assert 0 < free.sum() < len(q)
        proven = [
            [each.check_edge_collision_free(a, b) for each in cells]
            for a, b in zip(q, q + 0.1, strict=True)
        ]
        assert all(one == other for one, other in proven)
        assert any(one for one, _ in proven)
