"""A small world, and all that it answers: by names, to compare worlds."""

from __future__ import annotations

from collections.abc import Callable
import copy
import dataclasses
import itertools
from typing import Any

import numpy as np
from soft_bodies import soft_instance, WORLD

from scene_graph_ros.geometry import (
    Box,
    Capsule,
    Context,
    Convex,
    Cylinder,
    Ellipsoid,
    GeometryFrame,
    GeometryInstance,
    GeometrySet,
    HalfSpace,
    HeightField,
    Mesh,
    PointCloud,
    ProximityProperties,
    Role,
    SceneGraph,
    Sphere,
    VoxelGrid,
)

__all__ = ["TETRAHEDRON", "Renderer", "World", "answers_of", "at"]

TETRAHEDRON = np.array([[0.0, 0, 0], [0.3, 0, 0], [0, 0.3, 0], [0, 0, 0.3]])
_FACES = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
_POINTS = np.array([[0.11, 0.23, 0.31], [-0.4, 0.2, 0.9]])


def at(x: float, y: float, z: float, angle: float = 0.0) -> np.ndarray:
    """Return a pose that turns about z, and moves."""
    X, c, s = np.eye(4), np.cos(angle), np.sin(angle)
    X[:2, :2], X[:3, 3] = [[c, -s], [s, c]], (x, y, z)
    return X


class Renderer:
    """What a scene graph takes for a renderer."""

    type_name = "none"

    def parameter_yaml(self) -> str:
        """Return no parameters."""
        return ""

    def render(self) -> None:
        """Draw nothing."""


