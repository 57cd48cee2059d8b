"""The layout of a robot's configurations: the places of its joints and links.

Plain names and numbers; `kinematic_tree` computes poses.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.real_arrays import real_array
from scene_graph_ros.geometry.reals import squares_of_few
from scene_graph_ros.located import suggestion
from scene_graph_ros.robots.tree_joint import KinematicTreeError, PARTS, TreeJoint
from scene_graph_ros.robots.tree_kernels import FLOATING, PRISMATIC, REVOLUTE

__all__ = ["TreeLayout"]

_FLOAT64 = np.dtype(np.float64)


@dataclass(frozen=True, eq=False)
class TreeLayout:
    """The joints that move a robot's links, parents before children, and their places in q and v.

    `KinematicTree` describes a configuration q ``(nq,)`` and its velocities v ``(nv,)``.
    """

    name: str
    joints: tuple[TreeJoint, ...]
    link_names: tuple[str, ...]

    def __post_init__(self) -> None:
        """Raise KinematicTreeError for names that are there twice."""
        for noun, names in (("joint", self.joint_names), ("link", self.link_names)):
            if len(set(names)) != len(names):
                twice = next(name for name in names if names.count(name) > 1)
                raise KinematicTreeError(f"robot {self.name!r} has two {noun}s {quoted(twice)}")

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
        """Apply the limits of followers to the joint that they follow, too."""
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
        return self._rates(lambda joint: joint.velocity)

    @cached_property
    def acceleration_limits(self) -> NDArray[np.float64]:
        """Largest accelerations ``(nq,)``, rad/s^2 or m/s^2, as of `velocity_limits`."""
        return self._rates(lambda joint: joint.acceleration)

    @cached_property
    def jerk_limits(self) -> NDArray[np.float64]:
        """Largest jerks ``(nq,)``, rad/s^3 or m/s^3, as of `velocity_limits`."""
        return self._rates(lambda joint: joint.jerk)

    def _rates(self, limit: Callable[[TreeJoint], float]) -> NDArray[np.float64]:
        most = np.full(self.num_positions, np.inf)
        for joint, start in zip(self.joints, self._starts[0], strict=True):
            if joint.kind in (REVOLUTE, PRISMATIC) and joint.multiplier != 0.0:
                most[start] = min(most[start], limit(joint) / abs(joint.multiplier))
        return most

    def zero_configuration(self) -> NDArray[np.float64]:
        """Return q ``(nq,)`` with all joints at zero, floating ones not turned."""
        q = np.zeros(self.num_positions)
        for joint, start in zip(self.joints, self._starts[0], strict=True):
            if joint.kind == FLOATING:
                q[start] = 1.0
        return q

    def position_index(self, name: str) -> int:
        """Return the index of an entry of q. Raises KinematicTreeError for an unknown name."""
        return self._index("position", self._position_rows, name)

    def link_index(self, name: str) -> int:
        """Return the row of a link. Raises KinematicTreeError for an unknown name."""
        return self._index("link", self._link_rows, name)

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

    # What a configuration may be.

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
        array: NDArray[np.float64]
        if type(q) is np.ndarray and q.dtype is _FLOAT64 and q.flags.carray:
            array = q
        else:
            array = real_array(q, "q must be numbers", KinematicTreeError)
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
    def _floating(self) -> list[tuple[TreeJoint, int]]:
        pairs = zip(self.joints, self._starts[0], strict=True)
        return [(joint, start) for joint, start in pairs if joint.kind == FLOATING]
