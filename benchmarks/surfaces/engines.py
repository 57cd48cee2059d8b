"""Contact surfaces of many pairs at once: ours, and Drake's by way of pydrake."""

from __future__ import annotations

from collections.abc import Sequence
import importlib
import itertools
from typing import Any, NamedTuple, Protocol

import numpy as np

from benchmarks.peer_shapes import drake_shape
from benchmarks.surfaces.cases import Body, Configuration, DEEPEST, MODULUS
from scene_graph_ros.geometry import (
    add_compliant_hydroelastic_properties,
    add_compliant_hydroelastic_properties_for_half_space,
    add_rigid_hydroelastic_properties,
    GeometryFrame,
    GeometryInstance,
    HalfSpace,
    ProximityProperties,
    SceneGraph,
)

__all__ = ["ENGINES", "Engine", "Found", "Refused"]


class Refused(Exception):  # noqa: N818
    """The engine has no contact surface for this pair."""


class Found(NamedTuple):
    """What an engine's contact surface amounts to."""

    pair: int
    force_W: np.ndarray
    """(3,) N on the upper body."""
    moment_W: np.ndarray
    """(3,) Nm on the upper body about the point C."""
    area: float
    faces: int


class Engine(Protocol):
    """One engine with one scene: all pairs of a case, at one resolution."""

    name: str

    def __init__(self, pairs: Sequence[Configuration], hint: float) -> None: ...

    def move(self, k: int) -> None:
        """Give all bodies their k-th poses."""

    def ask(self, representation: str) -> Any:
        """Return all contact surfaces, as "triangle" or "polygon"; raises Refused."""

    def integrals(self, result: Any) -> list[Found]:
        """Return what the surfaces amount to; they must be of the 0-th poses."""


def _of_pairs(pairs: Sequence[Configuration]) -> list[tuple[int, Body, bool]]:
    """Return (pair, body, whether it is the upper one) of all bodies that move."""
    moving = []
    for i, pair in enumerate(pairs):
        moving.append((i, pair.upper, True))
        if not isinstance(pair.lower.shape, HalfSpace):
            moving.append((i, pair.lower, False))
    return moving


class Ours:
    """The scene in a ``SceneGraph``."""

    name = "scene_graph_ros"

    def __init__(self, pairs: Sequence[Configuration], hint: float) -> None:
        self._pairs = pairs
        self._owner: dict[int, tuple[int, bool]] = {}
        graph = SceneGraph()
        self._source = source = graph.register_source("benchmark")
        bodies = _of_pairs(pairs)
        for i, body, is_upper in bodies:
            frame = graph.register_frame(source, GeometryFrame(f"frame {i} {is_upper}"))
            instance = GeometryInstance(np.eye(4), body.shape, f"body {i} {is_upper}")
            geometry = graph.register_geometry(source, frame, instance)
            graph.assign_role(source, geometry, _properties(body, hint))
            self._owner[int(geometry)] = (i, is_upper)
        if isinstance(pairs[0].lower.shape, HalfSpace):
            instance = GeometryInstance(np.eye(4), HalfSpace(), "floor")
            floor = graph.register_anchored_geometry(source, instance)
            graph.assign_role(source, floor, _properties(pairs[0].lower, hint))
        self._context = graph.create_default_context()
        self._query = graph.query_object(self._context)
        self._sets = np.array(
            [[pairs[i].X_WPs[k] @ body.X_PG for i, body, _ in bodies] for k in (0, 1)]
        )

    def move(self, k: int) -> None:
        """See Engine."""
        self._context.set_frame_poses(self._source, self._sets[k])

    def ask(self, representation: str) -> Any:
        """See Engine."""
        return self._query.compute_contact_surfaces(representation)

    def integrals(self, result: Any) -> list[Found]:
        """See Engine."""
        found = []
        for surface in result:
            owner = self._owner.get(int(surface.id_M))
            pair, is_upper = owner or (self._owner[int(surface.id_N)][0], False)
            force, moment = surface.force_and_moment(self._pairs[pair].p_WC)
            sign = 1.0 if is_upper else -1.0
            area = float(surface.face_areas.sum())
            found.append(Found(pair, sign * force, sign * moment, area, surface.num_faces))
        return found


def _properties(body: Body, hint: float) -> ProximityProperties:
    properties = ProximityProperties()
    if not body.is_compliant:
        add_rigid_hydroelastic_properties(properties, hint)
    elif isinstance(body.shape, HalfSpace):
        add_compliant_hydroelastic_properties_for_half_space(properties, DEEPEST, MODULUS)
    else:
        add_compliant_hydroelastic_properties(properties, hint, MODULUS)
    return properties


