"""Robots of the package example-robot-data, for tests and benchmarks."""

from __future__ import annotations

from typing import NamedTuple

from scene_graph_ros.geometry import SceneGraph
from scene_graph_ros.geometry.model.ids import FrameId, SourceId
from scene_graph_ros.scene_files import (
    Kinematics,
    load_srdf,
    load_urdf,
    register_robot,
    RobotModel,
    SemanticModel,
)

__all__ = ["ROBOTS", "URDF_ONLY", "PlacedRobot", "find_robot", "place_robot"]

_FOLDER = "package://example-robot-data/robots"

# name: (URDF, SRDF)
ROBOTS = {
    "panda": ("panda_description/urdf/panda.urdf", "panda_description/srdf/panda.srdf"),
    "panda_collision": (
        "panda_description/urdf/panda_collision.urdf",
        "panda_description/srdf/panda.srdf",
    ),
    "ur3_gripper": (
        "ur_description/urdf/ur3_gripper.urdf",
        "ur_description/srdf/ur3_gripper.srdf",
    ),
    "ur5": ("ur_description/urdf/ur5_robot.urdf", "ur_description/srdf/ur5.srdf"),
    "ur5_gripper": (
        "ur_description/urdf/ur5_gripper.urdf",
        "ur_description/srdf/ur5_gripper.srdf",
    ),
    "ur5_limited": (
        "ur_description/urdf/ur5_joint_limited_robot.urdf",
        "ur_description/srdf/ur5_joint_limited_robot.srdf",
    ),
    "baxter": (
        "baxter_description/urdf/baxter.urdf",
        "baxter_description/srdf/baxter_manipulation.srdf",
    ),
    "talos": ("talos_data/robots/talos_full_v2.urdf", "talos_data/srdf/talos.srdf"),
    "talos_box": ("talos_data/robots/talos_full_v2_box.urdf", "talos_data/srdf/talos.srdf"),
    "talos_reduced": ("talos_data/robots/talos_reduced.urdf", "talos_data/srdf/talos.srdf"),
    "anymal_b": (
        "anymal_b_simple_description/robots/anymal.urdf",
        "anymal_b_simple_description/srdf/anymal.srdf",
    ),
    "anymal_b_kinova": (
        "anymal_b_simple_description/robots/anymal-kinova.urdf",
        "anymal_b_simple_description/srdf/anymal-kinova.srdf",
    ),
    "anymal_c": (
        "anymal_c_simple_description/urdf/anymal.urdf",
        "anymal_c_simple_description/srdf/anymal.srdf",
    ),
    "a1": ("a1_description/urdf/a1.urdf", "a1_description/srdf/a1.srdf"),
    "b1_z1": ("b1_description/urdf/b1-z1.urdf", "b1_description/srdf/b1-z1.srdf"),
    "bolt": ("bolt_description/robots/bolt.urdf", "bolt_description/srdf/bolt.srdf"),
    "centauro": (
        "centauro_description/urdf/centauro.urdf",
        "centauro_description/srdf/centauro.srdf",
    ),
    "finger_edu": (
        "finger_edu_description/robots/finger_edu.urdf",
        "finger_edu_description/srdf/finger_edu.srdf",
    ),
    "go1": ("go1_description/urdf/go1.urdf", "go1_description/srdf/go1.srdf"),
    "go2": ("go2_description/urdf/go2.urdf", "go2_description/srdf/go2.srdf"),
    "hyq": ("hyq_description/robots/hyq_no_sensors.urdf", "hyq_description/srdf/hyq.srdf"),
    "icub": ("icub_description/robots/icub.urdf", "icub_description/srdf/icub.srdf"),
    "pr2": ("pr2_description/urdf/pr2.urdf", "pr2_description/srdf/pr2.srdf"),
    "romeo": ("romeo_description/urdf/romeo.urdf", "romeo_description/srdf/romeo_moveit.srdf"),
    "solo12": ("solo_description/robots/solo12.urdf", "solo_description/srdf/solo.srdf"),
    "xarm7": ("xarm_description/urdf/xarm7.urdf", "xarm_description/srdf/xarm7.srdf"),
    "z1": ("z1_description/urdf/z1.urdf", "z1_description/srdf/z1.srdf"),
}

# Without an SRDF that disables collisions.
URDF_ONLY = {
    "allegro_left": "allegro_hand_description/urdf/allegro_left_hand.urdf",
    "double_pendulum": "double_pendulum_description/urdf/double_pendulum.urdf",
    "g1": "g1_description/urdf/g1_29dof_with_hand_rev_1_0.urdf",
    "hector": "hector_description/robots/quadrotor_base.urdf",
    "iris": "iris_description/robots/iris.urdf",
    "kinova": "kinova_description/robots/kinova.urdf",
    "laikago": "laikago_description/urdf/laikago.urdf",
    "so101": "so_arm_description/urdf/so101.urdf",
    "tiago_dual": "tiago_description/robots/tiago_dual.urdf",
    "tiago_pro": "tiago_pro_description/robots/tiago_pro.urdf",
}


class PlacedRobot(NamedTuple):
    """A robot in a scene graph of its own."""

    model: RobotModel
    semantics: SemanticModel | None
    scene_graph: SceneGraph
    source: SourceId
    frames: dict[str, FrameId]
    kinematics: Kinematics


def find_robot(name: str) -> tuple[RobotModel, SemanticModel | None]:
    """Return a robot by its name in ROBOTS or URDF_ONLY."""
    if name in URDF_ONLY:
        return load_urdf(f"{_FOLDER}/{URDF_ONLY[name]}"), None
    urdf, srdf = ROBOTS[name]
    robot = load_urdf(f"{_FOLDER}/{urdf}")
    return robot, load_srdf(f"{_FOLDER}/{srdf}", robot)


def place_robot(name: str, *, visual: bool = False, with_semantics: bool = True) -> PlacedRobot:
    """Return a robot registered with its collision geometry, and its SRDF's filters if wanted."""
    robot, semantics = find_robot(name)
    if not with_semantics:
        semantics = None
    scene_graph = SceneGraph()
    source = scene_graph.register_source(name)
    frames = register_robot(robot, scene_graph, source, semantics=semantics, visual=visual)
    kinematics = Kinematics(robot, links=tuple(frames))
    return PlacedRobot(robot, semantics, scene_graph, source, frames, kinematics)
