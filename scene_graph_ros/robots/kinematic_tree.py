"""A robot's joints and links as plain arrays: where links are and how they move, for batches.

Notation: W is the world, B the robot's root link, L a link, J the frame of a joint, Q a point.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
import math
from types import MappingProxyType

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.reals import squares_of_few
from scene_graph_ros.geometry.spatial.poses import as_pose
from scene_graph_ros.located import suggestion
from scene_graph_ros.robots.joint_chains import joint_chains, JointChains
from scene_graph_ros.robots.tree_joint import KinematicTreeError, PARTS, TreeJoint
from scene_graph_ros.robots.tree_kernels import (
    FLOATING,
    joint_columns,
    link_poses,
    PLANAR,
    PRISMATIC,
    REVOLUTE,
    TreeTable,
)

__all__ = ["KinematicTree"]

_FLOAT64 = np.dtype(np.float64)


@dataclass(frozen=True, eq=False)
class KinematicTree:
    """The joints that move a robot's links, parents before children.

    A configuration q ``(nq,)`` has the positions of all joints that follow no other, in rad and m:
    one of a revolute or prismatic joint, x, y and theta of a planar one, and of a floating one a
    quaternion (w, x, y, z) of any length but zero and a place. Its velocities v ``(nv,)`` are the
    same, but of a floating joint the angular and linear velocity in the frame in which it floats.

    ``joint_of_link`` and ``X_JL`` place each link in the frame of the joint that moves it, 0 for
    the base. ``groups`` are the joints of each of an SRDF's groups.
    """

    name: str
    joints: tuple[TreeJoint, ...]
    link_names: tuple[str, ...]
    joint_of_link: tuple[int, ...]
    X_JL: NDArray[np.float64]
    X_WB: NDArray[np.float64] = field(default_factory=lambda: np.eye(4))
    groups: Mapping[str, tuple[str, ...]] = field(default_factory=lambda: MappingProxyType({}))

    def __post_init__(self) -> None:
        """Raise KinematicTreeError for names that are there twice."""
        # Kernels are compiled for arrays that may be written to.
        object.__setattr__(self, "X_WB", np.array(self.X_WB, dtype=np.float64))
        for noun, names in (("joint", self.joint_names), ("link", self.link_names)):
            if len(set(names)) != len(names):
                twice = next(name for name in names if names.count(name) > 1)
                raise KinematicTreeError(f"robot {self.name!r} has two {noun}s {quoted(twice)}")

    # What there is.

    @cached_property
    def joint_names(self) -> tuple[str, ...]:
        """The joints that move, those that follow others included."""
        return tuple(joint.name for joint in self.joints)

    @cached_property
    def position_names(self) -> tuple[str, ...]:
        """Names of the entries of q: a joint's, with ``.x`` and so on where it has several."""
        return self._names(0)

    @cached_property
    def velocity_names(self) -> tuple[str, ...]:
        """Names of the entries of v."""
        return self._names(1)

    def _names(self, which: int) -> tuple[str, ...]:
        return tuple(
            f"{joint.name}.{part}" if part else joint.name
            for joint in self.joints
            if not joint.mimics
            for part in (PARTS[joint.kind][which] or ("",))
        )

    @property
    def num_positions(self) -> int:
        """The length nq of a configuration."""
        return len(self.position_names)

    @property
    def num_velocities(self) -> int:
        """The length nv of a configuration's velocity."""
        return len(self.velocity_names)

    @cached_property
    def lower(self) -> NDArray[np.float64]:
        """Lower limits ``(nq,)`` of the positions; -inf where there is none."""
        return self._limits()[0]

    @cached_property
    def upper(self) -> NDArray[np.float64]:
        """Upper limits ``(nq,)`` of the positions; inf where there is none."""
        return self._limits()[1]

    def _limits(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Take what those that follow may do from the joint they follow, too."""
        lower, upper = np.full(self.num_positions, -np.inf), np.full(self.num_positions, np.inf)
        for joint, start in zip(self.joints, self._starts[0], strict=True):
            if joint.kind not in (REVOLUTE, PRISMATIC) or joint.multiplier == 0.0:
                continue
            ends = (np.array([joint.lower, joint.upper]) - joint.offset) / joint.multiplier
            lower[start] = max(lower[start], ends.min())
            upper[start] = min(upper[start], ends.max())
        return lower, upper

    @cached_property
    def velocity_limits(self) -> NDArray[np.float64]:
        """Largest speeds ``(nq,)`` of the positions, rad/s or m/s; inf where there is none.

        Joints that follow others must keep theirs, too.
        """
        most = np.full(self.num_positions, np.inf)
        for joint, start in zip(self.joints, self._starts[0], strict=True):
            if joint.kind in (REVOLUTE, PRISMATIC) and joint.multiplier != 0.0:
                most[start] = min(most[start], joint.velocity / abs(joint.multiplier))
        return most

    def zero_configuration(self) -> NDArray[np.float64]:
        """Return q ``(nq,)`` with all joints at zero, floating ones not turned."""
        q = np.zeros(self.num_positions)
        for joint, start in zip(self.joints, self._starts[0], strict=True):
            if joint.kind == FLOATING:
                q[start] = 1.0
        return q

    def position_index(self, name: str) -> int:
        """Return where an entry of q is. Raises KinematicTreeError for an unknown name."""
        return self._index("position", self._position_rows, name)

    def link_index(self, name: str) -> int:
        """Return the row of a link. Raises KinematicTreeError for an unknown name."""
        return self._index("link", self._link_rows, name)

    def group_positions(self, name: str) -> NDArray[np.intp]:
        """Return where the positions of a group's joints are in q.

        Joints that follow others have none. Raises KinematicTreeError for an unknown group.
        """
        self._index("group", dict.fromkeys(self.groups, 0), name)
        members = set(self.groups[name])
        rows = [
            start + i
            for joint, start in zip(self.joints, self._starts[0], strict=True)
            if joint.name in members and not joint.mimics
            for i in range(len(PARTS[joint.kind][0]) or 1)
        ]
        return np.array(rows, dtype=np.intp)

    def _index(self, noun: str, rows: Mapping[str, int], name: str) -> int:
        if name not in rows:
            raise KinematicTreeError(
                f"robot {self.name!r} has no {noun} {quoted(name)}{suggestion(name, rows)}"
            )
        return rows[name]

    @cached_property
    def _position_rows(self) -> dict[str, int]:
        return {name: row for row, name in enumerate(self.position_names)}

    @cached_property
    def _link_rows(self) -> dict[str, int]:
        return {name: row for row, name in enumerate(self.link_names)}

    # What is worked out.

    def link_poses(self, q: ArrayLike, links: Sequence[str] | None = None) -> NDArray[np.float64]:
        """Return the poses X_WL ``(n, l, 4, 4)`` of links (default: all), or ``(l, 4, 4)``.

        ``q`` is ``(n, nq)`` or ``(nq,)``; positions may lie beyond limits. Configurations are
        worked out by one kernel that holds no lock. Raises KinematicTreeError for another shape,
        what is not finite, a quaternion of length zero, and unknown links.
        """
        configurations = self.checked_configurations(q)
        rows = self._all_rows if links is None else self._rows_of(links)
        X_WL = np.empty((len(configurations), len(rows), 4, 4))
        link_poses(self.table, configurations, self.X_WB, rows, X_WL)
        return X_WL[0] if np.ndim(q) == 1 else X_WL

    def jacobians(
        self, q: ArrayLike, link: str, p_LQ: ArrayLike = (0.0, 0.0, 0.0)
    ) -> NDArray[np.float64]:
        """Return the Jacobians ``(n, 6, nv)``, or ``(6, nv)``, of a point Q fixed to a link.

        Times v they give the link's angular velocity and Q's velocity, in W: rad/s in the first
        three rows, m/s in the others. ``p_LQ`` ``(3,)`` in m. Raises like `link_poses`.
        """
        configurations, row = self.checked_configurations(q), self.link_index(link)
        point = np.array(p_LQ, dtype=np.float64)
        if point.shape != (3,) or not np.isfinite(point).all():
            raise KinematicTreeError(f"p_LQ must be three finite numbers, not {quoted(p_LQ)}")
        J = np.empty((len(configurations), 6, self.num_velocities))
        joint_columns(self.table, configurations, self.X_WB, row, point, J)
        return J[0] if np.ndim(q) == 1 else J

    def velocity_map(self, q: ArrayLike) -> NDArray[np.float64]:
        """Return ``(nv, nq)`` that gives v times the rate of q at one configuration ``(nq,)``.

        The length of a quaternion has no effect on poses, so its rate has none on v. Raises like
        `link_poses`.
        """
        (configuration,) = self.checked_configurations(np.asarray(q)[np.newaxis])
        result = np.zeros((self.num_velocities, self.num_positions))
        for joint, start, first in zip(self.joints, *self._starts, strict=True):
            if joint.mimics:
                continue
            if joint.kind != FLOATING:
                for i in range(3 if joint.kind == PLANAR else 1):
                    result[first + i, start + i] = 1.0
                continue
            length = np.linalg.norm(configuration[start : start + 4])
            w, x, y, z = configuration[start : start + 4] / length
            result[first : first + 3, start : start + 4] = (2.0 / length) * np.array(
                [[-x, w, -z, y], [-y, z, w, -x], [-z, -y, x, w]]
            )
            result[first + 3 : first + 6, start + 4 : start + 7] = np.eye(3)
        return result

    def interpolate(self, q1: ArrayLike, q2: ArrayLike, t: float) -> NDArray[np.float64]:
        """Return the configuration ``(nq,)`` at t in [0, 1] on the straight edge from q1 to q2.

        Quaternions turn the short way at one speed (slerp; Shoemake, *Animating Rotation with
        Quaternion Curves*, 1985) and have length 1. Raises like `link_poses`.
        """
        first, second = self.checked_configurations(np.stack([np.asarray(q1), np.asarray(q2)]))
        result = np.asarray((1.0 - t) * first + t * second)
        for _, start in self._floating:
            parts = first[start : start + 4], second[start : start + 4]
            a, b = (part / np.linalg.norm(part) for part in parts)
            b = b if a @ b >= 0.0 else -b
            angle = 2.0 * math.asin(min(1.0, 0.5 * float(np.linalg.norm(a - b))))
            weights = 1.0 - t, t
            if angle > 1e-4:
                weights = (
                    math.sin((1.0 - t) * angle) / math.sin(angle),
                    math.sin(t * angle) / math.sin(angle),
                )
            turned = weights[0] * a + weights[1] * b
            result[start : start + 4] = turned / np.linalg.norm(turned)
        return result

    def is_certainly_within(self, q: ArrayLike, most: float) -> bool:
        """Tell whether an array ``(n, nq)`` is certainly right, and no position beyond ``most``.

        That is found sooner than by checking each; False says nothing.
        """
        return (
            type(q) is np.ndarray
            and q.dtype is _FLOAT64
            and q.ndim == 2
            and q.shape[1] == len(self.position_names)
            and q.flags.carray
            and not self._floating
            and squares_of_few(q) <= most * most
        )

    def checked_configurations(self, q: ArrayLike) -> NDArray[np.float64]:
        """Return configurations ``(n, nq)`` after checking them.

        Raises KinematicTreeError naming the entry, its value and its row.
        """
        try:
            # Kernels are compiled for arrays that may be written to.
            array = np.require(q, np.float64, ["C", "W"])
        except (TypeError, ValueError, OverflowError) as error:
            raise KinematicTreeError(f"q must be numbers: {quoted(q)}") from error
        if array.ndim not in (1, 2) or array.shape[-1] != self.num_positions:
            raise KinematicTreeError(
                f"q of robot {self.name!r} must have shape (n, {self.num_positions}) or"
                f" ({self.num_positions},), not {array.shape}"
            )
        configurations = array[np.newaxis] if array.ndim == 1 else array
        if not (squares_of_few(configurations) < math.inf or np.isfinite(configurations).all()):
            row, column = np.argwhere(~np.isfinite(configurations))[0]
            raise KinematicTreeError(
                f"position {self.position_names[column]!r} of configuration {row} must be finite,"
                f" not {configurations[row, column]}"
            )
        for joint, start in self._floating:
            is_zero = ~configurations[:, start : start + 4].any(axis=1)
            if is_zero.any():
                raise KinematicTreeError(
                    f"the quaternion of joint {joint.name!r} of configuration"
                    f" {int(np.argmax(is_zero))} is zero"
                )
        return configurations

    @cached_property
    def chains(self) -> JointChains:
        """What kernels read of the freedoms between each joint and the base."""
        return joint_chains(self.table)

    @cached_property
    def _floating(self) -> list[tuple[TreeJoint, int]]:
        pairs = zip(self.joints, self._starts[0], strict=True)
        return [(joint, start) for joint, start in pairs if joint.kind == FLOATING]

    @cached_property
    def _all_rows(self) -> NDArray[np.int64]:
        return np.arange(len(self.link_names))

    def _rows_of(self, links: Sequence[str]) -> NDArray[np.int64]:
        return np.array([self.link_index(name) for name in links], dtype=np.int64)

    @cached_property
    def _starts(self) -> tuple[list[int], list[int]]:
        """Where the positions and velocities of each joint, or of the one it follows, begin."""
        starts: dict[str, tuple[int, int]] = {}
        nq = nv = 0
        for joint in self.joints:
            if not joint.mimics:
                starts[joint.name] = nq, nv
                positions, velocities = PARTS[joint.kind]
                nq += len(positions) or 1
                nv += len(velocities) or 1
        pairs = [starts[joint.mimics or joint.name] for joint in self.joints]
        return [q for q, _ in pairs], [v for _, v in pairs]

    @cached_property
    def table(self) -> TreeTable:
        """What kernels read."""
        base = TreeJoint("", REVOLUTE, -1, np.eye(4))
        joints = (base, *self.joints)
        return TreeTable(
            np.array([joint.kind for joint in joints]),
            np.array([joint.parent for joint in joints]),
            np.array([joint.X_PJ[:3] for joint in joints]),
            np.array([0, *self._starts[0]]),
            np.array([0, *self._starts[1]]),
            np.array([joint.multiplier for joint in joints]),
            np.array([joint.offset for joint in joints]),
            np.array(self.joint_of_link, dtype=np.int64),
            np.ascontiguousarray(self.X_JL[:, :3]).reshape(-1, 3, 4),
        )

    # Others made of it.

    def at(self, X_WB: ArrayLike) -> KinematicTree:
        """Return this tree with its root link at ``X_WB`` ``(4, 4)``.

        Raises InvalidPoseError for what is no rigid pose.
        """
        return replace(self, X_WB=as_pose(X_WB, f"X_WB of robot {self.name!r}"))

    def attached(
        self, other: KinematicTree, link: str, X_LB: ArrayLike | None = None, *, prefix: str = ""
    ) -> KinematicTree:
        """Return a tree with the root link of another fixed to one of this one's links.

        ``X_LB`` ``(4, 4)`` is where; its own base pose has no effect. Its positions come after
        this one's, and its joints, links and groups are called ``prefix`` and their names. So a
        gripper is welded to an arm, and two robots stand on one base. Raises KinematicTreeError
        for an unknown link and names that are there twice, InvalidPoseError for a bad pose.
        """
        row = self.link_index(link)
        X = np.eye(4) if X_LB is None else as_pose(X_LB, "X_LB")
        X_JB = self.X_JL[row] @ X
        base, count = self.joint_of_link[row], len(self.joints)

        def moved(parent: int, X_PJ: NDArray[np.float64]) -> tuple[int, NDArray[np.float64]]:
            return (parent + count, X_PJ) if parent > 0 else (base, X_JB @ X_PJ)

        joints = list(self.joints)
        for joint in other.joints:
            parent, X_PJ = moved(joint.parent, joint.X_PJ)
            mimics = prefix + joint.mimics if joint.mimics else ""
            joints.append(
                replace(joint, name=prefix + joint.name, parent=parent, X_PJ=X_PJ, mimics=mimics)
            )
        places = [moved(j, X) for j, X in zip(other.joint_of_link, other.X_JL, strict=True)]
        groups = {prefix + name: _prefixed(prefix, m) for name, m in other.groups.items()}
        return KinematicTree(
            self.name,
            tuple(joints),
            (*self.link_names, *_prefixed(prefix, other.link_names)),
            (*self.joint_of_link, *(joint for joint, _ in places)),
            np.concatenate([self.X_JL, np.array([X for _, X in places]).reshape(-1, 4, 4)]),
            self.X_WB,
            MappingProxyType({**self.groups, **groups}),
        )


def _prefixed(prefix: str, names: Iterable[str]) -> tuple[str, ...]:
    return tuple(prefix + name for name in names)