class Drake:
    """``pydrake.geometry.QueryObject.ComputeContactSurfaces``."""

    name = "Drake"

    def __init__(self, pairs: Sequence[Configuration], hint: float) -> None:
        self._drake = drake = importlib.import_module("pydrake.geometry")
        self._math = importlib.import_module("pydrake.math")
        self._pairs = pairs
        self._owner: dict[Any, tuple[int, bool]] = {}
        graph = drake.SceneGraph()
        source = graph.RegisterSource("benchmark")
        self._frames = []
        bodies = _of_pairs(pairs)
        for i, body, is_upper in bodies:
            frame = graph.RegisterFrame(source, drake.GeometryFrame(f"frame_{i}_{is_upper}"))
            self._frames.append(frame)
            geometry = graph.RegisterGeometry(source, frame, self._instance(body, hint, f"{i}"))
            self._owner[geometry] = (i, is_upper)
        if isinstance(pairs[0].lower.shape, HalfSpace):
            floor = self._instance(pairs[0].lower, hint, "floor")
            graph.RegisterAnchoredGeometry(source, floor)
        self._graph, self._context = graph, graph.CreateDefaultContext()
        self._port = graph.get_source_pose_port(source)
        self._sets = [self._poses(bodies, k) for k in (0, 1)]
        self.move(0)
        self._query = graph.get_query_output_port().Eval(self._context)

    def _instance(self, body: Body, hint: float, name: str) -> Any:
        drake = self._drake
        properties = drake.ProximityProperties()
        if not body.is_compliant:
            drake.AddRigidHydroelasticProperties(hint, properties)
        elif isinstance(body.shape, HalfSpace):
            drake.AddCompliantHydroelasticPropertiesForHalfSpace(DEEPEST, MODULUS, properties)
        else:
            drake.AddCompliantHydroelasticProperties(hint, MODULUS, properties)
        shape = drake_shape(body.shape)
        instance = drake.GeometryInstance(self._math.RigidTransform(), shape, name)
        instance.set_proximity_properties(properties)
        return instance

    def _poses(self, bodies: Sequence[tuple[int, Body, bool]], k: int) -> Any:
        poses = self._drake.FramePoseVector()
        for frame, (i, body, _) in zip(self._frames, bodies, strict=True):
            X_WG = self._pairs[i].X_WPs[k] @ body.X_PG
            rotation = self._math.RotationMatrix.ProjectToRotationMatrix(X_WG[:3, :3])
            poses.set_value(frame, self._math.RigidTransform(rotation, X_WG[:3, 3]))
        return poses

    def move(self, k: int) -> None:
        """See Engine."""
        self._port.FixValue(self._context, self._sets[k])

    def ask(self, representation: str) -> Any:
        """See Engine."""
        kinds = self._drake.HydroelasticContactRepresentation
        kind = {"triangle": kinds.kTriangle, "polygon": kinds.kPolygon}[representation]
        try:
            return self._query.ComputeContactSurfaces(kind)
        except RuntimeError as error:
            raise Refused(str(error)) from error

    def integrals(self, result: Any) -> list[Found]:
        """See Engine: the faces are summed up here, for Drake's surfaces have no force."""
        found = []
        for surface in result:
            owner = self._owner.get(surface.id_M())
            pair, is_upper = owner or (self._owner[surface.id_N()][0], False)
            force, moment = _pressed(surface, self._pairs[pair].p_WC)
            sign = 1.0 if is_upper else -1.0
            area = surface.total_area()
            found.append(Found(pair, sign * force, sign * moment, area, surface.num_faces()))
        return found


def _pressed(surface: Any, p_WC: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return force and moment about C on M, exact for pressure that is linear on the faces."""
    is_triangle = surface.is_triangle()
    mesh = surface.tri_mesh_W() if is_triangle else surface.poly_mesh_W()
    field = surface.tri_e_MN() if is_triangle else surface.poly_e_MN()
    vertices = np.array([mesh.vertex(v) for v in range(mesh.num_vertices())]) - p_WC
    pressures = np.array([field.EvaluateAtVertex(v) for v in range(mesh.num_vertices())])
    corners, normals = [], []
    for f in range(surface.num_faces()):
        face = mesh.element(f)
        rows = [face.vertex(i) for i in range(face.num_vertices())]
        fans = [(rows[0], a, b) for a, b in itertools.pairwise(rows[1:])]
        corners += fans
        normals += [surface.face_normal(f)] * len(fans)
    p, x, n = pressures[np.array(corners)], vertices[np.array(corners)], np.array(normals)
    u, v = x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]
    areas = 0.5 * np.einsum("ij,ij->i", n, np.cross(u, v))
    force = (areas * p.mean(axis=1)) @ n
    # The integral of x p over a triangle is A / 12 (sum x_i p_i + sum x_i sum p_i).
    moments = np.einsum("tij,ti->tj", x, p) + x.sum(axis=1) * p.sum(axis=1)[:, None]
    return force, np.cross(areas[:, None] / 12.0 * moments, n).sum(axis=0)


ENGINES: tuple[type[Engine], ...] = (Ours, Drake)
