"""All that a collision checker knows at one time: a value, so that it changes at once."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.model.ids import GeometryId
from scene_graph_ros.geometry.model.snapshot import Snapshot
from scene_graph_ros.planning.checker.added_shapes import AddedShape, furnished
from scene_graph_ros.planning.checker.body_matrices import BodyMatrices, CHECKED, FILTERED
from scene_graph_ros.planning.checker.checker_bodies import CheckerBodies
from scene_graph_ros.planning.checker.robot_instances import robot_instances
from scene_graph_ros.planning.diagrams.robot_diagram import RobotDiagram
from scene_graph_ros.planning.errors import finite_number
from scene_graph_ros.planning.pairs.checker_plan import CheckerPlan, make_plan, placed
from scene_graph_ros.robots.kinematic_tree import KinematicTree

__all__ = ["CheckerState", "GeometryPadding", "make_state"]


class GeometryPadding(NamedTuple):
    """Paddings of geometries from others, by their ids' values; None: from all."""

    of: frozenset[int] | None
    to: frozenset[int] | None
    padding: float
    """Metres."""

    @classmethod
    def of_ids(
        cls, of: Iterable[GeometryId] | None, to: Iterable[GeometryId] | None, padding: float
    ) -> GeometryPadding:
        """Return the value; raises CollisionCheckerError for a padding that is not finite."""
        one, other = (
            None if ids is None else frozenset(int(each) for each in ids) for ids in (of, to)
        )
        return cls(one, other, finite_number("padding", padding))

    def of_pairs(self, plan: CheckerPlan) -> NDArray[np.bool_]:
        """Return a mask ``(p,)`` of the plan's pairs that it is about."""
        ids = np.array([int(each) for each in plan.geometry_ids], dtype=np.int64)
        both = ids[plan.all_pairs.table.bodies]
        one, other = (
            np.full(both.shape, side is None) if side is None else np.isin(both, list(side))
            for side in (self.of, self.to)
        )
        found = one & other[:, ::-1]
        return found[:, 0] | found[:, 1]


class CheckerState(NamedTuple):
    """A moment of a scene, added shapes, and the checked pairs. Changes make another one."""

    base: Snapshot
    """Without the shapes that were added."""
    snapshot: Snapshot
    """With them."""
    links: Mapping[int, int]
    """The link (row of the tree) of each frame that is one, by the id's value."""
    bodies: CheckerBodies
    nominal: BodyMatrices
    """As the scene and what is welded have it, without padding."""
    matrices: BodyMatrices
    added: tuple[AddedShape, ...]
    plan: CheckerPlan
    bodies_of_all: NDArray[np.int64]
    """``(p, 2)``: the bodies of both geometries of all the plan's pairs, the robot's first."""
    body_of: NDArray[np.int64]
    """The same for those that are checked."""
    geometry_paddings: tuple[GeometryPadding, ...] = ()
    """What overrules the bodies' paddings; later ones overrule earlier ones."""

    def with_matrices(self, matrices: BodyMatrices) -> CheckerState:
        """Return the state with other paddings and filters."""
        every = self.plan.all_pairs
        a, b = self.bodies_of_all.T
        # Pairs of other robots are never checked.
        is_robot = a < self.bodies.num_robot_bodies
        a = np.where(is_robot, a, 0)
        # What the scene filters of some geometries of a body only stays filtered.
        is_opened = self.nominal.filtered[a, b] == FILTERED
        checked = (matrices.filtered[a, b] == CHECKED) & (every.allowed | is_opened) & is_robot
        paddings = matrices.padding[a, b]
        for each in self.geometry_paddings:
            paddings[each.of_pairs(self.plan)] = each.padding
        plan = self.plan.with_pairs(checked, paddings)
        return self._replace(matrices=matrices, plan=plan, body_of=self.bodies_of_all[checked])

    def padded(self, environment: float | None, own: float | None) -> CheckerState:
        """Return the state with paddings (m) to all around robots, and between their bodies.

        None leaves them. Raises CollisionCheckerError unless they are finite.
        """
        matrices = self.matrices
        if environment is not None:
            number = finite_number("env_collision_padding", environment)
            matrices = matrices.with_environment_padding(number)
        if own is not None:
            matrices = matrices.with_robot_padding(finite_number("self_collision_padding", own))
        return self.with_matrices(matrices)

    def with_geometry_paddings(self, paddings: Iterable[GeometryPadding]) -> CheckerState:
        """Return the state with just these paddings of pairs of geometries."""
        return self._replace(geometry_paddings=tuple(paddings)).with_matrices(self.matrices)

    def with_added(self, added: Iterable[AddedShape]) -> CheckerState:
        """Return the state with just these shapes added to its scene."""
        shapes = tuple(added)
        snapshot = furnished(self.base, shapes)
        plan = make_plan(snapshot, self.plan.tree, self.links)
        plan = plan._replace(other_positions=self.plan.other_positions)
        both = _bodies_of_pairs(snapshot, self.bodies, plan)
        state = self._replace(snapshot=snapshot, added=shapes, plan=plan, bodies_of_all=both)
        return state.with_matrices(self.matrices)

    def at(self, moment: Snapshot, tree: KinematicTree | None = None) -> CheckerState:
        """Return the state with all that no joint moves where another moment has it.

        Robots stand where ``tree``, which is this one's but for that, has them.
        """
        snapshot, before = moment, self.plan if tree is None else self.plan._replace(tree=tree)
        if self.added:
            snapshot = Snapshot(
                self.snapshot.state,
                moment.X_PF,
                moment.pose_version,
                configurations=moment.configurations,
            )
        return self._replace(base=moment, snapshot=snapshot, plan=placed(before, snapshot))


