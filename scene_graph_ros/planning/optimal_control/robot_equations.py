"""A robot's equations of motion, as expressions of CasADi.

The recursive Newton-Euler algorithm (Featherstone, *Rigid Body Dynamics Algorithms*, 2008, section
5.3) over the joints of a tree. Vectors of a joint are in its own frame J, twists about J's origin:
angular part first. A mimic joint moves by its multiplier, so its forces do, too.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.planning.optimal_control.casadi_backend import get_casadi
from scene_graph_ros.robots.inertias import TreeInertias
from scene_graph_ros.robots.tree_kernels import FLOATING, PLANAR, PRISMATIC, REVOLUTE

__all__ = ["RobotEquations"]


class _Joint(NamedTuple):
    """Of one joint: its rotation and place in its parent, and its own motion."""

    R: Any
    p: Any
    subspace: Any
    """``(6, k)``: times the velocities it is the joint's own twist."""
    drift: Any
    """``(6, 1)``: the part of the twist's rate that is without accelerations."""


class RobotEquations:
    """The equations of motion of a tree: ``M(q) a + h(q, v) = u`` with generalized forces u.

    Positions and velocities are those of `KinematicTree`, velocities of a floating joint
    thus in the frame in which it floats. ``gravity`` ``(3,)`` is in W, m/s^2. Functions are of
    CasADi and take numbers as well as expressions.
    """

    def __init__(
        self, inertias: TreeInertias, gravity: NDArray[np.float64] | tuple[float, ...]
    ) -> None:
        ca = get_casadi()
        self.inertias, self.gravity = inertias, np.array(gravity, dtype=np.float64)
        tree = inertias.tree
        q = ca.SX.sym("q", tree.num_positions)
        v = ca.SX.sym("v", tree.num_velocities)
        a = ca.SX.sym("a", tree.num_velocities)
        forces = self._newton_euler(ca, q, v, a)
        M = ca.jacobian(forces, a)
        bias = ca.substitute(forces, a, ca.SX.zeros(a.shape))
        self.inverse_dynamics = ca.Function("inverse_dynamics", [q, v, a], [forces])
        """Generalized forces of positions, velocities and accelerations."""
        self.mass_matrix = ca.Function("mass_matrix", [q], [M])
        """M ``(nv, nv)`` of positions."""
        self.bias = ca.Function("bias", [q, v], [bias])
        """h ``(nv,)`` of positions and velocities: Coriolis, centrifugal forces and gravity."""
        u = ca.SX.sym("u", tree.num_velocities)
        solved = _solved(ca, M, u - bias)
        self.forward_dynamics = ca.Function("forward_dynamics", [q, v, u], [solved])
        """Accelerations of positions, velocities and generalized forces."""
        self.position_rates = ca.Function("position_rates", [q, v], [self._rates(ca, q, v)])
        """How positions change."""

    def _newton_euler(self, ca: Any, q: Any, v: Any, a: Any) -> Any:
        tree, inertias = self.inertias.tree, self.inertias
        starts, firsts = tree.table.starts[1:], tree.table.velocity_starts[1:]
        R_WB = tree.X_WB[:3, :3]
        # Gravity is an acceleration of the base upwards.
        zero = ca.SX.zeros(3, 1)
        spins, speeds = [zero], [zero]
        turns, pushes = [zero], [ca.SX(R_WB.T @ -self.gravity)]
        moving: list[_Joint] = []
        for joint, start, first in zip(tree.joints, starts, firsts, strict=True):
            count = 3 if joint.kind == PLANAR else 6 if joint.kind == FLOATING else 1
            own = _joint(ca, joint, q[int(start) : int(start) + count + (count == 6)])
            rates = v[int(first) : int(first) + count]
            R, p = own.R, own.p
            w, s = spins[joint.parent], speeds[joint.parent]
            twist = own.subspace @ rates
            spin = R.T @ w + twist[:3]
            speed = R.T @ (s + ca.cross(w, p)) + twist[3:]
            own = own._replace(drift=_drift(ca, joint.kind, twist))
            rate = own.subspace @ a[int(first) : int(first) + count] + own.drift
            turn = R.T @ turns[joint.parent] + rate[:3] + ca.cross(spin, twist[:3])
            push = R.T @ (pushes[joint.parent] + ca.cross(turns[joint.parent], p)) + rate[3:]
            push += ca.cross(spin, twist[3:]) + ca.cross(speed, twist[:3])
            moving.append(own)
            spins.append(spin)
            speeds.append(speed)
            turns.append(turn)
            pushes.append(push)
        torques, forces = [], []
        for k in range(len(moving) + 1):
            torque, force = _body_force(
                ca, inertias, k, (spins[k], speeds[k]), (turns[k], pushes[k])
            )
            torques.append(torque)
            forces.append(force)
        result = ca.SX.zeros(tree.num_velocities, 1)
        for k in range(len(moving), 0, -1):
            own, joint, first = moving[k - 1], tree.joints[k - 1], int(firsts[k - 1])
            wrench = ca.vertcat(torques[k], forces[k])
            result[first : first + own.subspace.shape[1]] += own.subspace.T @ wrench
            force = own.R @ forces[k]
            forces[joint.parent] += force
            torques[joint.parent] += own.R @ torques[k] + ca.cross(own.p, force)
        return result

    def _rates(self, ca: Any, q: Any, v: Any) -> Any:
        tree, table = self.inertias.tree, self.inertias.tree.table
        result = ca.SX.zeros(tree.num_positions, 1)
        for k, joint in enumerate(tree.joints, start=1):
            start, first = int(table.starts[k]), int(table.velocity_starts[k])
            if joint.mimics:
                continue
            if joint.kind != FLOATING:
                count = 3 if joint.kind == PLANAR else 1
                result[start : start + count] = v[first : first + count]
                continue
            w, vector = q[start], q[start + 1 : start + 4]
            spin = v[first : first + 3]
            result[start] = -0.5 * ca.dot(spin, vector)
            result[start + 1 : start + 4] = 0.5 * (w * spin + ca.cross(spin, vector))
            result[start + 4 : start + 7] = v[first + 3 : first + 6]
        return result