class World:
    """Two sources: an arm of frames, one on another, with a geometry of each kind; and a crate.

    ``prepare`` is done before the first question. ``own`` is whether the edited model is its own
    by now: else it is shared with a snapshot, which was asked, and an edit makes another. Edits
    are of the context, or ``of_graph``: then a new context of the graph answers.
    """

    def __init__(
        self,
        *,
        own: bool,
        of_graph: bool = False,
        prepare: Callable[[World], Any] = lambda world: None,
    ) -> None:
        graph = self.graph = SceneGraph()
        arm, other = self.arm, self.other = [graph.register_source(name) for name in ("arm", "o")]
        self.frames: dict[str, Any] = {}
        parent = None
        for k in range(3):
            parent = self.frames[f"link{k}"] = graph.register_frame(
                arm, GeometryFrame(f"link{k}"), parent=parent
            )
        self.frames["tool"] = graph.register_frame(arm, GeometryFrame("tool"))
        self.frames["crate"] = graph.register_frame(other, GeometryFrame("crate"))
        self.ids: dict[str, Any] = {}
        self._add("ball", "link0", at(0.1, 0, 0), Sphere(0.2))
        self._add("rod", "link1", at(0, 0.1, 0, 0.3), Capsule(0.1, 0.5))
        self._add("can", "link1", at(0.1, 0.1, 0.2), Cylinder(0.15, 0.3))
        self._add("egg", "link2", at(0, 0, 0.1), Ellipsoid(0.1, 0.2, 0.3))
        self._add("hull", "tool", np.eye(4), Convex(vertices=TETRAHEDRON))
        self._add("mesh", "tool", at(0.2, 0, 0), Mesh(vertices=TETRAHEDRON, faces=_FACES))
        self._add("box", "crate", at(0, 0, 0, 0.2), Box(0.3, 0.4, 0.5))
        self._hang("knob", "box", at(0.2, 0, 0), Sphere(0.05))
        self._hang("button", "knob", at(0.1, 0, 0), Sphere(0.04))
        self.ids["floor"] = graph.register_anchored_geometry(
            other, self.instance("floor", at(0, 0, -0.4), HalfSpace())
        )
        self.ids["picture"] = graph.register_geometry(
            arm, self.frames["link0"], GeometryInstance(np.eye(4), Sphere(0.1), "picture")
        )
        self.ids["pad"] = graph.register_deformable_geometry(
            arm, WORLD, soft_instance(X=at(0, 0, 2)), 0.2
        )
        self._add("seen", "crate", at(0, 0, 0.3), PointCloud([[0.1, 0, 0], [0, 0.1, 0.1]], 0.05))
        field = HeightField([[0.1, 0.2], [0.1, 0.3]], (1.0, 1.0), -0.1)
        self.ids["ground"] = graph.register_geometry(
            other, self.frames["crate"], GeometryInstance(np.eye(4), field, "ground")
        )
        self._add("map", "crate", at(0, 0, 0.5), VoxelGrid([[[1, 0], [2, 0]]], 0.05))
        graph.exclude_collisions_within(self.set_of("ball", "rod", "hull"))
        graph.add_renderer("first", Renderer())
        context = self.context = graph.create_default_context()
        context.set_frame_poses(arm, self.poses(0.0))
        context.set_frame_pose(other, self.frames["crate"], at(0.35, 0.1, 0.05, 0.4))
        self.target: Context | None = None if of_graph else context
        self.filter_id: Any = None
        self._is_own = own
        prepare(self)
        self._ask_first()

    def copy(self) -> World:
        """Return another world with the same model, which was asked and edited as this was first.

        This one must be as it was made. It takes a third of the time that making one takes.
        """
        result = copy.copy(self)
        result.graph, result.context = self.graph.clone(), self.context.clone()
        if self.target is not None:
            result.target = result.context
        result._ask_first()
        return result

    def _ask_first(self) -> None:
        """Have all questions answered; then the model becomes its own, where it is to be."""
        self.query = self.graph.query_object(self.context)
        answers_of(self)
        if self._is_own:
            for name in ("can of before", "can"):
                self.graph.rename_geometry(self.arm, self.ids["can"], name, context=self.target)

    def asked(self) -> tuple[Context, Any]:
        """Return the context that answers, and its queries."""
        if self.target is not None:
            return self.context, self.query
        context = self.graph.create_default_context()
        context.set_frame_poses(self.arm, self._of_all(context, self.arm))
        return context, self.graph.query_object(context)

    @staticmethod
    def _of_all(context: Context, source: Any) -> dict[Any, np.ndarray]:
        """Return poses of a source's frames that there are, none where another's is at home."""
        frames = context.inspector().frames_for_source(source)
        return {frame: at(0.1 * k, 0.05 * k, 0.02, 0.3 * k) for k, frame in enumerate(frames)}

    @staticmethod
    def instance(name: str, X: np.ndarray, shape: Any) -> GeometryInstance:
        """Return an instance with the proximity role."""
        result = GeometryInstance(X, shape, name)
        result.set_proximity_properties(ProximityProperties())
        return result

    def _add(self, name: str, frame: str, X: np.ndarray, shape: Any) -> None:
        source = self.other if frame == "crate" else self.arm
        self.ids[name] = self.graph.register_geometry(
            source, self.frames[frame], self.instance(name, X, shape)
        )

    def _hang(self, name: str, parent: str, X: np.ndarray, shape: Any) -> None:
        self.ids[name] = self.graph.register_geometry(
            self.other, self.ids[parent], self.instance(name, X, shape)
        )

    def set_of(self, *names: str) -> GeometrySet:
        """Return a set of geometries."""
        return GeometrySet([self.ids[name] for name in names])

    @staticmethod
    def poses(shift: float) -> np.ndarray:
        """Return poses of the arm's frames, all overlapping a little."""
        return np.array([at(0.1 * k + shift, 0.05 * k, 0.02 * k, 0.3 * k) for k in range(4)])


def _ids_by_pair(table: Any, names: dict[int, str], fields: tuple[str, ...]) -> Any:
    pairs = [(names[int(a)], names[int(b)]) for a, b in zip(table.id_A, table.id_B, strict=True)]
    return pairs, *(getattr(table, field).tolist() for field in fields)


def _values(properties: Any) -> list[tuple[str, str, str]]:
    """Return all of a role's properties; what they show themselves as is cut."""
    return [
        (group, name, _words(value))
        for group in sorted(properties.get_group_names())
        for name, value in sorted(properties.get_properties_in_group(group).items())
    ]


def _words(value: Any) -> str:
    """Return what a value is shown as, without the standard library's repr of a dataclass.

    That is "..." for good, for the object and thread, where it was interrupted.
    """
    if not dataclasses.is_dataclass(value):
        return repr(value)
    fields = [repr(getattr(value, field.name)) for field in dataclasses.fields(value)]
    return f"{type(value).__name__}{fields}"


