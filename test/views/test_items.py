"""What there is to draw of geometries with a role."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from scene_graph_ros.geometry import (
    GeometryFrame,
    GeometryInstance,
    IllustrationProperties,
    Mesh,
    ProximityProperties,
    Rgba,
    Role,
    SceneGraph,
    Sphere,
)
from scene_graph_ros.views.draw_list import DrawItem
from scene_graph_ros.views.items import draw_items, PROXIMITY_COLOR


@pytest.fixture
def scene() -> SimpleNamespace:
    """A ball on a hand, with both roles; its illustration has a colour."""
    graph = SceneGraph()
    arm = graph.register_source("arm")
    hand = graph.register_frame(arm, GeometryFrame("left/hand"))
    instance = GeometryInstance(np.eye(4), Sphere(0.125), "tip")
    illustration = IllustrationProperties()
    illustration.add_property("phong", "diffuse", Rgba(0.125, 0.25, 0.5, 0.75))
    instance.set_illustration_properties(illustration)
    instance.set_proximity_properties(ProximityProperties())
    tip = graph.register_geometry(arm, hand, instance)
    return SimpleNamespace(graph=graph, arm=arm, hand=hand, tip=tip)


def test_items_say_what_where_and_how(scene: SimpleNamespace) -> None:
    """All that is known of an item; its colour is the role's own, or what the role has else."""
    inspector = scene.graph.model_inspector()
    (shown,) = draw_items(inspector, Role.ILLUSTRATION, [scene.tip])
    assert shown == DrawItem(
        int(scene.tip),
        "illustration/arm/left/hand",
        Sphere(0.125),
        Rgba(0.125, 0.25, 0.5, 0.75),
        path=("illustration", "arm", "left/hand", "tip"),
    )
    (colliding,) = draw_items(inspector, Role.PROXIMITY, [scene.tip])
    assert colliding.group == "proximity/arm/left/hand"
    assert colliding.rgba == PROXIMITY_COLOR


def test_what_hangs_on_the_world_says_so(scene: SimpleNamespace) -> None:
    """Anchored geometry belongs to its source and to the world's frame."""
    graph = scene.graph
    floor = graph.register_anchored_geometry(
        scene.arm, GeometryInstance(np.eye(4), Sphere(1.0), "floor")
    )
    graph.assign_role(scene.arm, floor, ProximityProperties())
    (item,) = draw_items(graph.model_inspector(), Role.PROXIMITY, [floor])
    assert item.path == ("proximity", "arm", "world", "floor")


def test_an_illustration_without_colour_leaves_it_to_the_mesh(scene: SimpleNamespace) -> None:
    """No colour is passed on as none, so that the materials of a file show."""
    plain = scene.graph.register_geometry(
        scene.arm, scene.hand, GeometryInstance(np.eye(4), Sphere(1.0), "plain")
    )
    scene.graph.assign_role(scene.arm, plain, IllustrationProperties())
    (item,) = draw_items(scene.graph.model_inspector(), Role.ILLUSTRATION, [plain])
    assert item.rgba is None


def test_a_collision_mesh_is_drawn_as_what_it_means_when_asked(scene: SimpleNamespace) -> None:
    """With mesh_hulls a Mesh that means its hull is drawn so, one that means triangles is not."""
    mesh = Mesh(vertices=np.vstack([np.zeros(3), np.eye(3)]), faces=[(0, 2, 1), (0, 1, 3)])
    ids = []
    for word in ("convex_hull", "triangles"):
        instance = GeometryInstance(np.eye(4), mesh, word)
        properties = ProximityProperties()
        properties.add_property("mesh", "representation", word)
        instance.set_proximity_properties(properties)
        ids.append(scene.graph.register_geometry(scene.arm, scene.hand, instance))
    inspector = scene.graph.model_inspector()
    for asked, expected in ((True, [True, False]), (False, [False, False])):
        items = draw_items(inspector, Role.PROXIMITY, ids, mesh_hulls=asked)
        assert [item.as_hull for item in items] == expected
