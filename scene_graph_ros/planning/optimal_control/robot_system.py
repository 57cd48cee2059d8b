"""A robot's motion as a system of states and inputs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.located import suggestion
from scene_graph_ros.planning.optimal_control.arguments import as_vector
from scene_graph_ros.planning.optimal_control.casadi_backend import get_casadi
from scene_graph_ros.planning.optimal_control.errors import DynamicsError
from scene_graph_ros.planning.optimal_control.robot_equations import RobotEquations
from scene_graph_ros.robots.inertias import tree_inertias
from scene_graph_ros.robots.robot_model import RobotModel
from scene_graph_ros.scene_files.urdf import load_urdf

__all__ = ["RobotSystem", "robot_system"]

_LEAST_MASS = 1e-12
"""Of the mass matrix's largest eigenvalue: one that is smaller counts as none."""


class RobotSystem(NamedTuple):
    """A robot's motion as a function of state and input, and its equations."""

    f: Callable[..., Any]
    num_states: int
    num_inputs: int
    equations: RobotEquations


def robot_system(
    model: RobotModel | str | Path,
    actuated: Sequence[str] | None,
    gravity: ArrayLike,
    floating_base: str,
) -> RobotSystem:
    """Return the dynamics of a robot; see `Dynamics.of_robot`."""
    robot = model if isinstance(model, RobotModel) else load_urdf(model)
    tree = robot.kinematic_tree(floating_base=floating_base)
    names = tree.velocity_names
    if not names:
        raise DynamicsError(f"robot {robot.name!r} has no joint that moves")
    columns = list(range(len(names)))
    if actuated is not None:
        for name in actuated:
            if name not in names:
                raise DynamicsError(
                    f"actuated: robot {robot.name!r} has no velocity {quoted(name)}"
                    f"{suggestion(name, names)}"
                )
        columns = [names.index(name) for name in actuated]
    equations = RobotEquations(tree_inertias(robot, tree), as_vector("gravity", gravity, 3))
    _check_masses(equations)
    ca = get_casadi()
    nq, nv = tree.num_positions, tree.num_velocities

    def f(x: Any, u: Any, t: Any, p: Any) -> Any:
        forces = ca.SX.zeros(nv, 1)
        for k, column in enumerate(columns):
            forces[column] += u[k]
        q, v = x[:nq], x[nq:]
        return ca.vertcat(equations.position_rates(q, v), equations.forward_dynamics(q, v, forces))

    return RobotSystem(f, nq + nv, len(columns), equations)


def _check_masses(equations: RobotEquations) -> None:
    """Raise DynamicsError where a joint moves no mass, naming it."""
    tree = equations.inertias.tree
    M = np.array(equations.mass_matrix(tree.zero_configuration()))
    values, vectors = np.linalg.eigh(0.5 * (M + M.T))
    if not values[0] > _LEAST_MASS * values[-1]:
        name = tree.velocity_names[int(np.argmax(abs(vectors[:, 0])))]
        raise DynamicsError(
            f"{name!r} of robot {tree.name!r} moves no mass: its links need an <inertial> with a"
            " mass and an inertia"
        )
