"""Systems that are to swing up from hanging: a pendulum, an acrobot and a cart with a pole."""

from __future__ import annotations

from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from scene_graph_ros.planning import DirectCollocation, Dynamics
from scene_graph_ros.planning.trajectories import PiecewisePolynomial

__all__ = ["SWING_UPS", "SwingUp", "problem"]

GRAVITY = 9.81


class SwingUp(NamedTuple):
    """A system that hangs at zero, where it is to go, and what its input may be."""

    f: Any
    num_states: int
    goal: tuple[float, ...]
    effort: float
    weight: float
    """Of the squared input in the running cost."""


def pendulum(x, u, t, p):
    """Return the rates of a mass of 1 kg on a rod of 0.5 m, with damping 0.1 N m s."""
    return [x[1], 4.0 * (u[0] - 0.5 * GRAVITY * ca.sin(x[0]) - 0.1 * x[1])]


def acrobot(x, u, t, p):
    """Return the rates of two rods of 1 and 2 m, 1 kg each, with a motor between them."""
    m1 = m2 = l1 = lc2 = 1.0
    lc1 = 0.5
    I1, I2 = 0.083 + m1 * lc1**2, 0.33 + m2 * lc2**2
    c2, s2 = ca.cos(x[1]), ca.sin(x[1])
    M11, M12 = I1 + I2 + m2 * l1**2 + 2 * m2 * l1 * lc2 * c2, I2 + m2 * l1 * lc2 * c2
    h = m2 * l1 * lc2 * s2
    both = GRAVITY * m2 * lc2 * ca.sin(x[0] + x[1])
    first = GRAVITY * (m1 * lc1 + m2 * l1) * ca.sin(x[0]) + both
    r1 = h * x[3] * (2 * x[2] + x[3]) - first - 0.1 * x[2]
    r2 = u[0] - h * x[2] ** 2 - both - 0.1 * x[3]
    det = M11 * I2 - M12**2
    return ca.vertcat(x[2], x[3], (I2 * r1 - M12 * r2) / det, (M11 * r2 - M12 * r1) / det)


def cart_pole(x, u, t, p):
    """Return the rates of a cart of 10 kg that is pushed, with 1 kg on a rod of 0.5 m."""
    mc, mp, length = 10.0, 1.0, 0.5
    s, c = ca.sin(x[1]), ca.cos(x[1])
    mass = mc + mp * s**2
    return ca.vertcat(
        x[2],
        x[3],
        (u[0] + mp * s * (length * x[3] ** 2 + GRAVITY * c)) / mass,
        -(u[0] * c + mp * length * x[3] ** 2 * c * s + (mc + mp) * GRAVITY * s) / (length * mass),
    )


SWING_UPS = {
    "pendulum": SwingUp(pendulum, 2, (np.pi, 0.0), 3.0, 10.0),
    "acrobot": SwingUp(acrobot, 4, (np.pi, 0.0, 0.0, 0.0), 8.0, 10.0),
    "cart-pole": SwingUp(cart_pole, 4, (0.0, np.pi, 0.0, 0.0), 200.0, 0.1),
}


def problem(name: str, samples: int = 21) -> DirectCollocation:
    """Return the problem of swinging up, with a guess that is a straight line of 4 s."""
    system = SWING_UPS[name]
    dynamics = Dynamics(system.f, system.num_states, 1)
    made = DirectCollocation(dynamics, samples, 1.0 / samples, 10.0 / samples)
    made.add_equal_time_intervals_constraints()
    made.add_constraint_to_all_knot_points(
        made.input(), -system.effort, system.effort, label="effort"
    )
    made.prog().add_constraint(made.initial_state() == 0.0, label="start")
    made.prog().add_constraint(made.final_state(), system.goal, system.goal, label="goal")
    made.add_running_cost(system.weight * made.input()[0] ** 2)
    made.add_final_cost(made.time())
    ends = np.zeros(system.num_states), system.goal
    line = PiecewisePolynomial.first_order_hold([0.0, 4.0], ends)
    made.set_initial_trajectory(None, line)
    return made
