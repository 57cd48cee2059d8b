"""What has to be reported before a plan: an arm of two joints with a hand, on a base that drives.

The hand's second finger follows the first, and the group "arm" has the elbow alone.
"""

from __future__ import annotations

import pytest

from msg_adapters.errors import MessageError, StaleError
from scene_graph_msgs.action import PlanPath
from scene_graph_msgs.msg import RobotConfigurations
from scene_graph_ros.geometry import SceneGraph
from scene_graph_ros.geometry.errors import UnknownIdError
from scene_graph_ros.node.world.inputs import message_type
from scene_graph_ros.node.world.reported_joints import require_reported
from scene_graph_ros.node.world.scenes import SceneLoader
from scene_graph_ros.node.world.world import World

BALL = "<collision><geometry><sphere radius='0.1'/></geometry></collision>"
LIMIT = "<axis xyz='0 0 1'/><limit lower='-1' upper='1' effort='1' velocity='1'/>"


def _joint(name: str, parent: str, kind: str = "revolute", more: str = "") -> str:
    """Return a joint that moves a ball."""
    return (
        f"<link name='{name}_link'>{BALL}</link><joint name='{name}' type='{kind}'>"
        f"<parent link='{parent}'/><child link='{name}_link'/><origin xyz='1 0 0'/>{LIMIT}{more}"
        "</joint>"
    )


URDF = (
    f"<robot name='arm'><link name='base'>{BALL}</link>{_joint('shoulder', 'base')}"
    + _joint("elbow", "shoulder_link")
    + _joint("finger", "elbow_link", "prismatic")
    + _joint("thumb", "elbow_link", "prismatic", "<mimic joint='finger'/>")
    + "</robot>"
)
SRDF = """<robot name="arm"><group name="arm"><joint name="elbow"/></group>
<group name="hand"><joint name="finger"/><joint name="thumb"/></group></robot>"""
SCENE = """version: 1
robots: [{name: r, urdf: arm.urdf, srdf: arm.srdf%s}]
"""
SECOND = 10**9
NOW = 100 * SECOND


def world_of(folder, base="") -> World:
    """Return a world with the robot, of which nothing was heard."""
    for name, text in (("arm.urdf", URDF), ("arm.srdf", SRDF), ("s.yaml", SCENE % base)):
        (folder / name).write_text(text)
    world, loader = World(SceneGraph()), SceneLoader("", message_type, ())
    world.edit(lambda edit: loader.load(edit, str(folder / "s.yaml")))
    return world


def reason(world: World, *, most=5.0, unreported=False, snapshot=None, **goal) -> str:
    """Return why a goal is stale, empty where it is not; by default of the newest snapshot."""
    snapshot = snapshot or world.snapshot
    robots = snapshot.robots.planning(snapshot.query.snapshot, snapshot.bases)
    limits = {"max_pose_age": most, "plan_from_unreported": unreported}
    try:
        require_reported(PlanPath.Goal(**goal), robots, snapshot, limits.__getitem__, NOW)
    except StaleError as error:
        return str(error)
    return ""


def report(world: World, *names: str, age: float = 0.0, is_static: bool = False) -> None:
    """Take note of joints as a message of them would have it done."""
    motion = world.records["r"].motion
    motion.stamped(names, NOW - round(age * SECOND), is_static=is_static)
    world.commit((), None)


def test_reports_that_come_after_the_snapshot_do_not_count(tmp_path):
    """The plan would begin where the robot was before them."""
    world = world_of(tmp_path)
    before = world.snapshot
    report(world, "elbow", "shoulder")
    assert reason(world, group="arm") == ""
    assert "r/elbow, r/shoulder." in reason(world, snapshot=before, group="arm")


def test_what_a_group_moves_and_stands_on_has_to_be_reported(tmp_path):
    """And nothing else: not what it carries."""
    world = world_of(tmp_path)
    assert "nobody has reported r/elbow, r/shoulder." in reason(world, group="arm")
    report(world, "elbow")
    assert "nobody has reported r/shoulder." in reason(world, group="arm")
    report(world, "shoulder")
    assert reason(world, group="arm") == ""
    assert "nobody has reported r/finger." in reason(world, group="hand")
    assert "nobody has reported r/finger." in reason(world)
    report(world, "finger")
    assert reason(world) == ""


def test_positions_of_the_start_need_no_report(tmp_path):
    """Of those that it leaves out the present ones count."""
    world = world_of(tmp_path)
    start = RobotConfigurations(names=["elbow", "r/shoulder"], positions=[0.0, 0.0])
    assert reason(world, group="arm", start=start) == ""
    start = RobotConfigurations(names=["elbow"], positions=[0.0])
    assert "r/shoulder." in reason(world, group="arm", start=start)


@pytest.mark.parametrize(
    ("age", "most", "max_state_age", "is_old"),
    [
        (4.9, 5.0, 0.0, False),
        (5.1, 5.0, 0.0, True),
        (5.1, 0.0, 0.0, False),  # 0 there: any age
        (0.3, 0.0, 0.2, True),
        (7.0, 5.0, 8.0, False),
        (1e3, 5.0, float("inf"), False),
    ],
)
def test_how_old_a_report_may_be(tmp_path, age, most, max_state_age, is_old):
    """As the goal says, else as poses may be; what was sent once for good is never old."""
    world = world_of(tmp_path)
    report(world, "shoulder", is_static=True, age=1e6)
    report(world, "elbow", age=age)
    said = reason(world, group="arm", most=most, max_state_age=max_state_age)
    assert (f"the last report of r/elbow {age:.1f} s ago" in said) == is_old
    assert bool(said) == is_old
    assert (
        reason(world, group="arm", most=most, max_state_age=max_state_age, unreported=True) == ""
    )


def test_a_base_that_drives_has_to_be_reported(tmp_path):
    """No start says where it is."""
    world = world_of(tmp_path, ", base: {topic: /odom}")
    start = RobotConfigurations(names=["elbow", "shoulder"], positions=[0.0, 0.0])
    assert "nobody has reported r's base." in reason(world, group="arm", start=start)
    report(world, "")
    assert reason(world, group="arm", start=start) == ""


def test_what_means_nothing_is_told_first(tmp_path):
    """An age below zero, also where plans may begin anywhere; a group that there is not."""
    world = world_of(tmp_path)
    for age in (-1.0, float("nan")):
        with pytest.raises(MessageError, match="max_state_age must be a number from 0"):
            reason(world, max_state_age=age, unreported=True)
    with pytest.raises(
        UnknownIdError, match=r"'amr'; did you mean 'arm'.* \(there are arm, hand\)"
    ):
        reason(world, group="amr")
