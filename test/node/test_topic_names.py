"""Topics of sources: held to the rule that ROS has for names, each of one type and one use."""

from __future__ import annotations

from dataclasses import dataclass
import random

import pytest
from rclpy.exceptions import InvalidTopicNameException
from rclpy.expand_topic_name import expand_topic_name
from rclpy.validate_full_topic_name import validate_full_topic_name

from scene_graph_ros.node.topic_names import expand_topic, topic_problems, TopicNameError
from scene_graph_ros.node.world.source_topics import topics_of

POSES = "sensor_msgs/msg/MultiDOFJointState"
STAMPED = "geometry_msgs/msg/PoseStamped"


@dataclass(frozen=True)
class Sender:
    """What is known of a source."""

    name: str
    pose_type: str = POSES
    pose_topic: str = ""
    configuration_topic: str = ""
    points_topic: str = ""
    sensor: None = None
    robot: None = None
    description: None = None


def problems(*senders, before=(), deforming=()):
    """Return what is wrong with the topics of new sources."""
    new, old = topics_of(senders, deforming), topics_of(before, deforming)
    return [problem for _, problem in topic_problems(new, old)]


def as_ros_says(topic):
    """Return the absolute name by rclpy, None where that refuses it.

    By its own rule a "~" is followed by a slash, which rclpy does not look at.
    """
    if topic.startswith("~") and topic[1:2] not in ("", "/"):
        return None
    try:
        name = expand_topic_name(topic, "scene_graph", "/")
        validate_full_topic_name(name)
    except (ValueError, InvalidTopicNameException):
        return None
    return name


def test_names_are_those_that_ros_allows():
    """On 20000 random names rclpy says the same, and expands them to the same."""
    rng = random.Random(20)
    pieces = [
        "a",
        "B",
        "_",
        "7",
        "/",
        "~",
        "~/",
        "{node}",
        "{ns}",
        "{x}",
        "-",
        " ",
        ".",
        "é",
        "\n",
    ]
    seen = {True: 0, False: 0}
    for _ in range(20000):
        topic = "".join(rng.choices(pieces, k=rng.randrange(6)))
        try:
            ours = expand_topic(topic)
        except TopicNameError:
            ours = None
        assert ours == as_ros_says(topic), topic
        seen[ours is not None] += 1
    assert min(seen.values()) > 1000


@pytest.mark.parametrize("length", [246, 247, 300])
def test_a_name_is_as_long_as_ros_allows(length):
    """With its slash the absolute name may have 247 characters, as rclpy has it."""
    topic = "x" * length
    if as_ros_says(topic):
        assert expand_topic(topic) == f"/{topic}"
    else:
        with pytest.raises(TopicNameError, match=f"too long for a topic: {length + 1}"):
            expand_topic(topic)
    assert (length == 246) == bool(as_ros_says(topic))


@pytest.mark.parametrize(
    "name", ["arm-left", "ur5e.left", "Robot 1", "1digit", "é☃", "{node}", "~", "x" * 250]
)
def test_a_name_that_makes_no_topic_needs_one_to_be_named(name):
    """It is refused where the topic is to be made of it, and is fine with another."""
    (problem,) = problems(Sender(name))
    assert repr(name)[:90] in problem
    assert problems(Sender(name, pose_topic="robot_1/poses")) == []
    assert problems(Sender(name, pose_type="")) == []
    (problem,) = problems(Sender(name, pose_type=""), deforming=[name])
    assert "configurations" in problem
    assert problems(Sender(name, pose_type="tf2_msgs/msg/TFMessage")) == []


@pytest.mark.parametrize("topic", ["two words!", "a//b", "a/", "/", "{x}/poses", "a\nb"])
def test_a_topic_that_is_none_is_quoted(topic):
    """The refusal has the source, the name in quotes, and the rule."""
    for sender in (
        Sender("s", pose_topic=topic),
        Sender("s", pose_type="", configuration_topic=topic),
    ):
        (problem,) = problems(sender, deforming=["s"] if not sender.pose_type else [])
        assert problem.startswith("source 's' can't send")
        assert repr(topic) in problem
        assert "letters, digits and '_'" in problem
        assert "\n" not in problem


def test_a_topic_has_one_type():
    """Two sources may share a topic of one type; of another it is refused, naming the other."""
    first = Sender("first", pose_topic="shared")
    assert problems(Sender("second", pose_topic="/shared"), before=[first]) == []
    second = Sender("second", STAMPED, "/shared")
    for found in (problems(second, before=[first]), problems(first, second)):
        (problem,) = found
        assert "'second'" in problem
        assert f"source 'first' uses it for {POSES}" in problem
    both = Sender("both", STAMPED, "both/configurations")
    assert len(problems(both, deforming=["both"])) == 1


@pytest.mark.parametrize(
    "topic", ["/scene_graph/contacts", "~/markers/proximity", "/diagnostics", "/rosout", "/clock"]
)
def test_what_the_node_itself_uses_is_taken(topic):
    """Whatever name it is asked for by."""
    (problem,) = problems(Sender("s", pose_topic=topic))
    assert "the node itself uses it" in problem


def test_a_bad_topic_that_is_there_is_in_nobodys_way():
    """One that a program which embeds the node brought does not make others fail."""
    assert problems(Sender("good"), before=[Sender("two words")]) == []
