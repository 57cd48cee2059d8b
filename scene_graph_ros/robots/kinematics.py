"""Where a robot's links are, from the positions of its joints, as messages about them come in."""

from __future__ import annotations

from collections.abc import Sequence
import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.geometry.errors import SceneGraphError
from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.geometry.real_arrays import real_array
from scene_graph_ros.geometry.spatial.elementary import arc_tangent
from scene_graph_ros.geometry.spatial.poses import as_pose, quaternions_from_poses
from scene_graph_ros.geometry.spatial.sums import product
from scene_graph_ros.geometry.tolerances import ROTATION_DEFECT
from scene_graph_ros.located import suggestion
from scene_graph_ros.robots.robot_model import RobotModel
from scene_graph_ros.robots.robot_parts import JointType, Mimic
from scene_graph_ros.robots.tree_kernels import link_poses
from scene_graph_ros.robots.tree_of_model import plane_of, tree_of_model

__all__ = ["JointStateError", "KinematicState", "Kinematics"]

_MAX_MAPPINGS = 32
"""How many different lists of joint names are remembered; publishers use one or two each."""


class JointStateError(SceneGraphError, ValueError):
    """Joint positions that are not finite, or do not match their names."""


class _Mapping(NamedTuple):
    """How the positions of one list of joint names go into the vector of all positions."""

    entries: tuple[int, ...]
    """Entries of the message that name a joint."""
    joints: tuple[int, ...]
    """The joints they name."""
    mimics: tuple[tuple[int, int, float, float], ...]
    """(joint, followed joint, multiplier, offset): to be computed, in this order."""
    unknown: tuple[str, ...]


class KinematicState(NamedTuple):
    """Where a robot's joints and its base are."""

    q: NDArray[np.float64]
    positions: tuple[float, ...]
    X_PB: NDArray[np.float64]


