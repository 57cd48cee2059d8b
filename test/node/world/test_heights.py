"""Messages of heights: whose they are, and those that change nothing."""

from array import array
from types import SimpleNamespace

import numpy as np
import pytest
from rclpy.serialization import serialize_message
from sensor_msgs.msg import Image

from scene_graph_ros.node.effects.declarations import EFFECT_NAMES
from scene_graph_ros.node.world.faults import Fault
from scene_graph_ros.node.world.height_channel import HeightChannel
from scene_graph_ros.node.world.inputs import message_type
from scene_graph_ros.node.world.intake import Intake, UNSTAMPED
from scene_graph_ros.node.world.scenes import SceneLoader
from scene_graph_ros.node.world.source_channel import apply_kept
from scene_graph_ros.node.world.time_limits import TimeLimits
from scene_graph_ros.node.world.world import World

SCENE = """
version: 1
sources: [{name: map}]
geometries:
  - {name: ground, source: map, roles: {proximity: {}},
     shape: {type: height_field, size: [2, 1], floor: -1, heights: [[0, 0, 0], [0, 0, 0]]}}
"""
NOW = 10**12
LIMITS = TimeLimits(now=NOW, max_age=5 * 10**9, max_lead=10**9)
HEIGHTS = np.array([[0.5, 1.0, 1.5], [2.0, 2.5, 3.0]])
A_MILLION = array("B", bytes(10**6))
"""Not as bytes, each of which a message would look at."""


def height_message(heights, encoding="32FC1", **fields):
    """Return a message of heights, without a stamp."""
    kind = {"32FC1": "<f4", "64FC1": ">f8"}.get(encoding, "<f4")
    rows = np.asarray(heights, kind)
    message = Image(height=rows.shape[0], width=rows.shape[1], encoding=encoding)
    message.step, message.is_bigendian = rows.strides[0], int(kind.startswith(">"))
    message.data = array("B", rows.tobytes())
    for name, value in fields.items():
        setattr(message, name, value)
    return message


class Mapping:
    """A world with a height field, and the channel that moves it."""

    def __init__(self, text=SCENE):
        self.world, self.warnings = World(), []
        loader = SceneLoader("", message_type, EFFECT_NAMES)
        request = SimpleNamespace(resource="", text=text, prefix="")
        self.world.edit(lambda edit: loader.load_request(edit, request))
        self.record = self.world.records["map"]
        self.intake = Intake("map", self.warnings.append)
        self.channel = HeightChannel(self.record, self.intake)

    def send(self, *messages, stamp=NOW):
        """Have messages arrive before one update; tell whether they changed the field."""
        for message in messages:
            message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp, 10**9)
            self.channel.store(serialize_message(message), 1)
        with self.world.lock:
            fields, record = self.world.fields, self.world.records.get("map")
            got = apply_kept(self.channel, record, lambda: fields.get("map"), LIMITS)
            if got is not None:
                self.world.commit((), got, (), {"map"})
        return got is not None

    def heights(self):
        """Return the heights in the newest snapshot."""
        snapshot = self.world.snapshot
        return snapshot.query.snapshot.height_set(snapshot.names.geometry_id("ground")).heights

    def faults(self):
        """Return the faults so far."""
        return dict(self.intake.statistics.faults)


@pytest.fixture
def mapping():
    """Return a world with a height field."""
    return Mapping()


@pytest.mark.parametrize("encoding", ["32FC1", "64FC1"])
def test_rows_of_a_message_are_rows_of_the_field(mapping, encoding):
    """The first is that of the least y; of two messages between updates the newest counts."""
    assert mapping.send(height_message(HEIGHTS - 0.25), height_message(HEIGHTS, encoding))
    np.testing.assert_array_equal(mapping.heights(), HEIGHTS)
    assert mapping.faults() == {}
    assert mapping.intake.statistics.superseded == 1
    assert mapping.world.snapshot.source_stamp("map") == NOW
    assert mapping.world.snapshot.with_fields == {"map"}


@pytest.mark.parametrize(
    ("fault", "said", "message", "late"),
    [
        ("malformed", "encoding", height_message(HEIGHTS, "mono16"), 0),
        ("malformed", "data has 3 bytes", height_message(HEIGHTS, data=bytes(3)), 0),
        ("malformed", "more than enough", height_message(HEIGHTS, data=A_MILLION), 0),
        ("wrong_length", "2 x 2 heights, the field 2 x 3", height_message(HEIGHTS[:, :2]), 0),
        ("not_finite", "[0, 1] must be finite", height_message(HEIGHTS * [1, np.nan, 1]), 0),
        ("not_finite", "above the floor at -1 m", height_message(HEIGHTS - 2), 0),
        ("stale", "max_pose_age", height_message(HEIGHTS), 6 * 10**9),
        ("future", "max_pose_lead", height_message(HEIGHTS), -2 * 10**9),
        ("out_of_order", "go back", height_message(HEIGHTS), 1),
    ],
)
def test_faults_are_counted_and_named_and_change_nothing(mapping, fault, said, message, late):
    """The heights before hold."""
    mapping.send(height_message(HEIGHTS + 1.0))
    before = mapping.heights()
    assert not mapping.send(message, stamp=NOW - late)
    assert mapping.faults() == {Fault(fault): 1}
    assert said in mapping.warnings[-1]
    assert mapping.heights() is before


def test_of_several_fields_nobody_knows_which():
    """That is said."""
    more = SCENE + SCENE[SCENE.index("  - {name: ground") :].replace("ground", "more")
    mapping = Mapping(more)
    assert not mapping.send(height_message(HEIGHTS))
    assert mapping.faults() == {Fault.UNKNOWN_GEOMETRY: 1}
    assert "2 height fields" in mapping.warnings[0]


def test_an_edit_carries_the_heights_over(mapping):
    """The same set, so that nothing is built again; its stamp is forgotten with all others."""
    mapping.send(height_message(HEIGHTS))
    before = mapping.heights()
    mapping.world.edit(lambda edit: edit.add_source("new", token=1))
    assert mapping.heights() is before
    assert not mapping.send(height_message(HEIGHTS), stamp=NOW - 1)
    mapping.world.forget_stamps()
    assert mapping.world.snapshot.source_stamp("map") == UNSTAMPED
    assert mapping.send(height_message(HEIGHTS + 1.0), stamp=NOW - 1)
    np.testing.assert_array_equal(mapping.heights(), HEIGHTS + 1.0)
