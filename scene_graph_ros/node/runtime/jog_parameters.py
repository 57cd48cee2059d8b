"""The parameters of jogging: all of them are read at the node's start alone."""

from __future__ import annotations

from scene_graph_ros.node.runtime.parameter import Parameter, Value

__all__ = ["JOG_PARAMETERS"]


def _number(
    name: str, default: Value, description: str, minimum: float, maximum: float
) -> Parameter:
    return Parameter(name, default, description, minimum=minimum, maximum=maximum, read_only=True)


JOG_PARAMETERS: tuple[Parameter, ...] = (
    Parameter(
        "jog",
        "",
        "Robot, or group of one, that messages on ~/delta_joint_cmds and ~/delta_twist_cmds may"
        " move, as panda or panda/arm; empty: none.",
        read_only=True,
    ),
    Parameter(
        "jog_link",
        "",
        "Link that ~/delta_twist_cmds moves, as panda/panda_hand; empty: none, and twists are"
        " refused.",
        read_only=True,
    ),
    Parameter(
        "jog_output",
        "velocities",
        "Message on ~/jog_velocities: std_msgs/Float64MultiArray, or"
        " trajectory_msgs/JointTrajectory of one point.",
        choices=("velocities", "trajectory"),
        read_only=True,
    ),
    _number("jog_rate", 100.0, "Hz. How often velocities are sent while jogging.", 1.0, 1000.0),
    _number("jog_keep", 0.02, "Metres. Distance that jogging keeps, beyond paddings.", 0.0, 100.0),
    _number(
        "jog_gain",
        5.0,
        "1/s. Of the distance to spare, how much may be used up in a second.",
        1e-3,
        1e3,
    ),
    _number(
        "jog_acceleration",
        2.0,
        "rad/s^2 or m/s^2. Largest acceleration of each joint that is jogged.",
        1e-3,
        1e4,
    ),
    _number(
        "jog_self_padding",
        0.0,
        "Metres. Padding between a robot's own links; negative where they are always nearer to"
        " each other than jog_keep.",
        -100.0,
        100.0,
    ),
    _number(
        "jog_obstacle_speed",
        0.0,
        "m/s. How fast any point of sources that send poses may go, in any direction; 0: they are"
        " taken to stand still until they are heard elsewhere.",
        0.0,
        100.0,
    ),
    _number(
        "jog_timeout",
        0.1,
        "Seconds. An older command counts no more, and the robot brakes.",
        1e-3,
        60.0,
    ),
    _number(
        "jog_max_state_age",
        0.1,
        "Seconds. Where the robot's own positions are older, it brakes.",
        1e-3,
        60.0,
    ),
    _number(
        "jog_max_pose_age",
        0.0,
        "Seconds. Where another source's poses are older, the robot brakes; 0: they may have any"
        " age.",
        0.0,
        1e6,
    ),
)
