"""Shapes that are added to a checker's bodies, beside those of its scene."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.model.context import Context
from scene_graph_ros.geometry.model.ids import FrameId, GeometryId
from scene_graph_ros.geometry.model.inspector import SceneGraphInspector
from scene_graph_ros.geometry.model.instance import checked_shape, GeometryInstance
from scene_graph_ros.geometry.model.properties import ProximityProperties
from scene_graph_ros.geometry.model.scene_graph import SceneGraph
from scene_graph_ros.geometry.model.snapshot import Snapshot
from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.geometry.shapes.shape import Shape
from scene_graph_ros.geometry.spatial.poses import as_pose
from scene_graph_ros.planning.errors import CollisionCheckerError

__all__ = ["AddedShape", "BodyShapeDescription", "furnished", "make_body_shape_description"]


@one_line()
@dataclass(frozen=True, eq=False)
class BodyShapeDescription:
    """A shape S fixed to a body B at ``pose_in_body`` X_BS ``(4, 4)``, by names.

    ``model_instance_name`` is the source's, ``body_name`` that of its frame.
    Raises InvalidShapeError and InvalidPoseError.
    """

    shape: Shape
    pose_in_body: NDArray[np.float64]
    model_instance_name: str
    body_name: str

    def __post_init__(self) -> None:
        """Check the shape and the pose."""
        checked_shape(self.shape, f"{self.model_instance_name}/{self.body_name}")
        X_BS = as_pose(self.pose_in_body, f"X_BS in {self.body_name!r}")
        object.__setattr__(self, "pose_in_body", X_BS)


def make_body_shape_description(
    inspector: SceneGraphInspector, geometry_id: GeometryId
) -> BodyShapeDescription:
    """Describe a registered geometry. Raises UnknownIdError, DeformableError."""
    frame = inspector.get_frame_id(geometry_id)
    return BodyShapeDescription(
        inspector.get_shape(geometry_id),
        inspector.get_pose_in_frame(geometry_id),
        inspector.get_owning_source_name(frame),
        inspector.get_name(frame),
    )


class AddedShape(NamedTuple):
    """One of a group of shapes; its instance keeps its id from one scene to the next."""

    group: str
    description: BodyShapeDescription
    frame_id: FrameId
    instance: GeometryInstance

    @classmethod
    def of(cls, group: Any, description: BodyShapeDescription, frame_id: FrameId) -> AddedShape:
        """Return a shape that is to be added. Raises CollisionCheckerError for a bad group."""
        if not isinstance(group, str) or not group.strip():
            raise CollisionCheckerError(f"group_name must be text that is not empty: {group!r}")
        instance = GeometryInstance(description.pose_in_body, description.shape, "added")
        instance.set_name(f"{group}/{int(instance.id())}")
        instance.set_proximity_properties(ProximityProperties())
        return cls(group, description, frame_id, instance)


def furnished(snapshot: Snapshot, added: Iterable[AddedShape]) -> Snapshot:
    """Return a moment of a scene with shapes added; the given one stays as it is.

    Raises MeshError for a mesh that cannot be used.
    """
    shapes = tuple(added)
    if not shapes:
        return snapshot
    scene_graph, context = SceneGraph(), Context(snapshot.state)
    inspector = snapshot.inspector
    for shape in shapes:
        source = inspector.get_owning_source_id(shape.frame_id)
        scene_graph.register_geometry(source, shape.frame_id, shape.instance, context=context)
    # Frames are the same, in the same order.
    return Snapshot(
        context.snapshot.state,
        snapshot.X_PF,
        snapshot.pose_version,
        configurations=snapshot.configurations,
    )
