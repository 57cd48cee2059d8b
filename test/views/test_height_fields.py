"""What pages and viewers are told of height fields, and when."""

import numpy as np

from scene_graph_ros.geometry import (
    GeometryInstance,
    HeightField,
    IllustrationProperties,
    PointCloud,
    Role,
    SceneGraph,
)
from scene_graph_ros.views.clouds import cloud_ids
from scene_graph_ros.views.height_fields import (
    field_ids,
    field_items,
    MOST_ROWS,
    placed_heights,
    surface_in_world,
)

X_WG = np.array([[0, -1, 0, 1], [1, 0, 0, 2], [0, 0, 1, 3], [0, 0, 0, 1.0]])


def scene_of(*shapes):
    """Return source, ids and context."""
    graph = SceneGraph()
    source, ids = graph.register_source("map"), []
    for k, shape in enumerate(shapes):
        instance = GeometryInstance(X_WG, shape, f"shape_{k}")
        instance.set_illustration_properties(IllustrationProperties())
        ids.append(graph.register_anchored_geometry(source, instance))
    return source, ids, graph.create_default_context()


def test_a_surface_is_where_the_heights_are():
    """Its first corners are the heights in W, row by row; clouds are not among the fields."""
    heights = np.array([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]])
    source, (field, cloud), context = scene_of(
        HeightField(np.ones((2, 3)), (2.0, 1.0), 0.0), PointCloud([], 0.1)
    )
    assert field_ids(context.snapshot, Role.ILLUSTRATION) == [field]
    assert cloud_ids(context.snapshot, Role.ILLUSTRATION) == [cloud]
    before = placed_heights(context.snapshot, field)
    context.set_heights(source, {field: heights})
    assert placed_heights(context.snapshot, field) != before
    corners = surface_in_world(context.snapshot, field)
    x, y = [-1.0, 0.0, 1.0], [-0.5, 0.5]
    expected = [[1.0 - y[i], 2.0 + x[j], 3.0 + heights[i, j]] for i in range(2) for j in range(3)]
    assert (corners[:6] == np.array(expected)).all()
    (item,) = field_items(context.inspector(), Role.ILLUSTRATION, [field])
    assert item.triangles.max() == len(corners) - 1


def test_large_fields_are_drawn_by_fewer_rows():
    """As many as can be drawn, the first and the last among them."""
    rng = np.random.default_rng(0)
    field = HeightField(rng.uniform(0.0, 1.0, (300, 10)), (2.0, 1.0), -1.0)
    _, (drawn,), context = scene_of(field)
    corners = surface_in_world(context.snapshot, drawn)
    assert len(corners) == MOST_ROWS * 10 + 2 * (MOST_ROWS + 10) - 4 + 1
    tops = corners[: MOST_ROWS * 10, 2].reshape(MOST_ROWS, 10) - 3.0
    assert np.abs(tops[[0, -1]] - field.heights[[0, -1]]).max() < 1e-12
