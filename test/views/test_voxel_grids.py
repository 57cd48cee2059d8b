"""What pages and viewers are told of voxel grids."""

import numpy as np

from scene_graph_ros.geometry import (
    GeometryInstance,
    IllustrationProperties,
    Role,
    SceneGraph,
    VoxelGrid,
)
from scene_graph_ros.views.height_fields import (
    field_ids,
    field_items,
    placed_heights,
    surface_in_world,
)
from scene_graph_ros.views.voxel_grids import MOST_BOXES


def test_boxes_are_those_of_the_voxels_at_the_surface():
    """As many triangles whatever is set; of too many voxels larger boxes around these."""
    graph = SceneGraph()
    source = graph.register_source("map")
    instance = GeometryInstance(np.eye(4), VoxelGrid(np.ones((3, 3, 3), int), 0.5), "map")
    instance.set_illustration_properties(IllustrationProperties())
    grid = graph.register_anchored_geometry(source, instance)
    context = graph.create_default_context()
    assert field_ids(context.snapshot, Role.ILLUSTRATION) == [grid]
    (item,) = field_items(context.inspector(), Role.ILLUSTRATION, [grid])
    before = placed_heights(context.snapshot, grid)
    boxes = surface_in_world(context.snapshot, grid).reshape(MOST_BOXES, 8, 3)
    has_size = np.ptp(boxes, axis=1).min(axis=1) > 0.0
    assert has_size.sum() == 26  # all but the one in the middle
    assert np.ptp(boxes[has_size], axis=1).tolist() == 26 * [[0.5, 0.5, 0.5]]
    assert item.triangles.max() == 8 * MOST_BOXES - 1
    corners = boxes[0][item.triangles[:12]]
    volume = np.einsum("ti,ti->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6.0
    assert abs(volume - 0.125) < 1e-12
    context.set_voxels(source, {grid: np.indices((40, 40, 10)).sum(axis=0) % 2})
    assert placed_heights(context.snapshot, grid) != before
    boxes = surface_in_world(context.snapshot, grid).reshape(MOST_BOXES, 8, 3)
    assert boxes.max(axis=(0, 1)).tolist() == [20.0, 20.0, 5.0]
    assert np.ptp(boxes[0], axis=0).tolist() == [1.0, 1.0, 1.0]
    context.set_voxels(source, {grid: np.zeros((2, 2, 2), int)})
    assert not surface_in_world(context.snapshot, grid).any()
