"""A scene whose moments are shown, and pages that look at it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pytest

from scene_graph_ros.geometry import (
    GeometryFrame,
    GeometryInstance,
    IllustrationProperties,
    ProximityProperties,
    Rgba,
    SceneGraph,
)
from scene_graph_ros.geometry.query.query_object import QueryObject
from scene_graph_ros.views.draggable import DraggableRobot
from scene_graph_ros.views.moment import Contacts, Trouble
from scene_graph_ros.views.sliders import Slider, SliderState


@dataclass(frozen=True)
class StageMoment:
    """A moment of a stage."""

    query: QueryObject
    scene_version: int
    sequence: int
    stamp: int
    pressed: tuple[Any, ...] = ()
    pictures: Mapping[str, bytes] = field(default_factory=dict)
    sliders: tuple[Slider, ...] = ()
    slid: SliderState = field(default_factory=SliderState)
    slider_sequence: int = 0
    troubles: tuple[Trouble, ...] = ()
    draggable: tuple[DraggableRobot, ...] = ()

    def slider_state(self):
        """Return where the joints are."""
        return self.slid

    @property
    def cameras(self):
        """Those that have pictures."""
        return tuple(self.pictures)

    def picture(self, camera):
        """Return a picture, or nothing."""
        return self.pictures.get(camera, b"")

    @property
    def inspector(self):
        """Introspect the model."""
        return self.query.inspector()

    @property
    def contact_sequence(self):
        """Contacts are never late here."""
        return self.sequence

    def contacts(self):
        """Return the penetrations, and surfaces where the stage has some."""
        return Contacts(self.query.compute_point_pair_penetration(), *self.pressed)


class Stage:
    """A scene whose frames are moved, and whose geometries come and go."""

    def __init__(self) -> None:
        self.graph = SceneGraph()
        self.source = self.graph.register_source("arm")
        self.frames: dict[str, Any] = {}
        self.geometries: dict[str, Any] = {}
        self._X_WF: dict[str, Any] = {}
        self._q_WG: dict[Any, Any] = {}
        self._version = self._sequence = 0
        self.pressed: tuple[Any, ...] = ()
        self.pictures: dict[str, bytes] = {}
        self.sliders: tuple[Slider, ...] = ()
        self.slid = SliderState()
        self._slides = 0
        self.troubles: tuple[Trouble, ...] = ()
        self.draggable: tuple[DraggableRobot, ...] = ()

    def slide(self, *positions, refused=None):
        """Have joints be somewhere."""
        self._slides += 1
        self.slid = SliderState(positions, refused or {})

    def hang(self, camera, picture):
        """Have a camera see a picture."""
        self._version += camera not in self.pictures
        self.pictures[camera] = picture

    def add(
        self,
        name,
        shape,
        p_WF=(0.0, 0.0, 0.0),
        roles=("illustration", "proximity"),
        rgba=(0.25, 0.5, 0.75),
        picture=None,
        scale=None,
    ):
        """Put a shape on a frame of its own, with a picture on it if one is given."""
        frame = self.graph.register_frame(self.source, GeometryFrame(f"{name}_frame"))
        instance = GeometryInstance(np.eye(4), shape, name)
        if "illustration" in roles:
            properties = IllustrationProperties()
            if rgba is not None:
                properties.add_property("phong", "diffuse", Rgba(*rgba))
            if picture is not None:
                properties.add_property("phong", "diffuse_map", picture)
            if scale is not None:
                properties.add_property("phong", "diffuse_scale", scale)
            instance.set_illustration_properties(properties)
        if "proximity" in roles:
            instance.set_proximity_properties(ProximityProperties())
        self.geometries[name] = self.graph.register_geometry(self.source, frame, instance)
        self.frames[name] = frame
        self.move(name, p_WF)
        self._version += 1

    def add_soft(self, name, shape):
        """Put a shape that deforms in the world."""
        instance = GeometryInstance(np.eye(4), shape, name)
        instance.set_illustration_properties(IllustrationProperties())
        self.geometries[name] = self.graph.register_deformable_geometry(
            self.source, self.graph.world_frame_id(), instance, 0.5
        )
        self._version += 1

    def deform(self, name, function):
        """Put the vertices of a shape that deforms elsewhere."""
        geometry_id = self.geometries[name]
        mesh = self.graph.model_inspector().get_reference_mesh(geometry_id)
        self._q_WG[geometry_id] = function(mesh.vertices)

    def remove(self, name):
        """Take a shape away."""
        geometry_id = self.geometries.pop(name)
        self._q_WG.pop(geometry_id, None)
        self.graph.remove_geometry(self.source, geometry_id)
        self._version += 1

    def move(self, name, p_WF):
        """Put a shape's frame somewhere."""
        X_WF = np.eye(4)
        X_WF[:3, 3] = p_WF
        self._X_WF[name] = X_WF

    def moment(self):
        """Return how all is now."""
        self._sequence += 1
        context = self.graph.create_default_context()
        poses = {self.frames[name]: X_WF for name, X_WF in self._X_WF.items()}
        context.set_frame_poses(self.source, poses)
        context.set_configurations(self.source, self._q_WG)
        query = self.graph.query_object(context).bake()
        stamp = 10**9 * self._sequence
        joints = self.sliders, self.slid, self._slides
        shown = self.pressed, dict(self.pictures), *joints, self.troubles, self.draggable
        return StageMoment(query, self._version, self._sequence, stamp, *shown)


@pytest.fixture
def stage():
    """An empty scene."""
    return Stage()
