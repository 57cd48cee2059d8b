"""Markers of height fields: a list of triangles, sent again where heights or poses differ."""

from types import SimpleNamespace

import numpy as np

from scene_graph_ros.geometry import (
    GeometryInstance,
    HeightField,
    IllustrationProperties,
    Role,
    SceneGraph,
)
from scene_graph_ros.node.effects.field_markers import RoleFields

EMPTY = b"\x00\x01\x00\x00\x00\x00\x00\x00"
"""A message without markers."""


def test_a_field_is_sent_where_it_differs():
    """Once, not again while it is the same, and again after other heights were set."""
    graph = SceneGraph()
    source = graph.register_source("map")
    instance = GeometryInstance(np.eye(4), HeightField(np.zeros((3, 4)), (1, 1), -1.0), "ground")
    instance.set_illustration_properties(IllustrationProperties())
    field = graph.register_anchored_geometry(source, instance)
    context = graph.create_default_context()

    def moment():
        query = graph.query_object(context).bake()
        return SimpleNamespace(query=query, inspector=query.inspector(), stamp=7)

    markers = RoleFields(Role.ILLUSTRATION, "world", lambda *_: None)
    markers.set_items(moment())
    message, count = markers.append(EMPTY, moment(), is_whole=True)
    triangles = 2 * 2 * 3 + 3 * 2 * (2 + 3)
    assert count == 1
    assert len(message) > len(EMPTY) + 3 * 24 * triangles
    assert markers.append(EMPTY, moment(), is_whole=False)[1] == 0
    context.set_heights(source, {field: np.ones((3, 4))})
    assert markers.append(EMPTY, moment(), is_whole=False)[1] == 1
