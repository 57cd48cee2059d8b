"""Which points are those of a robot, or of its load: exact distances, with a padding."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
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
from scene_graph_ros.geometry.model.context import Context
from scene_graph_ros.geometry.model.ids import FrameId, GeometryId
from scene_graph_ros.geometry.model.inspector import SceneGraphInspector
from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.geometry.shapes.half_space import HalfSpace
from scene_graph_ros.geometry.shapes.kinds import ShapeKind
from scene_graph_ros.geometry.shapes.mesh import Mesh
from scene_graph_ros.geometry.spatial.poses import compose
from scene_graph_ros.geometry.spatial.sums import moved, product
from scene_graph_ros.sensing.near_cells import (
    FAR,
    mark_points,
    NEAR,
    NearCells,
    new_cells,
    OPEN,
    PlacedBoxes,
    ROBOT,
    UNSURE,
    WANTED,
)

__all__ = ["Body", "SelfFilter"]

FloatArray = NDArray[np.float64]
Mask = NDArray[Any]


@one_line()
class Body(NamedTuple):
    """A body of the robot: its frame, its pose in it, the box around it, and its convexity."""

    frame: FrameId
    X_FG: FloatArray
    center: FloatArray
    half: FloatArray
    is_convex: bool


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
        self._own_ids: list[GeometryId] = []
        for geometry in geometries:
            self._add(inspector, geometry)
        self._context = self._graph.create_default_context()
        self._X_WF: Mapping[FrameId, FloatArray] = {}
        self._cells: tuple[float, NearCells] | None = None
        self._apart: tuple[Context, FloatArray] | None = None

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
        is_convex = not (isinstance(shape, Mesh) and uses_triangles(properties))
        if not is_convex:
            meant = properties.copy()
        elif hull is not None:
            shape = Convex(vertices=hull.vertices)
        if frame not in self._frames:
            name = f"frame_{len(self._frames)}"
            self._frames[frame] = self._graph.register_frame(self._source, GeometryFrame(name))
        instance = GeometryInstance(X_FG, shape, f"body_{len(self._bodies)}")
        instance.set_proximity_properties(meant)
        own = self._graph.register_geometry(self._source, self._frames[frame], instance)
        self._own_ids.append(own)
        center, half = 0.5 * (lower + upper), 0.5 * (upper - lower)
        self._bodies.append(Body(frame, X_FG, center, half, is_convex))

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

    def boxes(self, X_WC: FloatArray, padding: float) -> PlacedBoxes:
        """Return the bodies' boxes, padded by so many m, seen from a frame C."""
        if not self._bodies:
            return PlacedBoxes(np.empty((0, 4, 4)), np.empty((0, 3)), np.empty((0, 3)))
        X_WF = np.array([self._X_WF[body.frame] for body in self._bodies])
        X_WB = product(X_WF, np.array([body.X_FG for body in self._bodies]))
        X_BC = np.zeros_like(X_WB)
        R_BW = X_WB[:, :3, :3].transpose(0, 2, 1)
        X_BC[:, :3, :3] = product(R_BW, X_WC[:3, :3])
        X_BC[:, :3, 3] = np.einsum("bij,bj->bi", R_BW, X_WC[:3, 3] - X_WB[:, :3, 3])
        X_BC[:, 3, 3] = 1.0
        centers = np.array([body.center for body in self._bodies])
        halves = np.array([body.half for body in self._bodies]) + padding
        return PlacedBoxes(X_BC, centers, halves)

    def near(self, p_WPs: FloatArray, padding: float) -> Mask:
        """Tell for points ``(n, 3)`` of W whether they are within ``padding``, m, of a body."""
        mask = np.zeros(len(p_WPs), np.uint8)
        self.mark(p_WPs, np.eye(4), padding, mask)
        return mask == ROBOT

    def mark(self, p_CPs: FloatArray, X_WC: FloatArray, padding: float, mask: Mask) -> int:
        """Mark points ``(n, 3)`` of C as ROBOT where `near` tells so; return how many.

        ``mask`` ``(n,)`` has OPEN for all.
        """
        boxes = self.boxes(X_WC, padding)
        if not len(boxes.centers) or not len(p_CPs):
            return 0
        R_CB = boxes.X_BCs[:, :3, :3].transpose(0, 2, 1)
        middles = np.einsum("bij,bj->bi", R_CB, boxes.centers - boxes.X_BCs[:, :3, 3])
        reaches = np.einsum("bij,bj->bi", np.abs(R_CB), boxes.halves)
        lower, upper = middles - reaches, middles + reaches
        return self.decide(
            lambda cells: mark_points(p_CPs, boxes, lower, upper, cells, mask),
            padding,
            mask,
            lambda unsure: moved(p_CPs[unsure], X_WC),
        )

    def decide(
        self,
        mark: Callable[[NearCells], tuple[int, int, int]],
        padding: float,
        mask: Mask,
        points: Callable[[Mask], FloatArray],
    ) -> int:
        """Call ``mark`` and decide about all that it is unsure of; return how many are near.

        Cells that it wants are measured, and it is called again. ``points`` returns those of W
        that are chosen.
        """
        cells = self._cells_for(padding)
        marked, unsure, wanted = mark(cells)
        if wanted:
            self._measure(cells, padding)
            mask[...] = OPEN
            marked, unsure, _ = mark(cells)
        if unsure:
            chosen = mask == UNSURE
            is_near = self.has(points(chosen), padding)
            mask[chosen] = np.where(is_near, ROBOT, OPEN)
            marked -= int(len(is_near) - np.count_nonzero(is_near))
        return marked

    def has(self, p_WPs: FloatArray, padding: float) -> Mask:
        """As `near`, by the distance of each point."""
        query = self._graph.query_object(self._context)
        found = query.compute_signed_distance_to_points(p_WPs, padding)
        result = np.zeros(len(p_WPs), np.bool_)
        result[found.point] = True
        return result

    def _cells_for(self, padding: float) -> NearCells:
        if self._cells is None or self._cells[0] != padding:
            centers = np.array([body.center for body in self._bodies]).reshape(-1, 3)
            halves = np.array([body.half for body in self._bodies]).reshape(-1, 3) + padding
            is_convex = np.array([body.is_convex for body in self._bodies], np.bool_)
            self._cells = padding, new_cells(centers, halves, padding, is_convex)
        return self._cells[1]

    def _measure(self, cells: NearCells, padding: float) -> None:
        """Measure the cells that are wanted, each from its own body alone."""
        wanted = np.flatnonzero(cells.states == WANTED)
        body, p_BQs = cells.centers(wanted)
        if self._apart is None:
            self._apart = self._taken_apart()
        context, X_WBs = self._apart
        p_WQs = np.einsum("nij,nj->ni", X_WBs[body, :3, :3], p_BQs) + X_WBs[body, :3, 3]
        # Rounding is far below the last thousandth.
        reach = 1.001 * 0.5 * np.sqrt(3.0) * cells.edges[body]
        found = self._graph.query_object(context).compute_signed_distance_to_points(
            p_WQs, padding + float(reach.max())
        )
        ids = np.array([int(each) for each in self._own_ids])
        is_own = found.id_G == ids[body[found.point]]
        distances = np.full(len(wanted), np.inf)
        distances[found.point[is_own]] = found.distance[is_own]
        states = np.full(len(wanted), UNSURE, np.uint8)
        states[distances + reach <= padding] = NEAR
        states[distances - reach > padding] = FAR
        cells.states[wanted] = states

    def _taken_apart(self) -> tuple[Context, FloatArray]:
        """Return a context with frames far from each other, and the bodies' poses in it."""
        sizes = [
            np.abs(body.X_FG[:3, 3]).sum() + np.abs(body.center).sum() + body.half.sum()
            for body in self._bodies
        ]
        X_WF = {}
        for k, frame in enumerate(self._frames):
            X_WF[frame] = np.eye(4)
            X_WF[frame][0, 3] = 4.0 * k * max(sizes)
        context = self._graph.create_default_context()
        own = {self._frames[frame]: X for frame, X in X_WF.items()}
        context.set_frame_poses(self._source, own)
        return context, np.array([compose(X_WF[b.frame], b.X_FG) for b in self._bodies])