def _joint(ca: Any, joint: Any, q: Any) -> _Joint:
    """Return a joint's pose and motion."""
    R, p, X = ca.SX.eye(3), ca.SX.zeros(3, 1), joint.X_PJ
    if joint.kind in (REVOLUTE, PRISMATIC):
        position = joint.multiplier * q[0] + joint.offset
        subspace = ca.SX.zeros(6, 1)
        if joint.kind == REVOLUTE:
            R = _turn(ca, position)
            subspace[2] = joint.multiplier
        else:
            p[2] = position
            subspace[5] = joint.multiplier
    elif joint.kind == PLANAR:
        R, p = _turn(ca, q[2]), ca.vertcat(q[0], q[1], 0.0)
        subspace = ca.SX.zeros(6, 3)
        subspace[3:, :2] = R.T[:, :2]
        subspace[2, 2] = 1.0
    else:
        R, p = _rotation(ca, q[:4]), q[4:]
        subspace = ca.diagcat(R.T, R.T)
    return _Joint(X[:3, :3] @ R, X[:3, 3] + X[:3, :3] @ p, subspace, None)


def _drift(ca: Any, kind: int, twist: Any) -> Any:
    """Return the rate of the subspace times velocities: those are in axes that do not turn."""
    if kind in (PLANAR, FLOATING):
        return ca.vertcat(ca.SX.zeros(3, 1), -ca.cross(twist[:3], twist[3:]))
    return ca.SX.zeros(6, 1)


def _turn(ca: Any, angle: Any) -> Any:
    """Return the rotation about z."""
    c, s = ca.cos(angle), ca.sin(angle)
    return ca.vertcat(ca.horzcat(c, -s, 0.0), ca.horzcat(s, c, 0.0), ca.horzcat(0.0, 0.0, 1.0))


def _rotation(ca: Any, quaternion: Any) -> Any:
    """Return the rotation of a quaternion (w, x, y, z) of any length."""
    w, x, y, z = ca.vertsplit(quaternion / ca.norm_2(quaternion))
    return ca.vertcat(
        ca.horzcat(1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        ca.horzcat(2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        ca.horzcat(2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    )


def _body_force(
    ca: Any, inertias: TreeInertias, k: int, twist: tuple[Any, Any], rate: tuple[Any, Any]
) -> tuple[Any, Any]:
    """Return torque and force that give the bodies on joint k their acceleration."""
    mass, moment, I_J = inertias.masses[k], inertias.moments[k], inertias.inertias[k]

    def momentum(angular: Any, linear: Any) -> tuple[Any, Any]:
        return (
            I_J @ angular + ca.cross(ca.SX(moment), linear),
            mass * linear - ca.cross(ca.SX(moment), angular),
        )

    (w, v), (torque, force) = twist, momentum(*rate)
    turned, moved = momentum(w, v)
    return torque + ca.cross(w, turned) + ca.cross(v, moved), force + ca.cross(w, moved)


def _solved(ca: Any, M: Any, b: Any) -> Any:
    """Return M^-1 b of a symmetric, positive definite M, by its factors L D L'."""
    n = M.shape[0]
    L, D = ca.SX.eye(n), [ca.SX(0)] * n
    for j in range(n):
        D[j] = M[j, j] - sum((L[j, k] ** 2 * D[k] for k in range(j)), ca.SX(0))
        for i in range(j + 1, n):
            below = M[i, j] - sum((L[i, k] * L[j, k] * D[k] for k in range(j)), ca.SX(0))
            L[i, j] = below / D[j]
    x = [b[i] for i in range(n)]
    for i in range(n):
        x[i] = x[i] - sum((L[i, k] * x[k] for k in range(i)), ca.SX(0))
    x = [x[i] / D[i] for i in range(n)]
    for i in reversed(range(n)):
        x[i] = x[i] - sum((L[k, i] * x[k] for k in range(i + 1, n)), ca.SX(0))
    return ca.vertcat(*x) if x else ca.SX.zeros(0, 1)
