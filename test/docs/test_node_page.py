"""The page on the node lists what the code has: parameters, topics, profiles, statuses, faults."""

from pathlib import Path
import re

import pytest

from scene_graph_msgs.msg import Status
from scene_graph_ros.node.effects.declarations import CAMERA_TOPICS, CAMERAS, EFFECTS
from scene_graph_ros.node.runtime import names, qos
from scene_graph_ros.node.world import configuration_inputs, queued_channel, sensor_inputs
from scene_graph_ros.node.world.faults import Fault
from scene_graph_ros.node.world.tf_channel import STATIC_TOPIC
from tools.node_tables import written

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "node.md").read_text()


def section(heading):
    """Return what stands below a heading."""
    return PAGE.split(f"\n## {heading}\n", 1)[1].split("\n## ", 1)[0]


def first_cells(text):
    """Return all that stands in backquotes in the first cells of a table's rows."""
    cells = re.findall(r"^\| (`[^|]*`) \|", text, re.M)
    return {name for cell in cells for name in re.findall(r"`([^`]+)`", cell)}


def test_parameters_and_services_are_those_of_the_code():
    """`python -m tools.node_tables` writes them."""
    assert written(PAGE) == PAGE


def test_every_topic_that_is_read_is_listed():
    """With all types of poses, by the names that topics have where none is given."""
    topics = {topic.format(source="<source>") for topic in names.POSE_TOPICS.values()}
    text = section("Topics that it reads")
    of_robots = {"multi_dof_joint_states", STATIC_TOPIC}
    configurations = names.default_configuration_topic("<source>")
    points = names.default_points_topic("<source>")
    heights = names.default_heights_topic("<source>")
    voxels = names.default_voxels_topic("<source>")
    assert first_cells(text) == topics | of_robots | {configurations, points, heights, voxels}
    for kind in names.POSE_TOPICS:
        assert kind.rpartition("/")[2] in text


def test_every_topic_that_is_published_is_listed():
    """Those of effects, cameras and diagnostics, and no other."""
    topics = {topic for effect in EFFECTS for topic in effect.topics}
    topics |= {
        f"{CAMERAS}/<name>/...",
        f"{names.SENSED}/<source>",
        names.TRAJECTORY,
        names.TRANSFORMS,
        names.DIAGNOSTICS,
    }
    assert first_cells(section("Topics that it publishes")) == topics
    cameras = (ROOT / "docs" / "cameras.md").read_text()
    for topic in {topic for topics in CAMERA_TOPICS.values() for topic in topics}:
        assert f"`{topic}`" in cameras


@pytest.mark.parametrize(
    ("name", "profile"),
    [
        ("poses", qos.pose_qos(queued_channel.QUEUED)),
        ("contacts", qos.contact_qos()),
        ("markers", qos.marker_qos()),
        ("images", qos.image_qos()),
        ("latched", qos.latched_qos()),
        ("diagnostics", qos.diagnostics_qos()),
        ("feedback", qos.feedback_qos()),
        ("services", qos.service_qos()),
    ],
)
def test_profiles_are_those_of_the_code(name, profile):
    """Depth, reliability and durability."""
    words = (profile.reliability.name, profile.durability.name.replace("_", " "))
    row = f"| {name} | {profile.depth} | {' | '.join(words).lower()} |"
    assert row in section("Quality of service")


def test_configurations_have_a_depth_of_their_own():
    """The row of poses says so."""
    depths = (
        f"; {configuration_inputs._QUEUED} of configurations, {sensor_inputs._QUEUED} of points, "
    )
    assert depths in section("Quality of service")


def test_every_status_is_listed():
    """In the order of their numbers."""
    codes = {name: getattr(Status, name) for name in dir(Status) if name.isupper()}
    listed = re.findall(r"^\| `(\w+)` \|", section("Statuses"), re.M)
    assert listed == sorted((n for n in codes if isinstance(codes[n], int)), key=codes.get)


def test_every_fault_is_listed():
    """By the names that diagnostics have."""
    table = section("Diagnostics").split("| fault |", 1)[1]
    assert first_cells(table) == {fault.value for fault in Fault}
