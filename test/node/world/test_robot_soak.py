"""Robots for a long time, with messages jittered, reordered, duplicated and lost.

Each update is compared with what the newest of all messages that arrived say, joint by joint.
"""

from __future__ import annotations

import math
import random

import numpy as np
import pytest
from rclpy.serialization import serialize_message
from robot_inputs import LIMITS, MS, NOW, ODOMETRY, odometry, Robot, TWO
from searching import times
from sensor_msgs.msg import JointState

from msg_adapters.stamps import stamp_to_msg
from scene_graph_ros.node.world.faults import Fault
from scene_graph_ros.node.world.inputs import BASE_POSES, POSES
from scene_graph_ros.node.world.source_channel import apply_kept
from scene_graph_ros.node.world.tf_tree import MissingTransformError, TfTree

SENDERS = {("arm_j",): -20, ("grip_j",): 0, ("grip_j", "arm_j"): -5, (): -50}
"""Joints that each sender names, none for the base, and by how many ms its stamps are late."""


def delivered(rng, messages):
    """Return messages as a bad network has them: some lost, some twice, some late."""
    arriving = [
        (i + rng.choice([0.0, 0.0, 0.0, 2.5, 6.5]), message)
        for i, message in enumerate(messages)
        for _ in range(rng.choice([0, 1, 1, 1, 1, 2]))
    ]
    return [message for _, message in sorted(arriving, key=lambda each: each[0])]


def sent(rng, count):
    """Return what all senders send: names, values and a stamp with jitter."""
    messages = []
    for k in range(count):
        for names, late in SENDERS.items():
            stamp = NOW - 2000 * MS + 10 * k * MS + late * MS + rng.randrange(-3 * MS, 3 * MS)
            values = [rng.uniform(-1.0, 1.0) for _ in names or ("base",)]
            messages.append((names or ("base",), values, stamp))
    return messages


@pytest.mark.search
@pytest.mark.parametrize("seed", range(3))
def test_poses_are_those_of_the_newest_of_each_joint(tmp_path, seed):
    """In updates of one to eight messages at once, whoever sent them."""
    rng = random.Random(seed)
    robot = Robot(tmp_path, TWO, keys=ODOMETRY)
    newest = {"arm_j": (-math.inf, 0.0), "grip_j": (-math.inf, 0.0), "base": (-math.inf, 0.0)}
    waiting = delivered(rng, sent(rng, times(40)))
    while waiting:
        now, waiting = waiting[: (n := rng.randint(1, 8))], waiting[n:]
        for names, values, stamp in now:
            for name, value in zip(names, values, strict=True):
                if stamp >= newest[name][0]:
                    newest[name] = stamp, value
            if names == ("base",):
                noun, message = BASE_POSES, odometry(stamp, values[0])
            else:
                noun = POSES
                message = JointState(name=list(names), position=values)
                message.header.stamp = stamp_to_msg(stamp)
            robot.channel(noun).store(serialize_message(message), 1)
        with robot.world.lock:
            for noun in (POSES, BASE_POSES):
                apply_kept(
                    robot.channel(noun), robot.record, lambda: robot.world.frames("r"), LIMITS
                )
            robot.world.commit(["r"], None)
        (_, arm), (_, grip), (_, x) = newest.values()
        p = [x + math.cos(arm), math.sin(arm)]
        np.testing.assert_allclose(robot.where("grip")[:3, 3], [*p, grip], atol=1e-12)
        np.testing.assert_allclose(robot.where("other")[:3, 3], [*p, -grip], atol=1e-12)
        stamps = [stamp for stamp, _ in newest.values()]
        if min(stamps) > -math.inf:
            assert robot.world.snapshot.source_stamp("r") == min(stamps)
    faults = {**robot.faults(), **robot.faults(BASE_POSES)}
    assert set(faults) == {Fault.OUT_OF_ORDER}


@pytest.mark.search
@pytest.mark.parametrize("seed", range(3))
def test_chains_of_transforms_are_those_of_one_time(seed):
    """All moves along lines, so what is interpolated is exact, whichever samples were lost."""
    rng, tree = random.Random(seed), TfTree()
    speeds = {"odom": ("map", 1e-3, 50), "base": ("odom", -3e-3, 10), "hand": ("base", 7e-3, 4)}
    messages = sorted(
        (k * period + rng.randrange(period), frame)
        for frame, (_, _, period) in speeds.items()
        for k in range(times(4000) // period)
    )
    newest = dict.fromkeys(speeds, -1)
    placed = 0
    for stamp, frame in delivered(rng, messages):
        parent, speed, _ = speeds[frame]
        X = np.eye(4)
        X[0, 3] = speed * stamp
        tree.put(frame, parent, X, stamp, is_static=False)
        newest[frame] = max(newest[frame], stamp)
        try:
            X_MH, time = tree.place("hand", "map")
        except MissingTransformError:
            continue
        placed += 1
        assert time == min(newest.values())
        assert X_MH[0, 3] == pytest.approx(5e-3 * time, abs=1e-9)
    assert placed > 500