def _model(inspector: Any, names: dict[int, str]) -> dict[str, Any]:
    """Return what an inspector knows of each thing, by all ways that lead to it."""

    def of(ids: Any) -> list[str]:
        return [names[int(each)] for each in ids]

    found: dict[str, Any] = {
        "sources": [
            (
                inspector.get_name(s),
                of(inspector.frames_for_source(s)),
                of(inspector.get_geometries_for_source(s)),
                inspector.get_source_id_by_name(inspector.get_name(s)) == s,
            )
            for s in inspector.get_all_source_ids()
        ],
        "with role": [of(inspector.get_all_geometry_ids(role)) for role in Role if role.value],
        "deformable": of(inspector.get_all_deformable_geometry_ids()),
    }
    for f in inspector.get_all_frame_ids():
        owner = inspector.get_owning_source_id(f)
        name = names[int(f)]
        found[f"frame {name}"] = (
            names[int(inspector.get_parent_frame(f))],
            of(inspector.get_child_frames(f)),
            [of(inspector.get_geometries(f, role)) for role in (None, *Role)],
            name == "world" or inspector.get_frame_id_by_name(owner, name) == f,
        )
    for g in inspector.get_all_geometry_ids():
        frame, name = inspector.get_frame_id(g), names[int(g)]
        roles = [role for role in Role if role.value and role in inspector.get_roles(g)]
        parent = inspector.get_parent_geometry(g)
        found[f"geometry {name}"] = (
            names[int(frame)],
            None if parent is None else names[int(parent)],
            _words(inspector.get_shape(g)),
            [(role, _values(inspector.get_properties(g, role))) for role in roles],
            inspector.get_pose_in_frame(g).tolist(),
            inspector.get_pose_in_parent(g).tolist(),
            [inspector.get_geometry_id_by_name(frame, role, name) == g for role in roles],
        )
    return found


def answers_of(world: World) -> dict[str, Any]:
    """Return all that a world's context answers, by the names of what it is about."""
    context, query = world.asked()
    inspector = context.inspector()
    frames, ids = inspector.get_all_frame_ids(), inspector.get_all_geometry_ids()
    names = {int(each): inspector.get_name(each) for each in (*frames, *ids)}
    found = _model(inspector, names)
    for source in inspector.get_all_source_ids():
        if inspector.get_name(source) in ("arm", "o"):
            found[f"X_PF of {inspector.get_name(source)}"] = context.frame_poses(source).tolist()
    for f in frames:
        found[f"X_WF of {names[int(f)]}"] = (
            query.get_pose_in_world(f).tolist(),
            query.get_pose_in_parent(f).tolist(),
            context.frame_pose(f).tolist(),
        )
    near = [g for g in ids if inspector.get_properties(g, Role.PROXIMITY) is not None]
    found["filtered"] = [
        (names[int(a)], names[int(b)])
        for a, b in itertools.combinations(near, 2)
        if inspector.collision_filtered(a, b)
    ]
    for g in ids:
        if inspector.is_deformable(g):
            found[f"q_WG of {names[int(g)]}"] = context.configuration(g).tolist()
        if isinstance(inspector.get_shape(g), PointCloud):
            found[f"points of {names[int(g)]}"] = context.points(g).tolist()
        if isinstance(inspector.get_shape(g), HeightField):
            found[f"heights of {names[int(g)]}"] = context.heights(g).tolist()
        if isinstance(inspector.get_shape(g), VoxelGrid):
            found[f"voxels of {names[int(g)]}"] = context.voxels(g).tolist()
    found["depth"] = _ids_by_pair(
        query.compute_point_pair_penetration(), names, ("depth", "p_WCa", "p_WCb", "nhat_BA_W")
    )
    found["distance"] = _ids_by_pair(
        query.compute_signed_distance_pairwise_closest_points(max_distance=0.2),
        names,
        ("distance", "p_ACa", "p_BCb"),
    )
    found["candidates"] = [
        (names[int(pair.id_A)], names[int(pair.id_B)])
        for pair in query.find_collision_candidates()
    ]
    points = query.compute_signed_distance_to_points(_POINTS)
    found["points"] = (
        [names[int(g)] for g in points.id_G],
        points.distance.tolist(),
        points.p_GN.tolist(),
    )
    found["renderers"] = world.graph.registered_renderer_names(context=context)
    found["accuracy"] = str(world.graph.accuracy), len(query.compute_point_pair_penetration())
    return found
