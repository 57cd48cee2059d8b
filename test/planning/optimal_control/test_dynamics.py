"""Dynamics: what can be traced, what is refused, and robots."""

import subprocess
import sys

import casadi as ca
import numpy as np
import pytest
from robots import find_robot

from scene_graph_ros.planning import Dynamics, DynamicsError, MissingCasadiError
from scene_graph_ros.planning.optimal_control.casadi_backend import get_casadi
from scene_graph_ros.planning.optimal_control.errors import TrajectoryOptimizationError
from scene_graph_ros.scene_files import load_urdf

STATES, INPUTS = [0.3, -0.7], [1.1]
WANTED = [-0.7, 1.1 - 2.0 * np.sin(0.3)]


def by_casadi(x, u, t, p):
    """A pendulum, with CasADi's functions."""
    return ca.vertcat(x[1], u[0] - p[0] * ca.sin(x[0]))


def by_numpy(x, u, t, p):
    """The same, with NumPy's."""
    return [x[1], u[0] - p[0] * np.sin(x[0])]


def unpacked(x, u, t, p):
    """The same, with names for what is in x."""
    angle, speed = x
    (length,) = p
    return np.array([speed, u[0] - length * np.sin(angle)])


@pytest.mark.parametrize("f", [by_casadi, by_numpy, unpacked])
def test_plain_functions_are_traced(f):
    """Values and derivatives are exact, however f is written."""
    system = Dynamics(f, 2, 1, parameters=[2.0])
    np.testing.assert_allclose(system(STATES, INPUTS), WANTED, atol=1e-15)
    A, B = system.linearized(STATES, INPUTS)
    np.testing.assert_allclose(A, [[0.0, 1.0], [-2.0 * np.cos(0.3), 0.0]], atol=1e-15)
    np.testing.assert_allclose(B, [[0.0], [1.0]], atol=1e-15)
    assert system.has_second_derivatives
    assert not system.is_discrete
    assert system(STATES, INPUTS, p=[0.0])[1] == 1.1


def branching(x, u, t, p):
    """Something that can't be traced."""
    return np.array([x[1], u[0] if x[0] > 0.0 else 0.0])


def its_jacobian(x, u, t, p):
    """Its derivatives."""
    return np.array([[0.0, 1.0], [0.0, 0.0]]), np.array([[0.0], [1.0 if x[0] > 0.0 else 0.0]])


def test_what_can_not_be_traced_needs_a_jacobian():
    """The error names the remedy, which works."""
    with pytest.raises(DynamicsError, match=r"f can't be traced: .*if_else.*jacobian="):
        Dynamics(branching, 2, 1)
    system = Dynamics(branching, 2, 1, jacobian=its_jacobian)
    assert system([1.0, 2.0], [3.0]).tolist() == [2.0, 3.0]
    assert system([-1.0, 2.0], [3.0]).tolist() == [2.0, 0.0]
    A, B = system.linearized([1.0, 2.0], [3.0])
    assert A.tolist() == [[0.0, 1.0], [0.0, 0.0]]
    assert B.tolist() == [[0.0], [1.0]]
    assert not system.has_second_derivatives


def test_what_a_function_raises_is_raised():
    """Not CasADi's words for it."""

    def broken(x, u, t, p):
        raise KeyError("nothing here")

    system = Dynamics(broken, 2, 1, jacobian=its_jacobian)
    with pytest.raises(KeyError, match="nothing here"):
        system([0.0, 0.0], [0.0])
    wrong = Dynamics(lambda x, u, t, p: x[:1], 2, 1, jacobian=its_jacobian)
    with pytest.raises(DynamicsError, match=r"f must return shape \(2,\), not \(1,\)"):
        wrong([0.0, 0.0], [0.0])


