"""A small world that the model's tests share."""

from types import SimpleNamespace

import numpy as np
import pytest
from soft_bodies import QUARTER, soft_instance, WORLD

from scene_graph_ros.geometry import (
    GeometryFrame,
    GeometryInstance,
    HalfSpace,
    ProximityProperties,
    SceneGraph,
    Sphere,
)


def translation(x=0.0, y=0.0, z=0.0):
    """Return a pose that only moves."""
    X = np.eye(4)
    X[:3, 3] = (x, y, z)
    return X


def instance(name="ball", *, proximity=False, X=None, shape=None):
    """Return an instance, with the proximity role if asked for."""
    result = GeometryInstance(
        np.eye(4) if X is None else X, Sphere(0.1) if shape is None else shape, name
    )
    if proximity:
        result.set_proximity_properties(ProximityProperties())
    return result


@pytest.fixture(name="world")
def _world():
    """Two sources: an arm of two links with a ball on each, and a floor; and another source."""
    scene_graph = SceneGraph()
    arm = scene_graph.register_source("arm")
    other = scene_graph.register_source("other")
    link1 = scene_graph.register_frame(arm, GeometryFrame("link1"))
    link2 = scene_graph.register_frame(arm, GeometryFrame("link2", 4), parent=link1)
    box_frame = scene_graph.register_frame(other, GeometryFrame("link1"))
    ball1 = scene_graph.register_geometry(arm, link1, instance("ball", proximity=True))
    ball2 = scene_graph.register_geometry(arm, link2, instance("ball", proximity=True))
    floor = scene_graph.register_anchored_geometry(
        arm, instance("floor", proximity=True, shape=HalfSpace())
    )
    crate = scene_graph.register_geometry(other, box_frame, instance("crate", proximity=True))
    return SimpleNamespace(
        scene_graph=scene_graph,
        inspector=scene_graph.model_inspector(),
        arm=arm,
        other=other,
        link1=link1,
        link2=link2,
        box_frame=box_frame,
        ball1=ball1,
        ball2=ball2,
        floor=floor,
        crate=crate,
        instance=instance,
        translation=translation,
    )


@pytest.fixture(name="pad")
def _pad(world):
    """A soft box of the arm: 9 vertices, and 12 tetrahedra around its centre."""
    return world.scene_graph.register_deformable_geometry(
        world.arm, WORLD, soft_instance(X=QUARTER), 0.2
    )
