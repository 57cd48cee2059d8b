"""Start the node: ``ros2 launch scene_graph_ros scene_graph.launch.py scene:=<file>``.

With ``rviz:=true`` RViz comes along. Every argument can be listed with ``--show-args``. Fast DDS
talks UDP also on one machine, unless FASTDDS_BUILTIN_TRANSPORTS says otherwise: its shared memory
loses a wake-up now and then, and contacts come a third of a second late (docs/messages.md).
"""

from launch.actions import DeclareLaunchArgument
from launch.conditions import IfCondition
from launch.substitutions import (
    EnvironmentVariable,
    LaunchConfiguration,
    PathJoinSubstitution,
    PythonExpression,
)
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
from launch_ros.substitutions import FindPackageShare

from launch import LaunchDescription

# Topics of the node that the configuration of RViz has, below the node's name as it is by default.
SHOWN = (
    "cameras/wrist/color/image",
    "contact_markers",
    "contact_surface_markers",
    "contact_surface_points",
    "markers/illustration",
    "markers/perception",
    "markers/plan",
    "markers/proximity",
    "markers/regions",
)
CONFIGURED = "/scene_graph"

TRANSPORTS = "FASTDDS_BUILTIN_TRANSPORTS"

# Name, default (a list is a path inside this package's share folder), description.
ARGUMENTS = (
    ("scene", "", "Scene file: a path, file:// or package:// address; empty: an empty world."),
    ("params_file", ["config", "scene_graph.yaml"], "File with the parameters of the node."),
    ("name", "scene_graph", "Name of the node, which its topics and services start with."),
    ("namespace", "", "Namespace of the node."),
    ("use_sim_time", "false", "Whether to take the time from /clock."),
    ("log_level", "info", "Least severe log messages to print."),
    (
        "transports",
        EnvironmentVariable(TRANSPORTS, default_value="UDPv4"),
        "Transports of the node, where the middleware is Fast DDS: UDPv4, DEFAULT or others.",
    ),
    ("rviz", "false", "Whether to start RViz."),
    ("rviz_config", ["config", "scene_graph.rviz"], "Configuration of RViz."),
)


def _argument(name: str, default: object, description: str) -> DeclareLaunchArgument:
    if isinstance(default, list):
        default = PathJoinSubstitution([FindPackageShare("scene_graph_ros"), *default])
    return DeclareLaunchArgument(name, default_value=default, description=description)


def _below(name: str) -> PythonExpression:
    """Return a topic below the node's whole name, with or without a namespace."""
    whole = [LaunchConfiguration("namespace"), "/", LaunchConfiguration("name"), f"/{name}"]
    return PythonExpression(["'/' + '/'.join(filter(None, '", *whole, "'.split('/')))"])


def generate_launch_description() -> LaunchDescription:
    """Describe the node, and RViz where it is wanted."""
    use_sim_time = ParameterValue(LaunchConfiguration("use_sim_time"), value_type=bool)
    scene = ParameterValue(LaunchConfiguration("scene"), value_type=str)
    node = Node(
        package="scene_graph_ros",
        executable="scene_graph_node",
        name=LaunchConfiguration("name"),
        namespace=LaunchConfiguration("namespace"),
        output="screen",
        additional_env={TRANSPORTS: LaunchConfiguration("transports")},
        parameters=[
            LaunchConfiguration("params_file"),
            {"scene": scene, "use_sim_time": use_sim_time},
        ],
        ros_arguments=["--log-level", LaunchConfiguration("log_level")],
    )
    rviz = Node(
        package="rviz2",
        executable="rviz2",
        condition=IfCondition(LaunchConfiguration("rviz")),
        arguments=["-d", LaunchConfiguration("rviz_config")],
        parameters=[{"use_sim_time": use_sim_time}],
        remappings=[(f"{CONFIGURED}/{topic}", _below(topic)) for topic in SHOWN],
    )
    return LaunchDescription([*(_argument(*row) for row in ARGUMENTS), node, rviz])