def test_what_is_no_number_is_refused():
    """The error names the entry and where it is, and what to do."""
    system = Dynamics(lambda x, u, t, p: [ca.log(x[0])], 1, 0)
    assert system([1.0]).tolist() == [0.0]
    with pytest.raises(DynamicsError, match=r"f\[0\] must be finite, not nan, at x = \[-1.0\]"):
        system([-1.0])


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ((3, 2, 1), "f must be a function"),
        ((by_numpy, 0, 1), "num_states must be a whole number, at least 1, not 0"),
        ((by_numpy, 2, -1), "num_inputs must be a whole number, at least 0"),
        ((lambda x, u, t, p: [x[0]], 2, 1), r"num_states = 2 entries, not \(1, 1\)"),
        ((lambda x, u, t, p: x[5], 2, 1), "f can't be traced"),
        ((lambda x: x, 2, 1), "f can't be traced: TypeError"),
    ],
)
def test_what_makes_no_sense_is_refused(arguments, words):
    """The message names the argument."""
    with pytest.raises(TrajectoryOptimizationError, match=words):
        Dynamics(*arguments)


def test_other_sizes_are_refused():
    """Of a state, of parameters, and of a step."""
    system = Dynamics(by_numpy, 2, 1, parameters=[2.0])
    with pytest.raises(TrajectoryOptimizationError, match=r"x must have shape \(2,\)"):
        system([0.0], [0.0])
    with pytest.raises(TrajectoryOptimizationError, match=r"parameters\[0\] must be finite"):
        Dynamics(by_numpy, 2, 1, parameters=[np.nan])
    with pytest.raises(TrajectoryOptimizationError, match="discrete_step must be positive"):
        Dynamics(by_numpy, 2, 1, parameters=[2.0], discrete_step=0.0)


def test_an_arm_falls():
    """A robot's state is its positions and velocities, its inputs the joints that are named."""
    robot, _ = find_robot("ur5")
    system = Dynamics.of_robot(robot, actuated=["elbow_joint", "wrist_1_joint"])
    assert (system.num_states, system.num_inputs) == (12, 2)
    x = np.random.default_rng(0).uniform(-1.0, 1.0, 12)
    rate = system(x, [3.0, -2.0])
    assert (rate[:6] == x[6:]).all()
    tau = np.array(system.equations.inverse_dynamics(x[:6], x[6:], rate[6:])).ravel()
    names = system.equations.inertias.tree.velocity_names
    wanted = [{"elbow_joint": 3.0, "wrist_1_joint": -2.0}.get(name, 0.0) for name in names]
    np.testing.assert_allclose(tau, wanted, atol=1e-10)


def test_a_robot_that_can_not_move_is_refused():
    """Unknown joints, joints that move no mass, and robots without joints."""
    light = load_urdf(
        '<robot name="light"><link name="a"/><link name="b"/><joint name="j" type="continuous">'
        '<parent link="a"/><child link="b"/></joint></robot>'
    )
    with pytest.raises(DynamicsError, match=r"'j' of robot 'light' moves no mass.*<inertial>"):
        Dynamics.of_robot(light)
    robot, _ = find_robot("ur5")
    with pytest.raises(DynamicsError, match=r"no velocity 'elbow_jiont'.*elbow_joint"):
        Dynamics.of_robot(robot, actuated=["elbow_jiont"])
    with pytest.raises(DynamicsError, match="no joint that moves"):
        Dynamics.of_robot(load_urdf('<robot name="stone"><link name="a"/></robot>'))


def test_casadi_is_imported_by_who_asks():
    """Importing planning and its names does not; asking without it names the remedy."""
    code = (
        "import sys; from scene_graph_ros.planning import Dynamics, ZmpPlanner;"
        "import scene_graph_ros.planning.trajectories; print('casadi' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["False"]


def test_casadi_that_is_missing_is_named(monkeypatch):
    """The error says what to install."""
    monkeypatch.setitem(sys.modules, "casadi", None)
    with pytest.raises(MissingCasadiError, match="pip install casadi"):
        get_casadi()
