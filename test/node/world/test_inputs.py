"""What is kept of the messages between two updates, and what of it is read."""

from __future__ import annotations

import math
import os
import struct

from geometry_msgs.msg import Quaternion, Transform
import numpy as np
import pytest
from rclpy.serialization import serialize_message
from sensor_msgs.msg import MultiDOFJointState

from msg_adapters.poses import PoseBatch
from msg_adapters.stamps import EARLIEST, LATEST
from msg_adapters.wire.fields import Patchable
from msg_adapters.wire.layout import layout
from msg_adapters.wire.poses import Layout
from scene_graph_ros.geometry import GeometryFrame, SceneGraph
from scene_graph_ros.geometry.spatial.quaternion_kernels import poses_from_quaternions_kernel
from scene_graph_ros.geometry.spatial.record_kernels import are_valid, latest, place_records
from scene_graph_ros.node.world.faults import Fault
from scene_graph_ros.node.world.intake import Intake, SourceFrames, UNSTAMPED
from scene_graph_ros.node.world.pose_channel import PoseChannel
from scene_graph_ros.node.world.scene import SourceRecord
from scene_graph_ros.node.world.time_limits import TimeLimits
from scene_graph_ros.node.world.world import World
from scene_graph_ros.warmup.main_job import read_poses

NOW = 1_000_000_000_000
LIMITS = TimeLimits(now=NOW, max_age=5_000_000_000, max_lead=1_000_000_000)
NAMES = ("a", "b", "c")


def pose_template(names, parent=""):
    """Return the bytes of a message about frames, with the places of stamp and poses."""
    message = MultiDOFJointState(joint_names=names, transforms=[Transform() for _ in names])
    message.header.frame_id = parent
    fields = layout(message)
    places = fields.begins("transforms.translation.x")
    return Patchable(serialize_message(message), [fields.begin("header.stamp.sec")], places, 7)


def batch_of(name, stamp):
    """Return a batch of one pose at the origin."""
    stamps = np.array([stamp], dtype=np.int64)
    return PoseBatch((name,), ("",), stamps, np.eye(4)[np.newaxis], ())


class Source:
    """A channel with its frames, and a clock that ticks with each message."""

    def __init__(self):
        self.warnings = []
        self.intake = Intake("arm", self.warnings.append)
        self.channel = PoseChannel(SourceRecord(1, "arm"), self.intake, MultiDOFJointState)
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
        self.send_rows(stamp, tuple(xs), [(float(x), 0, 0, 0, 0, 0, 1.0) for x in xs.values()])

    def send_rows(self, stamp, names, rows, parent=""):
        """Let a message arrive with the seven numbers of each frame."""
        template = self.templates.get((names, parent))
        if template is None:
            template = self.templates[names, parent] = pose_template(list(names), parent)
        template.put_stamp(stamp)
        template.put_numbers(np.array(rows))
        self.arrival += 1
        self.channel.store(template.data(), self.arrival)

    def update(self, limits=LIMITS):
        """Apply what has arrived; return when the oldest message that counted arrived."""
        return self.channel.apply(self.channel.take(), self.frames, limits)

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
    """For each message that was read by its layout, whether that was done in one go."""
    results = []
    ordinary = Layout.place_poses

    def place_poses(self, *arguments):
        results.append(ordinary(self, *arguments))
        return results[-1]

    monkeypatch.setattr(Layout, "place_poses", place_poses)
    return results


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


def test_a_flood_of_known_messages_stays_bounded(source):
    """Long before the next update those are dropped that it would not read."""
    for i in range(1000):
        source.send(NOW + i, a=i, b=i, c=i)
    assert len(source.channel._kept) < 64
    assert source.update() == source.arrival
    assert source.intake.statistics.superseded == 999


def test_a_few_long_messages_are_not_kept_until_the_update_either(source):
    """Of ten with a megabyte each, which nobody reads, less than half are there at any time."""
    for i in range(10):
        source.channel.store(bytes([0, 1, 0, 0, i]) + bytes(1 << 20), 1)
        assert len(source.channel._kept) <= 5
    source.update()
    assert source.intake.statistics.superseded == 9


def test_what_is_taken_is_taken_once(source):
    """A second update without messages changes nothing and counts nothing."""
    source.send(NOW + 1, a=1)
    assert source.update() is not None
    applied = source.intake.statistics.applied_poses
    assert source.update() is None
    assert source.intake.statistics.applied_poses == applied


def message_of_any_kind(rng, newest):
    """Return stamp, names, numbers and parent of a message with which anything may be wrong."""
    names = [NAMES, ("a",), ("c", "a"), ("b", "ghost"), ("c", "b", "a")][rng.integers(5)]
    parent = ["", "world", "map"][rng.choice(3, p=[0.45, 0.45, 0.1])]
    stamps = [0, newest + 1, newest, newest - 1, NOW - 6_000_000_000, NOW + 2_000_000_000]
    stamp = stamps[rng.choice(6, p=[0.05, 0.6, 0.1, 0.15, 0.05, 0.05])]
    rows = rng.normal(size=(len(names), 7))
    rows[:, 3:] /= np.linalg.norm(rows[:, 3:], axis=1, keepdims=True)
    rows[:, 3:] *= rng.choice([1.0, 1.0 - 9e-4, 1.0 + 9e-4])
    if rng.random() < 0.3:
        column, value = [(1, np.nan), (6, np.inf), (2, 2e12), (4, 2.0)][rng.integers(4)]
        rows[rng.integers(len(names)), column] = value
    return stamp, names, rows, parent


def counts(source):
    """Return what was counted."""
    statistics = source.intake.statistics
    return statistics.applied_messages, statistics.applied_poses, dict(statistics.faults)