def make_state(
    model: RobotDiagram, snapshot: Snapshot, robots: Iterable[str] | None
) -> CheckerState:
    """Return the state of a moment of a scene, without padding.

    ``robots`` are those that it is for; None: all. Raises CollisionCheckerError for other names.
    """
    instances = robot_instances(model, snapshot, robots)
    tree = model.tree
    links = {int(frame): tree.link_index(name) for name, frame in model.frames.items()}
    bodies = CheckerBodies(snapshot, tree, model.frames, instances)
    plan = make_plan(snapshot, tree, links)._replace(other_positions=instances.others)
    joint_of_link = np.array((*tree.joint_of_link, 0), dtype=np.int64)
    # What is around the robots has link -1, which is the last: it is welded to the base.
    joints = joint_of_link[[body.link for body in bodies.all]]
    count = bodies.num_robot_bodies
    both = _bodies_of_pairs(snapshot, bodies, plan)
    has_pair, has_allowed = np.zeros((2, count, len(bodies)), dtype=np.bool_)
    is_own = both[:, 0] < count
    for flags, chosen in ((has_pair, is_own), (has_allowed, is_own & plan.all_pairs.allowed)):
        pairs = both[chosen]
        flags[pairs[:, 0], pairs[:, 1]] = True
        own = pairs[pairs[:, 1] < count]
        flags[own[:, 1], own[:, 0]] = True
    is_welded = joints[:count, np.newaxis] == joints
    nominal = BodyMatrices.of(bodies, is_welded | (has_pair & ~has_allowed))
    state = CheckerState(snapshot, snapshot, links, bodies, nominal, nominal, (), plan, both, both)
    return state.with_matrices(nominal)


def _bodies_of_pairs(
    snapshot: Snapshot, bodies: CheckerBodies, plan: CheckerPlan
) -> NDArray[np.int64]:
    """Return the bodies of the geometries of all pairs ``(p, 2)``, first one of the robots'."""
    frames = snapshot.state.layout().ids
    body_of_frame = np.array([bodies.index_of_frame[each] for each in frames], dtype=np.int64)
    result: NDArray[np.int64] = body_of_frame[plan.all_pairs.frames]
    robots = bodies.num_robot_bodies
    is_turned = (result[:, 0] >= robots) & (result[:, 1] < robots)
    result[is_turned] = result[is_turned, ::-1]
    return result
