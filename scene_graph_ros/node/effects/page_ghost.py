"""A robot as a page drags it: inverse kinematics, and its collisions there.

Imported when a page first holds a link.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from msg_adapters.errors import MessageError
from scene_graph_ros.geometry.model.ids import GeometryId
from scene_graph_ros.geometry.model.roles import Role
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.node.world.planning_robots import PlanningRobots
from scene_graph_ros.node.world.world import WorldSnapshot
from scene_graph_ros.planning import inverse_kinematics_of_poses
from scene_graph_ros.planning.ik.tool_chain import carrying_positions

__all__ = ["Ghost", "Reached", "moved_geometries"]

_REACHED = 1e-9
"""m and rad: the link is where it was dragged."""

_ROLES = (Role.ILLUSTRATION, Role.PROXIMITY, Role.PERCEPTION)

_MOST_COLLISIONS = 8
"""Pairs that are told, the deepest."""


class Reached(NamedTuple):
    """How far the robot follows its link, and its collisions there."""

    X_WL: NDArray[np.float64]
    """``(4, 4)``: where the link is."""
    is_reached: bool
    position_error: float
    """m, from where it was dragged."""
    rotation_error: float
    """rad."""
    collisions: tuple[tuple[str, str, float], ...]
    """Names of geometries that would collide, and how deep (m); the deepest first."""
    colliding: tuple[int, ...]
    """Ids of all of these, and of all other geometries on their links."""


class Ghost:
    """One robot that is held by one link; for one thread."""

    def __init__(self, snapshot: WorldSnapshot, robot: str, link: str, group: str) -> None:
        """Hold it where it is.

        Raises UnknownIdError and NameConflictError for names, and MessageError for a link that no
        joint of the group carries.
        """
        self.snapshot = snapshot
        robots = _robots(snapshot)
        path = f"{robot}/{link}"
        self.link = robots.links.names[robots.links.row(path, "link")]
        self.groups = _groups(robots, self.link)
        if group:
            group = robots.groups.names[robots.groups.row(group, "group")]
        else:
            group = self.groups[0] if self.groups else ""
        self.group = group
        self.moving = _moving(robots, self.link, group)
        if not len(self.moving):
            of = f"of group {quoted(group)} " if group else ""
            raise MessageError(f"no joint {of}carries link {quoted(path)}")
        self.names = robots.tree.position_names
        self.robots = robots
        self.q = robots.present(snapshot.positions)
        self._goal = robots.tree.link_poses(self.q, [self.link])[0]
        self.has_moved = False

    def follow(self, snapshot: WorldSnapshot) -> None:
        """See another moment: positions that the page does not drag are those of then.

        Raises UnknownIdError where the robots are others than before.
        """
        robots = _robots(snapshot)
        if robots.tree.position_names != self.names:
            raise MessageError("the scene has other robots than when the link was taken hold of")
        present = robots.present(snapshot.positions)
        if self.has_moved:
            present[self.moving] = self.q[self.moving]
        self.snapshot, self.robots, self.q = snapshot, robots, present
        if not self.has_moved:
            self._goal = robots.tree.link_poses(present, [self.link])[0]

    def drag(self, X_WL: NDArray[np.float64]) -> None:
        """Bring the link there, or as near as it comes, from where it is.

        Raises InvalidPoseError and InverseKinematicsError.
        """
        found = inverse_kinematics_of_poses(
            self.robots.tree,
            self.link,
            X_WL[np.newaxis],
            near=self.q,
            group=self.group or None,
        )
        self.q, self._goal, self.has_moved = found.configurations[0], X_WL, True

    def reached(self) -> Reached:
        """Return the link's pose and errors, and the collisions there."""
        X_WL = self.robots.tree.link_poses(self.q, [self.link])[0]
        away = float(np.linalg.norm(X_WL[:3, 3] - self._goal[:3, 3]))
        turned = _angle(X_WL[:3, :3].T @ self._goal[:3, :3])
        collisions, colliding = self._collisions()
        # Rounding of a product of poses is not the tool's error.
        slack = 1e-12 * max(1.0, float(np.abs(self._goal[:3, 3]).max()))
        is_reached = away <= _REACHED + slack and turned <= 10.0 * _REACHED
        return Reached(X_WL, is_reached, away, turned, collisions, colliding)

    def _collisions(self) -> tuple[tuple[tuple[str, str, float], ...], tuple[int, ...]]:
        checker = self.robots.checker(
            self.snapshot.query.snapshot, environment_padding=0.0, self_padding=0.0
        )
        near = checker.calc_clearance_columns(self.q[np.newaxis], 0.0)
        order = np.argsort(near.distance, kind="stable")
        order = order[near.distance[order] < 0.0]
        pairs = np.column_stack([near.id_A, near.id_B])[order]
        path = self.snapshot.names.geometry_path
        told = tuple(
            (path(int(one)), path(int(other)), -float(distance))
            for (one, other), distance in zip(
                pairs[:_MOST_COLLISIONS], near.distance[order], strict=False
            )
        )
        return told, self._with_their_links({int(i) for i in pairs.ravel()})

    def _with_their_links(self, ids: set[int]) -> tuple[int, ...]:
        """Return ids of geometries, and of all others on the same links."""
        inspector = self.snapshot.inspector
        carried = self.robots.carried(self.snapshot.query.snapshot)
        frames = {int(inspector.get_frame_id(GeometryId(i))) for i in ids} & {
            int(frame) for frame in carried
        }
        more = (
            int(i)
            for role in _ROLES
            for i in inspector.get_all_geometry_ids(role)
            if int(inspector.get_frame_id(i)) in frames
        )
        return tuple(sorted(ids.union(more)))

    def geometries(self) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        """Return ids ``(n,)`` of all that dragged joints carry, and poses ``(n, 4, 4)`` in W."""
        ids, X_WGs = moved_geometries(self.robots, self.snapshot, self.q[np.newaxis], self.moving)
        return ids, X_WGs[0]