@one_line("robot", "position_names")
class Kinematics:
    """Forward kinematics of one robot, with a memory of the last position of each joint.

    Poses are of links L in the parent P of the robot's frames: the world, unless the robot was
    registered below a frame. All joints start at 0, or where ``positions`` says. An instance may
    be used by one thread at a time. For many configurations at once: `KinematicTree`.
    """

    def __init__(
        self,
        robot: RobotModel,
        *,
        links: Sequence[str] | None = None,
        X_PB: ArrayLike | None = None,
    ) -> None:
        """Prepare for ``links`` (default: all); ``X_PB`` is the pose of the root link in P.

        Raises KeyError for an unknown link.
        """
        self.robot = robot
        self.link_names: tuple[str, ...] = tuple(robot.links if links is None else links)
        for name in self.link_names:
            if name not in robot.links:
                hint = suggestion(name, robot.links)
                raise KeyError(f"robot {robot.name!r} has no link {name!r}{hint}")
        # A joint that mimics another may be measured itself, so each has a position of its own.
        tree = tree_of_model(robot, follows=False)
        self.position_names: tuple[str, ...] = tree.position_names
        """Names of the entries of ``configuration``: joints that mimic others have their own."""
        self._table = tree.table
        self._q = tree.zero_configuration()[np.newaxis]
        self._link_rows = np.array([tree.link_index(name) for name in self.link_names], np.int64)
        self._index_in_q = {
            joint.name: int(start)
            for joint, start in zip(tree.joints, tree.table.starts[1:], strict=True)
        }
        self.joint_names: tuple[str, ...] = tuple(j.name for j in robot.positioned_joints())
        self._index = {name: i for i, name in enumerate(self.joint_names)}
        self._q_of = np.array([self._index_in_q[name] for name in self.joint_names], np.intp)
        self._positions = [0.0] * len(self.joint_names)
        self._mappings: dict[tuple[str, ...], _Mapping] = {}
        self.unknown_joints: tuple[str, ...] = ()
        """Names in the last update that are no joint of the robot with a position."""
        self.X_PB = np.eye(4) if X_PB is None else X_PB
        for entry in self._mimics_of(frozenset(self.joint_names) - self._following()):
            self._follow(self._positions, entry)
        self._q[0, self._q_of] = self._positions

    @property
    def X_PB(self) -> NDArray[np.float64]:
        """Pose ``(4, 4)`` of the robot's root link in P."""
        result = self._X_PB.view()
        result.setflags(write=False)
        return result

    @X_PB.setter
    def X_PB(self, X: ArrayLike) -> None:
        # Kernels are compiled for arrays that may be written to.
        self._X_PB = as_pose(X, f"X_PB of robot {self.robot.name!r}").copy()

    @property
    def positions(self) -> dict[str, float]:
        """The position of each joint now, in rad or m, mimicking joints included."""
        return dict(zip(self.joint_names, self._positions, strict=True))

    @property
    def configuration(self) -> NDArray[np.float64]:
        """All positions now, a new array ``(n,)``: also those of floating and planar joints."""
        return self._q[0].copy()

    @property
    def state(self) -> KinematicState:
        """All that moves, to be set again later: positions of joints and the base."""
        return KinematicState(self._q.copy(), tuple(self._positions), self._X_PB)

    @state.setter
    def state(self, state: KinematicState) -> None:
        self._q[:], self._positions, self._X_PB = state.q, list(state.positions), state.X_PB

    def update(self, joint_names: Sequence[str], positions: ArrayLike) -> None:
        """Move the named joints to positions ``(n,)``, rad or m; those that mimic one follow.

        A mimicking joint that is named itself goes where its own position says. Positions beyond
        a joint's limits are taken as they are: the robot measured them. Names the robot
        does not have are put into ``unknown_joints``. Raises JointStateError, and moves nothing,
        for a position that is not finite, a joint named twice, or lists of different lengths.
        """
        rule = f"robot {self.robot.name!r}: positions must be numbers"
        values = real_array(positions, rule, JointStateError)
        names = tuple(joint_names)
        if values.shape != (len(names),):
            raise JointStateError(
                f"robot {self.robot.name!r}: {len(names)} joint names with positions of shape"
                f" {values.shape}"
            )
        mapping = self._mappings.get(names) or self._remember(names)
        numbers = values.tolist()
        known = [numbers[entry] for entry in mapping.entries]
        if not all(map(math.isfinite, known)):
            bad = next(entry for entry in mapping.entries if not math.isfinite(numbers[entry]))
            raise JointStateError(
                f"robot {self.robot.name!r}: position of joint {names[bad]!r} must be finite,"
                f" got {numbers[bad]}"
            )
        for joint, position in zip(mapping.joints, known, strict=True):
            self._positions[joint] = position
        for entry in mapping.mimics:
            self._follow(self._positions, entry)
        self._q[0, self._q_of] = self._positions
        self.unknown_joints = mapping.unknown

    @staticmethod
    def _follow(positions: list[float], entry: tuple[int, int, float, float]) -> None:
        joint, followed, multiplier, offset = entry
        positions[joint] = multiplier * positions[followed] + offset

    def _following(self) -> frozenset[str]:
        return frozenset(n for n in self.joint_names if self.robot.joints[n].mimic is not None)

    def _remember(self, names: tuple[str, ...]) -> _Mapping:
        """Work out, and keep, where the positions of a list of names go."""
        entries = [i for i, name in enumerate(names) if name in self._index]
        named = [names[i] for i in entries]
        if len(set(named)) != len(named):
            twice = next(name for name in named if named.count(name) > 1)
            raise JointStateError(f"robot {self.robot.name!r}: joint {twice!r} is named twice")
        mapping = _Mapping(
            tuple(entries),
            tuple(self._index[name] for name in named),
            self._mimics_of(frozenset(named)),
            tuple(name for name in names if name not in self._index),
        )
        if len(self._mappings) >= _MAX_MAPPINGS:
            self._mappings.clear()
        self._mappings[names] = mapping
        return mapping

    def _mimics_of(self, named: frozenset[str]) -> tuple[tuple[int, int, float, float], ...]:
        """List the joints that move because they mimic a named joint, followed ones first."""
        followers: dict[str, list[tuple[str, Mimic]]] = {}
        for joint in self.robot.positioned_joints():
            if joint.mimic is not None and joint.name not in named:
                followers.setdefault(joint.mimic.joint, []).append((joint.name, joint.mimic))
        result = []
        moving = sorted(named, key=self._index.__getitem__)
        for followed in moving:
            for name, rule in followers.get(followed, ()):
                entry = (self._index[name], self._index[followed], rule.multiplier, rule.offset)
                result.append(entry)
                moving.append(name)  # to be visited later in this loop
        return tuple(result)

    def set_joint_pose(self, joint_name: str, X_JcC: ArrayLike) -> None:
        """Place the child of a planar or floating joint relative to where it is at rest.

        ``X_JcC`` is ``(4, 4)``. Raises JointStateError for another kind of joint, or a pose that
        leaves a planar joint's plane.
        """
        joint = self.robot.joints.get(joint_name)
        if joint is None or joint.type not in (JointType.PLANAR, JointType.FLOATING):
            raise JointStateError(
                f"robot {self.robot.name!r} has no planar or floating joint {joint_name!r}"
            )
        X = as_pose(X_JcC, f"of joint {joint_name!r}")
        start = self._index_in_q[joint_name]
        if joint.type is JointType.FLOATING:
            self._q[0, start : start + 4] = np.roll(quaternions_from_poses(X[np.newaxis])[0], 1)
            self._q[0, start + 4 : start + 7] = X[:3, 3]
            return
        normal = np.array(joint.axis)
        tilt = float(np.abs(product(X[:3, :3], normal) - normal).max())
        lift = abs(float(product(normal, X[:3, 3])))
        if tilt > ROTATION_DEFECT or lift > ROTATION_DEFECT:
            raise JointStateError(
                f"joint {joint_name!r} is planar with normal {joint.axis}: the pose leaves the"
                f" plane by {lift:g} m and a tilt of {tilt:g}"
            )
        X_CJ = plane_of(joint.axis)
        x, y, _ = product(X_CJ[:3, :3].T, X[:3, 3])
        R = product(product(X_CJ[:3, :3].T, X[:3, :3]), X_CJ[:3, :3])
        self._q[0, start : start + 3] = x, y, arc_tangent(R[1, 0], R[0, 0])

    def link_poses(
        self, joint_names: Sequence[str] = (), positions: ArrayLike = ()
    ) -> tuple[tuple[str, ...], NDArray[np.float64]]:
        """Update the named joints and return the links' names and poses ``X_PL`` ``(n, 4, 4)``.

        Raises JointStateError like ``update``.
        """
        if len(joint_names):
            self.update(joint_names, positions)
        X_PL = np.empty((1, len(self.link_names), 4, 4))
        link_poses(self._table, self._q, self._X_PB, self._link_rows, X_PL)
        return self.link_names, X_PL[0]
