"""A robot's joints and links as plain arrays: where links are and how they move, for batches.

Notation: W is the world, B the robot's root link, L a link, J the frame of a joint, Q a point.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from types import MappingProxyType

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.real_arrays import real_array
from scene_graph_ros.geometry.spatial.elementary import arc_sine, sine_cosine
from scene_graph_ros.geometry.spatial.poses import as_pose
from scene_graph_ros.geometry.spatial.sums import length, product
from scene_graph_ros.robots.joint_chains import joint_chains, JointChains
from scene_graph_ros.robots.sampling import sample
from scene_graph_ros.robots.tree_joint import KinematicTreeError, PARTS, TreeJoint
from scene_graph_ros.robots.tree_kernels import (
    FLOATING,
    joint_columns,
    link_poses,
    PLANAR,
    REVOLUTE,
    SMALL_ANGLE,
    TreeTable,
)
from scene_graph_ros.robots.tree_layout import TreeLayout

__all__ = ["KinematicTree"]


@one_line()
@dataclass(frozen=True, eq=False)
class KinematicTree(TreeLayout):
    """The joints that move a robot's links, parents before children, and where the links are.

    A configuration q ``(nq,)`` has the positions of all joints that follow no other, in rad and m:
    one of a revolute or prismatic joint, x, y and theta of a planar one, and of a floating one a
    quaternion (w, x, y, z) of any length but zero and a place. Its velocities v ``(nv,)`` are the
    same, but of a floating joint the angular and linear velocity in the frame in which it floats.

    ``joint_of_link`` and ``X_JL`` place each link in the frame of the joint that moves it, 0 for
    the base. ``groups`` are the joints of each of an SRDF's groups.
    """

    joint_of_link: tuple[int, ...]
    X_JL: NDArray[np.float64]
    X_WB: NDArray[np.float64] = field(default_factory=lambda: np.eye(4))
    groups: Mapping[str, tuple[str, ...]] = field(default_factory=lambda: MappingProxyType({}))

    def __post_init__(self) -> None:
        """Raise KinematicTreeError for names that are there twice."""
        super().__post_init__()
        # Kernels are compiled for arrays that may be written to.
        object.__setattr__(self, "X_WB", np.array(self.X_WB, dtype=np.float64))

    def group_positions(self, name: str) -> NDArray[np.intp]:
        """Return the indices in q of the positions of a group's joints, ``(k,)``.

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

    # What is worked out.

    def link_poses(self, q: ArrayLike, links: Sequence[str] | None = None) -> NDArray[np.float64]:
        """Return the poses X_WL ``(n, l, 4, 4)`` of links (default: all), or ``(l, 4, 4)``.

        ``q`` is ``(n, nq)`` or ``(nq,)``; positions may lie beyond limits. Configurations are
        worked out by one kernel that holds no lock. Raises KinematicTreeError for another shape,
        numbers that are not finite, a quaternion of length zero, and unknown links.
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
        point = real_array(p_LQ, "p_LQ must be three finite numbers", KinematicTreeError)
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
        (configuration,) = self.checked_configurations(_one(q))
        result = np.zeros((self.num_velocities, self.num_positions))
        for joint, start, first in zip(self.joints, *self._starts, strict=True):
            if joint.mimics:
                continue
            if joint.kind != FLOATING:
                for i in range(3 if joint.kind == PLANAR else 1):
                    result[first + i, start + i] = 1.0
                continue
            size = length(configuration[start : start + 4])
            w, x, y, z = configuration[start : start + 4] / size
            result[first : first + 3, start : start + 4] = (2.0 / size) * np.array(
                [[-x, w, -z, y], [-y, z, w, -x], [-z, -y, x, w]]
            )
            result[first + 3 : first + 6, start + 4 : start + 7] = np.eye(3)
        return result

    def interpolate(self, q1: ArrayLike, q2: ArrayLike, t: float) -> NDArray[np.float64]:
        """Return the configuration ``(nq,)`` at t in [0, 1] on the straight edge from q1 to q2.

        Quaternions turn the short way at one speed (slerp; Shoemake, *Animating Rotation with
        Quaternion Curves*, 1985) and have length 1. Raises like `link_poses`.
        """
        first, second = self.checked_configurations(_both(q1, q2))
        result = np.asarray((1.0 - t) * first + t * second)
        for _, start in self._floating:
            parts = first[start : start + 4], second[start : start + 4]
            a, b = (part / length(part) for part in parts)
            b = b if product(a, b) >= 0.0 else -b
            angle = 2.0 * arc_sine(min(1.0, 0.5 * length(a - b)))
            weights = 1.0 - t, t
            if angle > SMALL_ANGLE:
                sines = [sine_cosine(part * angle)[0] for part in (*weights, 1.0)]
                weights = sines[0] / sines[2], sines[1] / sines[2]
            turned = weights[0] * a + weights[1] * b
            result[start : start + 4] = turned / length(turned)
        return result

    def sample(self, rng: np.random.Generator, n: int) -> NDArray[np.float64]:
        """Return n configurations ``(n, nq)`` drawn evenly from within the limits.

        Joints that turn without limits have positions in [-pi, pi), quaternions are drawn evenly
        among all rotations, with length 1 (Shoemake, *Uniform Random Rotations*, 1992). A position
        with one limit only, or a place without, has no even distribution: KinematicTreeError names
        it, and the remedy. The same state of ``rng`` gives the same configurations.
        """
        return sample(self, rng, n)

    @cached_property
    def chains(self) -> JointChains:
        """The freedoms between each joint and the base, for kernels."""
        return joint_chains(self.table)

    @cached_property
    def _all_rows(self) -> NDArray[np.int64]:
        return np.arange(len(self.link_names))

    def _rows_of(self, links: Sequence[str]) -> NDArray[np.int64]:
        return np.array([self.link_index(name) for name in links], dtype=np.int64)

    @cached_property
    def table(self) -> TreeTable:
        """The tree as kernels read it."""
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

        Raises InvalidPoseError for an array that is no rigid pose.
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
        X_JB = product(self.X_JL[row], X)
        base, count = self.joint_of_link[row], len(self.joints)

        def moved(parent: int, X_PJ: NDArray[np.float64]) -> tuple[int, NDArray[np.float64]]:
            return (parent + count, X_PJ) if parent > 0 else (base, product(X_JB, X_PJ))

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


def _one(q: ArrayLike) -> NDArray[np.float64]:
    """Return one configuration as a batch of one."""
    return real_array(q, "q must be numbers", KinematicTreeError)[np.newaxis]


def _both(q1: ArrayLike, q2: ArrayLike) -> NDArray[np.float64]:
    """Return two configurations as a batch; raises KinematicTreeError for uneven ones."""
    first = real_array(q1, "q1 must be numbers", KinematicTreeError)
    second = real_array(q2, "q2 must be numbers", KinematicTreeError)
    if first.shape != second.shape:
        raise KinematicTreeError(
            f"q1 and q2 must have the same shape, not {first.shape} and {second.shape}"
        )
    return np.stack([first, second])
