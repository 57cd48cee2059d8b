"""Robots of the world as planning asks about them; imported when that is first done."""

from __future__ import annotations

from collections.abc import Mapping
import copy
from typing import Any, TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from msg_adapters.robot_configurations import Meaning, RobotNames
from scene_graph_ros.geometry.errors import UnknownIdError
from scene_graph_ros.geometry.model.snapshot import Snapshot
from scene_graph_ros.node.world.padded_sides import geometry_paddings, PaddedSide
from scene_graph_ros.planning import RobotDiagram, SceneGraphCollisionChecker
from scene_graph_ros.planning.pairs.checker_plan import carrier
from scene_graph_ros.robots.kinematic_tree import KinematicTree

if TYPE_CHECKING:
    from scene_graph_ros.geometry import SceneGraph
    from scene_graph_ros.geometry.model.context import Context

__all__ = ["PlanningRobots"]


class PlanningRobots:
    """All robots of one model, whose positions make one configuration ``(nq,)``.

    ``positions``, ``groups`` and ``links`` resolve the names of messages.
    """

    def __init__(
        self,
        robots: Mapping[str, Any],
        scene_graph: SceneGraph,
        context: Context,
        snapshot: Snapshot,
        paddings: Mapping[tuple[PaddedSide, PaddedSide], float],
        bases: Mapping[str, NDArray[np.float64]],
    ) -> None:
        """Prepare for loaded robots by name; raises UnknownIdError where there is none.

        ``paddings`` (m) are those of single pairs, which no request's replaces;
        ``bases`` ``(4, 4)`` where the robots stand.
        """
        if not robots:
            raise UnknownIdError("the scene has no robot to plan for")
        diagram = RobotDiagram.of_robots(robots, scene_graph, context, bases=bases)
        self._bases = _as_bytes(bases)
        self._checker = SceneGraphCollisionChecker(diagram, snapshot=snapshot)
        self._paddings = geometry_paddings(paddings, snapshot.inspector)
        self.model_version = snapshot.model_version
        self.tree = diagram.tree
        self.positions = RobotNames(
            "position", self.tree.position_names, robots, _followers(self.tree)
        )
        self.groups = RobotNames("group", tuple(self.tree.groups), robots)
        prefixes = tuple(f"{robot}/" for robot in robots)
        own = (name for name in self.tree.link_names if name.startswith(prefixes))
        self.links = RobotNames("link", tuple(own), robots)
        self.link_frames = frozenset(diagram.frames.values())
        self._links = {int(f): self.tree.link_index(n) for n, f in diagram.frames.items()}
        self._sources = {
            name: _rows(name, robot.kinematics.position_names, self.tree.position_names)
            for name, robot in robots.items()
        }

    def standing(
        self,
        robots: Mapping[str, Any],
        scene_graph: SceneGraph,
        context: Context,
        snapshot: Snapshot,
        bases: Mapping[str, NDArray[np.float64]],
    ) -> PlanningRobots:
        """Return the same robots of the same model with other ``bases``; much faster than anew."""
        result = copy.copy(self)
        diagram = RobotDiagram.of_robots(robots, scene_graph, context, bases=bases)
        result._bases = _as_bytes(bases)
        result._checker = self._checker.at(snapshot, model=diagram)
        result.tree = diagram.tree
        return result

    def fits(self, snapshot: Snapshot, bases: Mapping[str, NDArray[np.float64]]) -> bool:
        """Tell whether the model is as it was, and all robots stand where they did."""
        return self.is_of(snapshot) and self._bases == _as_bytes(bases)

    def is_of(self, snapshot: Snapshot) -> bool:
        """Tell whether the model is as it was."""
        return self.model_version == snapshot.model_version

    def present(self, positions: Mapping[str, NDArray[np.float64]]) -> NDArray[np.float64]:
        """Return the robots' configuration from a world snapshot's positions."""
        q = self.tree.zero_configuration()
        for name, (own, rows) in self._sources.items():
            q[rows] = positions[name][own]
        return q

    def positions_of(self, joint: str) -> tuple[str, ...]:
        """Return the names of a joint's positions, ``<robot>/<joint>``, ``.x`` and so on."""
        parts = f"{joint}."
        own = [n for n in self.tree.position_names if n == joint or n.startswith(parts)]
        return (joint,) if joint in own else tuple(own)

    def robot_of(self, path: str) -> str:
        """Return a joint's robot; the longest name counts where one begins with another."""
        return max((n for n in self._sources if path.startswith(f"{n}/")), key=len)

    def carried(self, snapshot: Snapshot) -> dict[Any, tuple[int, NDArray[np.float64]]]:
        """Return the frames that links carry: by which (row of the tree), and where, X_LF."""
        result = {}
        inspector = snapshot.inspector
        for frame in inspector.get_all_frame_ids():
            link, between = carrier(inspector, frame, self._links)
            if link >= 0:
                X_LF = np.eye(4)
                for each in between:
                    X_LF = X_LF @ snapshot.pose_in_parent(each)
                result[frame] = (link, X_LF)
        return result

    def checker(
        self, snapshot: Snapshot, *, environment_padding: float, self_padding: float
    ) -> SceneGraphCollisionChecker:
        """Return a checker for a moment of the model, with paddings in metres."""
        result = self._checker.at(
            snapshot,
            env_collision_padding=environment_padding,
            self_collision_padding=self_padding,
        )
        if self._paddings:
            result.set_paddings_between_geometries(self._paddings)
        return result


def _as_bytes(bases: Mapping[str, NDArray[np.float64]]) -> dict[str, bytes]:
    return {name: X_WB.tobytes() for name, X_WB in bases.items()}


def _followers(tree: KinematicTree) -> dict[str, Meaning]:
    """Return the meanings of positions of joints that mimic others."""
    rows = {name: row for row, name in enumerate(tree.position_names)}
    found: dict[str, Meaning] = {}
    waiting = [joint for joint in tree.joints if joint.mimics]
    while waiting:
        later = []
        for joint in waiting:
            leader = found.get(joint.mimics)
            if joint.mimics in rows:
                leader = Meaning(joint.mimics, rows[joint.mimics])
            if leader is None:
                later.append(joint)
                continue
            found[joint.name] = Meaning(
                joint.name,
                leader.row,
                False,
                joint.multiplier * leader.multiplier,
                joint.multiplier * leader.offset + joint.offset,
            )
        assert len(later) < len(waiting), "joints follow no circle"
        waiting = later
    return found


def _rows(
    robot: str, own: tuple[str, ...], names: tuple[str, ...]
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return a robot's own rows and the tree's rows of the same positions; followers have none."""
    known = {name: row for row, name in enumerate(names)}
    pairs = [(i, known[f"{robot}/{n}"]) for i, n in enumerate(own) if f"{robot}/{n}" in known]
    first, second = np.array(pairs, dtype=np.intp).reshape(-1, 2).T
    return first, second
