"""Which points are those of a robot, or of its load: exact distances, with a padding."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry import (
    Convex,
    GeometryFrame,
    GeometryInstance,
    ProximityProperties,
    SceneGraph,
)
from scene_graph_ros.geometry.model.contact_properties import uses_triangles
from scene_graph_ros.geometry.model.ids import FrameId, GeometryId
from scene_graph_ros.geometry.model.inspector import SceneGraphInspector
from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.geometry.shapes.half_space import HalfSpace
from scene_graph_ros.geometry.shapes.kinds import ShapeKind
from scene_graph_ros.geometry.shapes.mesh import Mesh
from scene_graph_ros.geometry.spatial.poses import compose, inverse
from scene_graph_ros.geometry.spatial.sums import moved

__all__ = ["Body", "SelfFilter"]

FloatArray = NDArray[np.float64]


@one_line()
class Body(NamedTuple):
    """A body of the robot: its frame, its pose in it, and the box around it."""

    frame: FrameId
    X_FG: FloatArray
    center: FloatArray
    half: FloatArray


@one_line("frames")
class SelfFilter:
    """Geometries in a scene of their own, placed at the time of an image.

    A mesh means its convex hull or its triangles, as in pair queries.
    """

    def __init__(self, inspector: SceneGraphInspector, geometries: Iterable[GeometryId]) -> None:
        """Take geometries with the proximity role; half spaces and clouds are no bodies."""
        self._graph = SceneGraph()
        self._source = self._graph.register_source("own")
        self._frames: dict[FrameId, FrameId] = {}
        self._bodies: list[Body] = []
        for geometry in geometries:
            self._add(inspector, geometry)
        self._context = self._graph.create_default_context()
        self._X_WF: Mapping[FrameId, FloatArray] = {}

    def _add(self, inspector: SceneGraphInspector, geometry: GeometryId) -> None:
        shape: Any = inspector.get_shape(geometry)
        properties = inspector.get_proximity_properties(geometry)
        is_body = isinstance(shape.kind, ShapeKind) and not isinstance(shape, HalfSpace)
        if properties is None or not is_body or inspector.is_deformable(geometry):
            return
        frame, X_FG = inspector.get_frame_id(geometry), inspector.get_pose_in_frame(geometry)
        hull, meant = inspector.get_convex_hull(geometry), ProximityProperties()
        if hull is None:
            lower, upper = shape.local_bounds()
        else:
            lower, upper = hull.vertices.min(axis=0), hull.vertices.max(axis=0)
        if isinstance(shape, Mesh) and uses_triangles(properties):
            meant = properties.copy()
        elif hull is not None:
            shape = Convex(vertices=hull.vertices)
        if frame not in self._frames:
            name = f"frame_{len(self._frames)}"
            self._frames[frame] = self._graph.register_frame(self._source, GeometryFrame(name))
        instance = GeometryInstance(X_FG, shape, f"body_{len(self._bodies)}")
        instance.set_proximity_properties(meant)
        self._graph.register_geometry(self._source, self._frames[frame], instance)
        self._bodies.append(Body(frame, X_FG, 0.5 * (lower + upper), 0.5 * (upper - lower)))

    @property
    def frames(self) -> tuple[FrameId, ...]:
        """The frames of the bodies."""
        return tuple(self._frames)

    def place(self, X_WF: Mapping[FrameId, FloatArray]) -> None:
        """Put all frames where they were at the time of an image."""
        self._X_WF = X_WF
        poses = {own: X_WF[frame] for frame, own in self._frames.items()}
        if poses:
            self._context.set_frame_poses(self._source, poses)

    def boxes(
        self, X_WC: FloatArray, padding: float
    ) -> Iterator[tuple[FloatArray, FloatArray, FloatArray]]:
        """Yield each body's box, padded, in its own frame: centre, half its edges, ``X_BC``."""
        for body in self._bodies:
            X_WB = compose(self._X_WF[body.frame], body.X_FG)
            yield body.center, body.half + padding, compose(inverse(X_WB), X_WC)

    def near(self, p_WPs: FloatArray, padding: float) -> NDArray[np.bool_]:
        """As `has`, for many points of which few are near: those in no body's box are not."""
        near = np.zeros(len(p_WPs), np.bool_)
        for center, half, X_BW in self.boxes(np.eye(4), padding):
            near |= (np.abs(moved(p_WPs, X_BW) - center) <= half).all(axis=1)
        rows = np.flatnonzero(near)
        if len(rows):
            near[rows] = self.has(p_WPs[rows], padding)
        return near

    def has(self, p_WPs: FloatArray, padding: float) -> NDArray[np.bool_]:
        """Tell for points ``(n, 3)`` whether they are within ``padding``, m, of a body."""
        query = self._graph.query_object(self._context)
        found = query.compute_signed_distance_to_points(p_WPs, padding)
        result = np.zeros(len(p_WPs), np.bool_)
        result[found.point] = True
        return result
