"""Drake: its SceneGraphCollisionChecker, one thread."""

from __future__ import annotations

import importlib
from typing import Any

import numpy as np

from benchmarks.peer_shapes import drake_shape, hull_triangles
from benchmarks.robot_engines.robot_world import RobotWorld
from scene_graph_ros.geometry import HalfSpace, Mesh, Shape
from scene_graph_ros.geometry.optimization import HPolyhedron

__all__ = ["DrakeEngine"]


class DrakeEngine:
    """``CheckConfigsCollisionFree``, ``CheckEdgesCollisionFree`` and ``CalcRobotClearance``.

    The last has no distances of hulls from half spaces, which are left out of it and of IrisZo.
    """

    name = "Drake"

    def __init__(self, world: RobotWorld, step: float) -> None:
        self._world, self._step = world, step
        self._without_half_spaces: DrakeEngine | None = None
        planning: Any = importlib.import_module("pydrake.planning")
        tree: Any = importlib.import_module("pydrake.multibody.tree")
        math: Any = importlib.import_module("pydrake.math")
        geometry: Any = importlib.import_module("pydrake.geometry")
        builder = planning.RobotDiagramBuilder(time_step=0.0)
        plant, graph = builder.plant(), builder.scene_graph()
        instance = plant.AddModelInstance("robot")
        around = plant.AddModelInstance("around")
        inertia = tree.SpatialInertia(1.0, np.zeros(3), tree.UnitInertia(1.0, 1.0, 1.0))
        frames = [plant.world_body()]
        ends = world.all_positions(np.stack([world.tree.lower, world.tree.upper]))
        limits = zip(ends.min(axis=0), ends.max(axis=0), strict=True)
        for name, turns, parent, X in world.placed_joints():
            body = plant.AddRigidBody(name, instance, inertia)
            kind = tree.RevoluteJoint if turns else tree.PrismaticJoint
            parent_frame = plant.AddFrame(
                tree.FixedOffsetFrame(
                    f"parent of {name}",
                    frames[parent].body_frame(),
                    math.RigidTransform(X),
                    instance,
                )
            )
            axis = [0.0, 0.0, 1.0]
            plant.AddJoint(kind(name, parent_frame, body.body_frame(), axis, *next(limits)))
            frames.append(body)
        bodies = []
        for k, thing in enumerate(world.things):
            # Pairs are left out by bodies, so each geometry has one of its own; a half space that
            # is welded to the world, but not of it, makes Drake crash.
            if isinstance(thing.shape, HalfSpace):
                bodies.append(plant.world_body())
                continue
            body = plant.AddRigidBody(f"thing_{k}", instance if thing.joint else around, inertia)
            X = math.RigidTransform(np.ascontiguousarray(thing.X))
            plant.WeldFrames(frames[thing.joint].body_frame(), body.body_frame(), X)
            bodies.append(body)
        friction = importlib.import_module("pydrake.multibody.plant").CoulombFriction(1.0, 1.0)
        ids = []
        for k, (thing, body) in enumerate(zip(world.things, bodies, strict=True)):
            is_here = isinstance(thing.shape, HalfSpace)
            X = math.RigidTransform(np.ascontiguousarray(thing.X) if is_here else np.eye(4))
            shape = _shape(thing.shape)
            ids.append(plant.RegisterCollisionGeometry(body, X, shape, f"{k}", friction))
        filters = graph.collision_filter_manager()
        for a, b in world.excluded:
            declaration = geometry.CollisionFilterDeclaration()
            filters.Apply(
                declaration.ExcludeBetween(
                    geometry.GeometrySet(ids[a]), geometry.GeometrySet(ids[b])
                )
            )
        plant.Finalize()
        self._checker = planning.SceneGraphCollisionChecker(
            model=builder.Build(),
            robot_model_instances=[instance],
            edge_step_size=step,
            configuration_distance_function=None,
        )
        self._single = importlib.import_module("pydrake.common").Parallelism(1)

    def collide(self, q: np.ndarray) -> np.ndarray:
        """See RobotEngine."""
        positions = self._world.all_positions(q)
        free = self._checker.CheckConfigsCollisionFree(positions, parallelize=self._single)
        return np.array(free) == 0

    def edges_collide(self, edges: np.ndarray, step: float) -> np.ndarray:
        """See RobotEngine; its step was chosen when it was made."""
        assert step == self._step
        ends = [self._world.all_positions(edge) for edge in edges]
        free = self._checker.CheckEdgesCollisionFree(ends, parallelize=self._single)
        return np.array(free) == 0

    def clearances(self, q: np.ndarray, influence: float) -> np.ndarray:
        """See ClearanceEngine."""
        checker, positions = self._measuring(), self._world.all_positions(q)
        return np.array([checker.CalcRobotClearance(each, influence).size() for each in positions])

    def _measuring(self) -> Any:
        """Return a checker that may be asked for distances."""
        if self._without_half_spaces is None:
            world = self._world.without_half_spaces()
            self._without_half_spaces = DrakeEngine(world, self._step)
        return self._without_half_spaces._checker

    def visibility_graph(self, points: np.ndarray) -> Any:
        """Return Drake's ``VisibilityGraph`` of configurations ``(n, nq)``, of sampled edges."""
        planning: Any = importlib.import_module("pydrake.planning")
        columns = np.asfortranarray(self._world.all_positions(points).T)
        return planning.VisibilityGraph(self._checker, columns, parallelize=self._single)

    def region(self, way: str, center: np.ndarray, radius: float, ellipsoids: int) -> HPolyhedron:
        """Return Drake's region around a ball at ``(nq,)``, by ``way``: IrisZo or IrisNp2.

        A joint that follows another one is one more dimension, as Drake's plant has it. It asks
        for clearances, too.
        """
        planning: Any = importlib.import_module("pydrake.planning")
        sets: Any = importlib.import_module("pydrake.geometry.optimization")
        tree = self._world.tree
        ends = self._world.all_positions(np.stack([tree.lower, tree.upper]))
        at = self._world.all_positions(center[np.newaxis])[0]
        options = getattr(planning, f"{way}Options")()
        options.sampled_iris_options.parallelism = self._single
        options.sampled_iris_options.max_iterations = ellipsoids
        found = getattr(planning, way)(
            self._measuring(),
            sets.Hyperellipsoid.MakeHypersphere(radius, at),
            sets.HPolyhedron.MakeBox(ends.min(axis=0), ends.max(axis=0)),
            options,
        )
        return HPolyhedron(found.A(), found.b())

    def cover(self, seed: int, way: str, share: float, points: int) -> list[HPolyhedron]:
        """Return Drake's regions that cover a share of what is free.

        By ``way``, ``np`` or ``zo``, one ellipsoid for each, from so many points a round.
        """
        planning: Any = importlib.import_module("pydrake.planning")
        options = planning.IrisFromCliqueCoverOptions()
        if way == "np":
            sets: Any = importlib.import_module("pydrake.geometry.optimization")
            options.iris_options = sets.IrisOptions(iteration_limit=1)
        else:
            chosen = planning.IrisZoOptions()
            chosen.sampled_iris_options.max_iterations = 1
            chosen.sampled_iris_options.parallelism = self._single
            options.iris_options = chosen
        options.coverage_termination_threshold = share
        options.num_points_per_visibility_round = points
        options.parallelism = self._single
        generator = importlib.import_module("pydrake.common").RandomGenerator(seed)
        find = planning.IrisInConfigurationSpaceFromCliqueCover
        found = find(self._checker, options, generator, [])
        return [HPolyhedron(each.A(), each.b()) for each in found]


def _shape(shape: Shape) -> Any:
    """Return Drake's shape; of a mesh its hull."""
    if not isinstance(shape, Mesh):
        return drake_shape(shape)
    convex: Any = importlib.import_module("pydrake.geometry").Convex
    return convex(points=hull_triangles(shape)[0].T, label="hull")
