"""What is kept of the messages between two updates, and what of it is read."""

from __future__ import annotations

import math

from geometry_msgs.msg import Quaternion, Transform, Vector3
import numpy as np
import pytest
from rclpy.serialization import serialize_message
from sensor_msgs.msg import MultiDOFJointState

from msg_adapters.wire import (
    find_once,
    marked_numbers,
    marked_stamps,
    MARKED_TIME,
    Patchable,
)
from msg_adapters.wire_poses import Layout
from scene_graph_ros.node.inputs import Channel
from scene_graph_ros.node.intake import Fault, Intake, SourceFrames, TimeLimits, UNSTAMPED
from scene_graph_ros.node.world import SourceRecord

NOW = 1_000_000_000_000
LIMITS = TimeLimits(now=NOW, max_age=5_000_000_000, max_lead=1_000_000_000)
NAMES = ("a", "b", "c")


def pose_template(names):
    """Return the bytes of a message about frames, with the places of stamp and poses."""
    numbers = np.array(marked_numbers(7 * len(names))).reshape(-1, 7)
    message = MultiDOFJointState(joint_names=names)
    message.header.stamp = MARKED_TIME
    for x, y, z, *q in numbers.tolist():
        rotation = Quaternion(**dict(zip("xyzw", q, strict=True)))
        message.transforms.append(Transform(translation=Vector3(x=x, y=y, z=z), rotation=rotation))
    data = serialize_message(message)
    first = find_once(data, numbers.tobytes())
    return Patchable(data, marked_stamps(data), [first + 56 * i for i in range(len(names))], 7)


class Source:
    """A channel with its frames, and a clock that ticks with each message."""

    def __init__(self):
        self.warnings = []
        self.intake = Intake("arm", self.warnings.append)
        self.channel = Channel(SourceRecord(1, "arm", 1), self.intake, MultiDOFJointState)
        count = len(NAMES)
        self.frames = SourceFrames(
            source="arm",
            ids=tuple(range(count)),
            names=NAMES,
            parents=("world",) * count,
            X_PF=np.tile(np.eye(4), (count, 1, 1)),
            stamps=np.full(count, UNSTAMPED),
        )
        self.arrival = 0
        # Bytes between fields, which the serializer leaves as they are, stay the same here.
        self.templates = {}

    def send(self, stamp, **xs):
        """Let a message arrive that places frames at x."""
        template = self.templates.get(tuple(xs))
        if template is None:
            template = self.templates[tuple(xs)] = pose_template(list(xs))
        template.put_stamp(stamp)
        template.put_numbers(np.array([(float(x), 0, 0, 0, 0, 0, 1.0) for x in xs.values()]))
        self.arrival += 1
        self.channel.store(template.data(), self.arrival)

    def update(self):
        """Apply what has arrived; return when the oldest message that counted arrived."""
        return self.channel.apply(self.channel.take(), self.frames, LIMITS)

    @property
    def xs(self):
        """Where the frames are."""
        return dict(zip(NAMES, self.frames.X_PF[:, 0, 3].tolist(), strict=True))


@pytest.fixture
def source():
    """A source that knows the layouts of messages about a, about b, and about all."""
    source = Source()
    for i in range(3):
        for names in (("a",), ("b",), NAMES):
            source.send(NOW - 1000 + i, **dict.fromkeys(names, 0.0))
            source.update()
    source.intake.statistics.superseded = 0
    return source


@pytest.fixture
def read(monkeypatch):
    """How many messages were read by their layout."""
    count = []
    ordinary = Layout.poses

    def poses(self, data, names=None):
        count.append(1)
        return ordinary(self, data, names)

    monkeypatch.setattr(Layout, "poses", poses)
    return count


def test_of_messages_with_the_same_names_only_the_newest_is_read(source, read):
    """A hundred messages between two updates cost as much as one, and are counted."""
    received = source.intake.statistics.received
    for i in range(100):
        source.send(NOW + i, a=i, b=2 * i, c=3 * i)
    assert source.update() == source.arrival
    assert source.xs == {"a": 99.0, "b": 198.0, "c": 297.0}
    assert len(read) == 1
    assert source.intake.statistics.superseded == 99
    assert source.intake.statistics.received == received + 100
    assert not source.intake.statistics.faults


def test_messages_with_other_names_are_not_lost(source, read):
    """Of partial messages in turn the newest of each set of names is applied."""
    for i in range(50):
        source.send(NOW + 2 * i, a=i)
        source.send(NOW + 2 * i + 1, b=-i)
    source.send(NOW + 200, c=7)
    source.update()
    assert source.xs == {"a": 49.0, "b": -49.0, "c": 7.0}
    # That about c alone is new, and read the ordinary way.
    assert len(read) == 2
    assert source.intake.statistics.superseded == 98


def test_partial_and_whole_messages_apply_in_the_order_they_came(source):
    """A part after the whole moves its frame; a part before the whole does not."""
    source.send(NOW + 1, a=1)
    source.send(NOW + 2, a=5, b=5, c=5)
    source.send(NOW + 3, b=3)
    source.update()
    assert source.xs == {"a": 5.0, "b": 3.0, "c": 5.0}


def test_a_message_out_of_order_is_counted_and_does_not_supersede(source):
    """What was stamped before what came before it changes nothing."""
    source.send(NOW + 5, a=5)
    source.send(NOW + 4, a=4)
    source.update()
    assert source.xs["a"] == 5.0
    assert source.intake.statistics.faults == {Fault.OUT_OF_ORDER: 1}
    assert source.intake.statistics.superseded == 0


def test_a_faulty_message_is_counted_and_supersedes_nothing(source):
    """The good pose before a NaN holds, and every NaN is counted."""
    source.send(NOW + 1, a=1)
    for i in range(3):
        source.send(NOW + 2 + i, a=math.nan)
    source.send(NOW + 9, b=2)
    source.update()
    assert source.xs == {"a": 1.0, "b": 2.0, "c": 0.0}
    assert source.intake.statistics.faults == {Fault.NOT_FINITE: 3}
    assert len(source.warnings) == 1


def test_a_good_message_does_not_hide_faulty_ones(source):
    """A NaN that a good message follows is counted all the same."""
    source.send(NOW + 1, a=math.nan)
    source.send(NOW + 2, a=2)
    source.update()
    assert source.xs["a"] == 2.0
    assert source.intake.statistics.faults == {Fault.NOT_FINITE: 1}


def test_messages_about_strangers_are_counted_each(source):
    """Known layouts or not, unknown frames are counted for every message."""
    for i in range(30):
        source.send(NOW + i, ghost=1.0)
        if i % 10 == 9:
            source.update()
    assert source.intake.statistics.faults == {Fault.UNKNOWN_FRAME: 30}


def test_a_flood_of_messages_that_can_not_be_read_stays_bounded(source):
    """Of unknown bytes the newest are looked at, and memory is bounded."""
    for _ in range(1000):
        source.channel.store(b"\x00\x01\x00\x00 nothing", 1)
    source.update()
    malformed = source.intake.statistics.faults[Fault.MALFORMED]
    assert 0 < malformed < 100
    assert source.intake.statistics.superseded == 1000 - malformed


def test_what_is_taken_is_taken_once(source):
    """A second update without messages changes nothing and counts nothing."""
    source.send(NOW + 1, a=1)
    assert source.update() is not None
    applied = source.intake.statistics.applied_poses
    assert source.update() is None
    assert source.intake.statistics.applied_poses == applied