def test_in_one_go_or_one_by_one_the_same_comes_out(read):
    """Poses, stamps, counts and warnings are those of the ordinary way, to the last bit."""
    fast, ordinary = Source(), Source()
    ordinary.channel._wire.find = lambda data: None
    rng, newest = np.random.default_rng(3), NOW - 1000
    for _ in range(600):
        message = message_of_any_kind(rng, newest)
        if message[0] < NOW + LIMITS.max_lead:
            newest = max(newest, message[0] or NOW)
        arrivals = []
        for one in (fast, ordinary):
            one.send_rows(*message)
            arrivals.append(one.update())
        assert arrivals[0] == arrivals[1]
        assert fast.frames.X_PF.tobytes() == ordinary.frames.X_PF.tobytes()
        assert fast.frames.stamps.tolist() == ordinary.frames.stamps.tolist()
        assert counts(fast) == counts(ordinary)
    assert fast.warnings == ordinary.warnings
    assert len(ordinary.intake.statistics.faults) == 7
    assert read.count(True) > 100
    assert read.count(False) > 100


@pytest.mark.parametrize("is_known", [True, False])
def test_a_stamp_that_is_no_time_is_refused_with_its_value(source, is_known):
    """Nanoseconds of a second or more: not taken by its layout either, and nothing superseded."""
    if not is_known:
        source.channel._wire.find = lambda data: None
    source.send(NOW + 1, a=1)
    template = source.templates[("a",), ""]
    place = layout(MultiDOFJointState()).begin("header.stamp.sec")
    odd = bytearray(template.data())
    odd[place : place + 8] = struct.pack("=iI", NOW // 10**9 - 1, 10**9)
    source.channel.store(bytes(odd), 1)
    source.update()
    assert source.xs["a"] == 1.0
    assert source.intake.statistics.faults == {Fault.MALFORMED: 1}
    assert "nanosec is 1000000000" in source.warnings[-1]


def test_a_stamp_that_no_answer_could_say_is_refused(source):
    """Also before simulated time begins, when any other is taken."""
    before = TimeLimits(0, LIMITS.max_age, LIMITS.max_lead)
    source.send(LATEST, a=1)
    source.update(before)
    assert source.xs["a"] == 1.0
    beyond = batch_of("a", LATEST + 1)
    assert source.intake.accept(beyond, source.frames, before) == 0
    assert source.intake.statistics.faults == {Fault.FUTURE: 1}
    assert str(LATEST + 1) in source.warnings[-1]


def test_bounds_of_time_stay_in_their_range():
    """Ages and leads that no stamp can have, and time 0, leave what a message can say."""
    first, last = EARLIEST, LATEST
    assert TimeLimits(0, 5, 5).bounds() == (0, first, last)
    assert TimeLimits(NOW, 0, 7).bounds() == (NOW, first, NOW + 7)
    assert TimeLimits(NOW, 10**20, 10**20).bounds() == (NOW, first, last)


@pytest.mark.skipif(os.environ.get("NUMBA_DISABLE_JIT") == "1", reason="there are no kernels")
def test_no_message_needs_a_kernel_that_the_set_up_does_not_compile(source, read):
    """What is given to the kernels is of the types that they were compiled for."""
    read_poses()
    source.send(NOW + 1, a=1, b=2, c=3)
    source.send(NOW + 2, b=1)
    source.send(NOW + 3, b=math.nan)
    source.update()
    assert read == [True, True, False]
    graph = SceneGraph()
    graph.register_frame(graph.register_source("arm"), GeometryFrame("link"))
    world = World(graph)
    world.commit({"arm"}, None)
    for kernel in (are_valid, place_records, latest, poses_from_quaternions_kernel):
        assert len(kernel.signatures) == 1


def test_a_message_of_a_hundred_thousand_names_is_not_read(source, monkeypatch):
    """Its length alone tells that it is not about three frames; it is counted, others go on."""
    read = []
    monkeypatch.setattr(source.channel, "_deserialize", read.append)
    names = [f"stranger_{i}" for i in range(100_000)]
    flood = MultiDOFJointState(joint_names=names, transforms=[Transform()] * len(names))
    source.channel.store(serialize_message(flood), 1)
    source.send(NOW, a=1.0, b=2.0, c=3.0)
    assert source.update() is not None
    assert read == []
    assert source.intake.statistics.faults[Fault.MALFORMED] == 1
    (warning,) = source.warnings
    assert "bytes" in warning
    assert source.xs == {"a": 1.0, "b": 2.0, "c": 3.0}


def test_as_many_strangers_as_are_read_are_counted_and_few_warned_about(source):
    """Each is counted each time, and the log gets a hundred lines and one, once."""
    names = [f"stranger_{i}" for i in range(1000)]
    flood = MultiDOFJointState(
        joint_names=names,
        transforms=[Transform(rotation=Quaternion(w=1.0))] * len(names),
    )
    flood.header.stamp.sec = NOW // 10**9
    for _ in range(3):
        source.channel.store(serialize_message(flood), 1)
        source.update()
    assert source.intake.statistics.faults[Fault.UNKNOWN_FRAME] == 3000
    assert len(source.warnings) == 101
    assert "further faults are only counted" in source.warnings[-1]


def test_a_flood_of_long_messages_is_read_once_per_update(source):
    """Of messages with ever other names, each as long as one may be, only the newest is read."""
    for i in range(60):
        names = [f"stranger_{i}_{j}" for j in range(2500)]
        flood = MultiDOFJointState(joint_names=names, transforms=[Transform()] * len(names))
        source.channel.store(serialize_message(flood), 1)
    source.update()
    assert source.intake.statistics.superseded == 59
    assert source.intake.statistics.dropped == 2500
    source.send(NOW, a=1.0, b=2.0, c=3.0)
    assert source.update() is not None
