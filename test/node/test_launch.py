"""The launch file under the real launch, where it is installed.

It has no wheels, so that the environment of `make setup` lacks it; a full ROS 2 installation has
it. `test_configuration.py` checks the file everywhere, with stand-ins.
"""

from pathlib import Path

import pytest

LAUNCH = Path(__file__).parents[2] / "launch" / "scene_graph.launch.py"
REASON = "has no wheels; a full ROS 2 installation has it"
launch = pytest.importorskip("launch", reason=f"launch {REASON}")
actions = pytest.importorskip("launch_ros.actions", reason=f"launch_ros {REASON}")


@pytest.fixture
def description():
    """What launch reads from the file."""
    from launch.launch_description_sources import PythonLaunchDescriptionSource

    return PythonLaunchDescriptionSource(str(LAUNCH)).try_get_launch_description_without_context()


def test_launch_knows_the_arguments(description):
    """`ros2 launch ... --show-args` lists them, each with a default."""
    arguments = {a.name: a.default_value for a in description.get_launch_arguments()}
    assert {"scene", "params_file", "name", "namespace", "rviz", "log_level"} <= set(arguments)
    assert None not in arguments.values()


def test_launch_makes_the_command_of_the_node(description):
    """Arguments become the executable's name, the scene and the level of the log."""
    context = launch.LaunchContext()
    for entity in description.entities:
        if isinstance(entity, launch.actions.DeclareLaunchArgument):
            entity.execute(context)
    node, rviz = (e for e in description.entities if isinstance(e, actions.Node))
    assert (node.node_package, node.node_executable) == ("scene_graph_ros", "scene_graph_node")
    node._perform_substitutions(context)
    assert node.node_name == "/scene_graph"
    assert not rviz.condition.evaluate(context)