def moved_geometries(
    robots: PlanningRobots,
    snapshot: WorldSnapshot,
    q: NDArray[np.float64],
    moving: NDArray[np.intp],
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Return ids ``(n,)`` of geometries that positions move, and poses ``(k, n, 4, 4)`` in W.

    ``q`` is ``(k, nq)``, ``moving`` the rows of the positions.
    """
    core, inspector = snapshot.query.snapshot, snapshot.inspector
    carried = robots.carried(core)
    moves = _moved_links(robots, moving)
    X_WL = robots.tree.link_poses(q)
    found = {int(i): i for role in _ROLES for i in inspector.get_all_geometry_ids(role)}
    ids, poses = [], []
    for number, geometry in sorted(found.items()):
        where = carried.get(inspector.get_frame_id(geometry))
        if where is None or inspector.is_deformable(geometry):
            continue
        link, X_LF = where
        if not moves[link]:
            continue
        ids.append(number)
        poses.append(X_WL[:, link] @ X_LF @ inspector.get_pose_in_frame(geometry))
    stacked = np.stack(poses, axis=1) if poses else np.empty((len(q), 0, 4, 4))
    return np.array(ids, dtype=np.int64), stacked


def _robots(snapshot: WorldSnapshot) -> PlanningRobots:
    robots: PlanningRobots = snapshot.robots.planning(snapshot.query.snapshot, snapshot.bases)
    return robots


def _moving(robots: PlanningRobots, link: str, group: str) -> NDArray[np.intp]:
    """Return the rows of the positions of a group, "" for all, that carry a link."""
    tree = robots.tree
    carries = carrying_positions(tree, link)
    if group:
        own = np.zeros_like(carries)
        own[tree.group_positions(group)] = True
        carries = carries & own
    return np.flatnonzero(carries)


def _groups(robots: PlanningRobots, link: str) -> tuple[str, ...]:
    """Return the robot's groups with joints that carry a link: most of them first, then small."""
    tree, robot = robots.tree, robots.robot_of(link)
    counts: Mapping[str, tuple[int, int]] = {
        name: (-len(_moving(robots, link, name)), len(tree.group_positions(name)))
        for name in tree.groups
        if robots.robot_of(name) == robot
    }
    useful = [name for name, (carrying, _) in counts.items() if carrying]
    return tuple(sorted(useful, key=lambda name: (*counts[name], name)))


def _moved_links(robots: PlanningRobots, moving: NDArray[np.intp]) -> list[bool]:
    """Tell of each link whether positions move it, by rows of the tree."""
    tree = robots.tree
    names = {tree.position_names[row] for row in moving}
    parts = {p for path in names for p in (path, path.rpartition(".")[0])}
    moves = [False]
    for joint in tree.joints:
        moves.append(moves[joint.parent] or joint.name in parts or joint.mimics in parts)
    return [moves[joint] for joint in tree.joint_of_link]


def _angle(R: Any) -> float:
    """Return the angle of a rotation (rad)."""
    sine = 0.5 * np.linalg.norm([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    return float(np.arctan2(sine, 0.5 * (np.trace(R) - 1.0)))
