"""A Panda that pages drag by its hand, plan for and move: over real sockets and DDS."""

from __future__ import annotations

import re
import subprocess
import sys

from browser_page import PageClient
from geometry_msgs.msg import Quaternion, Transform, Vector3
from node_harness import wait_until
import numpy as np
from plan_goals import Planner, Sent
import pytest
from sensor_msgs.msg import MultiDOFJointState
from trajectory_robot import TrajectoryRobot

from msg_adapters.stamps import stamp_from_msg
from msg_adapters.trajectories import joint_trajectory_from_msg
from scene_graph_msgs.action import PlanPath
from scene_graph_msgs.msg import PoseGoal
from scene_graph_ros.geometry.spatial.poses import inverse, poses_from_quaternions
from scene_graph_ros.planning import load_robot_diagram, SceneGraphCollisionChecker

CELL = "config/scenes/panda_cell.yaml"
NAMES = (*(f"panda_joint{k}" for k in range(1, 8)), "panda_finger_joint1")
START = [0.0, -0.4, 0.0, -2.0, 0.0, 1.6, 0.8, 0.02]
PARAMETERS = {
    "scene": CELL,
    "browser": True,
    "browser_port": 0,
    "browser_token": "secret",
    "browser_control": True,
    "browser_execute": True,
    "max_trajectory_points": 40,
}


def address_of(node):
    """Return the page's address."""
    node.wait_for_output("browser view at ")
    return re.search(r"browser view at (http[^,\s]+)", node.output())[1]


@pytest.fixture(scope="module")
def node(start_node):
    """A node whose pages may do all."""
    return start_node(PARAMETERS)


@pytest.fixture(scope="module")
def robot(client, node):
    """The robot."""
    robot = TrajectoryRobot(client, NAMES, START)
    yield robot
    robot.close()


@pytest.fixture(scope="module")
def model():
    """The same cell, apart from the node."""
    return load_robot_diagram(CELL)


class Page(PageClient):
    """A page with the token."""

    def __init__(self, node):
        super().__init__(address_of(node), query="?token=secret")
        self.wish(["illustration"])
        self._number = 0

    def until(self, condition):
        """Take messages until the motion is so; return the last reason."""
        self.take_until(lambda: condition(self.motion))
        return self.motion

    def hold(self, link="panda_hand", group=""):
        """Hold a link; return the answer, also if there is only a reason."""
        self.motion = {}
        self.ask("hold", robot="panda", link=link, group=group)
        self._number = 0
        return self.until(lambda m: m.get("held") or m.get("reason"))

    def drag(self, position, rotation):
        """Drag it; return the answer."""
        self._number += 1
        self.motion = {**self.motion, "reason": ""}
        self.ask("drag", number=self._number, position=list(position), rotation=list(rotation))
        return self.until(lambda m: m.get("number") == self._number or m.get("reason"))

    def refusal(self, motion, **fields):
        """Ask for something that can't be; return why."""
        self.motion = {**self.motion, "reason": ""}
        self.ask(motion, **fields)
        return self.until(lambda m: m.get("reason"))["reason"]


@pytest.fixture
def page(node, robot):
    """A page; the robot has been heard, and rests."""
    page = Page(node)
    page.take_until(lambda: page.items)
    yield page
    page.close()


def pose_of(told):
    """Return the pose in an answer."""
    return pose(told["position"], told["rotation"])


def pose(position, rotation):
    """Return a pose."""
    q = np.array([rotation], dtype=np.float64)
    return poses_from_quaternions([position], q / np.linalg.norm(q))[0]


def hand_of(robot, model):
    """Return where the robot's hand is."""
    q = model.tree.zero_configuration()
    q[[model.tree.position_index(name) for name in NAMES]] = robot.q
    return model.tree.link_poses(q, ["panda_hand"])[0][:3, 3]


def at_rest(page, robot, model):
    """Hold the hand of a robot that rests, as the node has heard by then; return the answer."""

    def held():
        rests = not robot.gaps or robot.gaps[-1] == 0.0
        told = page.hold()
        is_there = rests and told.get("held") and not told["executing"]
        near = is_there and np.allclose(told["position"], hand_of(robot, model), atol=1e-6)
        return near and told

    return wait_until(held, "the hand of a robot that rests")


def test_the_robot_follows_its_hand(page):
    """A ghost of what the arm carries, the hand rigidly with its link; told to 1e-9."""
    held = page.hold()
    assert held["group"] == "panda/arm" and held["groups"][0] == "panda/arm"
    assert not held["has_moved"] and held["collisions"] == []
    hands = [i for i in page.items.values() if i["path"][2].endswith("panda_hand")]
    hand = hands[0]["geometry"]
    before = inverse(pose_of(held)) @ pose(*(part[0] for part in page.ghost[hand]))
    x, y, z = held["position"]
    for k in range(1, 6):
        told = page.drag((x, y + 0.04 * k, z - 0.03 * k), held["rotation"])
        assert told["is_reached"] and told["reason"] == "", told
        np.testing.assert_allclose(told["position"], (x, y + 0.04 * k, z - 0.03 * k), atol=1e-9)
        after = inverse(pose_of(told)) @ pose(*(part[0] for part in page.ghost[hand]))
        np.testing.assert_allclose(after, before, atol=1e-6)
    bases = {i["geometry"] for i in page.items.values() if i["path"][2].endswith("panda_link0")}
    assert bases and not bases & page.ghost.keys()


def test_what_would_collide_is_told(page):
    """In the table: the hand and it, with the depth; red are the hand's looks, too."""
    held = page.hold()
    told = page.drag((0.5, 0.0, 0.48), (1.0, 0.0, 0.0, 0.0))
    pairs = {frozenset((one, other)): depth for one, other, depth in told["collisions"]}
    table = page.named("table_top")["geometry"]
    depth = pairs[frozenset(("cell/world/table_top", "panda/panda_hand/panda_hand_collision_0"))]
    assert 0.0 < depth < 0.2
    assert list(pairs.values()) == sorted(pairs.values(), reverse=True)
    looks = [i["geometry"] for i in page.items.values() if i["path"][2].endswith("panda_hand")]
    assert {table, *looks} <= set(told["colliding"])
    assert "would overlap by" in page.refusal("plan", scaling=1.0, replaces=False)
    told = page.drag(held["position"], held["rotation"])
    assert told["collisions"] == [] and told["colliding"] == []


def test_the_nearest_is_shown_of_what_is_out_of_reach(page):
    """Five metres away it stretches, and says by how much it falls short."""
    held = page.hold()
    told = page.drag((5.0, 0.0, 0.8), held["rotation"])
    assert not told["is_reached"] and 3.5 < told["position_error"] < 4.5
    assert told["position"][0] > 0.6


@pytest.mark.parametrize(
    "fields",
    [
        {"number": 1, "position": [1e308, 0, 0], "rotation": [0, 0, 0, 1]},
        {"number": 1, "position": [0, 0, 0], "rotation": [0, 0, 0, 0]},
        {"number": 1, "position": [0, -1e13, 0], "rotation": [1, 0, 0, 0]},
    ],
)
def test_poses_that_nothing_has_are_refused(page, fields):
    """Naming the value; the next drag is followed."""
    held = page.hold()
    assert re.search("coordinate beyond|no quaternion", page.refusal("drag", **fields))
    page.motion["reason"] = ""
    page._number = 1
    told = page.drag(held["position"], [1e300 * each for each in held["rotation"]])
    assert told["is_reached"]


@pytest.mark.parametrize(
    ("link", "group", "words"),
    [
        ("no_hand", "", "no robot has a link 'panda/no_hand'"),
        ("panda_link0", "", "no joint of group .*carries link|no joint carries link"),
        ("panda_hand", "legs", "no robot has a group 'legs'"),
        ("panda_link1", "hand", "no joint of group 'panda/hand' carries link"),
    ],
)
def test_names_that_are_not_there_are_told(page, link, group, words):
    """And nothing is held then."""
    told = page.hold(link, group)
    assert re.search(words, told["reason"]) and told["held"] is None
    assert page.refusal("drag", number=1, position=[0, 0, 1], rotation=[0, 0, 0, 1])


@pytest.mark.parametrize(
    "text",
    [
        '{"motion": "fly"}',
        '{"motion": ["hold"]}',
        '{"motion": "hold", "robot": "panda", "link": "panda_hand"}',
        '{"motion": "drag", "number": 1, "position": [0, 0, NaN], "rotation": [0, 0, 0, 1]}',
        '{"motion": "drag", "number": 1, "position": [0, 0], "rotation": [0, 0, 0, 1]}',
        '{"motion": "drag", "number": -1, "position": [0, 0, 0], "rotation": [0, 0, 0, 1]}',
        '{"motion": "plan", "scaling": 0, "replaces": false}',
        '{"motion": "plan", "scaling": 1e999, "replaces": false}',
        '{"motion": "execute", "plan": 1.5}',
        '{"motion": "execute", "plan": true}',
    ],
)
def test_rubbish_ends_the_connection(page, text):
    """With its reason; the node goes on, as the other tests show."""
    page.socket.send(text)
    code, reason = page.wait_closed()
    assert code == 1008 and reason


def test_without_a_link_there_is_nothing_to_ask_for(page):
    """Each request is told so."""
    for motion, fields in (
        ("drag", {"number": 1, "position": [0, 0, 1], "rotation": [0, 0, 0, 1]}),
        ("plan", {"scaling": 1.0, "replaces": False}),
        ("execute", {"plan": 1}),
    ):
        assert page.refusal(motion, **fields) == "no link is held"


def planned(page, position, rotation, scaling=0.5):
    """Drag the hand somewhere, and have a motion planned."""
    assert page.drag(position, rotation)["collisions"] == []
    page.ask("plan", scaling=scaling, replaces=False)
    page.take_until(lambda: page.plan["plan"] or page.motion["reason"])
    assert page.plan["plan"], page.motion["reason"]
    return page.plan


def test_a_motion_is_planned_shown_and_executed(page, robot, model):
    """Proven, to be played, published in at most `max_trajectory_points`; the robot gets there.

    None of 200 configurations of what was published collides.
    """
    held = at_rest(page, robot, model)
    x, y, z = held["position"]
    goal = (x, y + 0.3, z - 0.15)
    plan = planned(page, goal, held["rotation"])
    times = np.array(plan["times"])
    assert times[0] == 0.0 and times[-1] == plan["duration"] and (np.diff(times) > 0.0).all()
    assert len(plan["way"]) == len(plan["proven"]) + 1
    np.testing.assert_allclose(plan["way"][0], held["position"], atol=1e-3)
    np.testing.assert_allclose(plan["way"][-1], goal, atol=1e-6)
    assert 0.0 < plan["least_clearance"] < 0.1 and min(plan["proven"]) > 0.0
    assert all(len(positions) == len(times) for positions, _ in page.played.values())
    before = robot.heard.count
    assert "there is no plan" in page.refusal("execute", plan=plan["plan"] + 1)
    page.ask("execute", plan=plan["plan"])
    wait_until(lambda: robot.heard.count > before, "the trajectory")
    page.until(lambda m: m["executing"])
    # On a machine that is busy it may have ended by then.
    reason = page.refusal("execute", plan=plan["plan"])
    assert re.match("another motion is executed|the motion begins with", reason)
    names, points = joint_trajectory_from_msg(robot.heard.newest)
    assert len(points.nanoseconds) <= PARAMETERS["max_trajectory_points"]
    assert points.accelerations is not None
    curve, tree = points.trajectory(), model.tree
    q = np.tile(robot.q, (200, 1))
    q[:, :7] = curve.value(np.linspace(curve.start_time, curve.end_time, 200))
    assert names == NAMES[:7]
    full = np.tile(tree.zero_configuration(), (200, 1))
    full[:, [tree.position_index(name) for name in NAMES]] = q
    assert SceneGraphCollisionChecker(model).check_configs_collision_free(full).all()
    page.until(lambda m: not m["executing"])
    assert robot.heard.count == before + 1
    end = tree.link_poses(full[-1], ["panda_hand"])[0]
    np.testing.assert_allclose(end[:3, 3], goal, atol=1e-6)
    wait_until(lambda: np.abs(robot.q - q[-1]).max() < 1e-9, "the robot's arrival")


def test_a_motion_is_replaced_on_its_way(page, robot, model):
    """It goes on from the old one without a step, and leads to where the hand was dragged."""
    held = at_rest(page, robot, model)
    x, y, z = held["position"]
    plan = planned(page, (x, y - 0.5, z), held["rotation"], 0.2)
    count = robot.heard.count
    page.ask("execute", plan=plan["plan"])
    wait_until(lambda: robot.heard.count > count, "the trajectory")
    old = robot.heard.newest
    goal = (x, y - 0.2, z + 0.1)
    assert page.drag(goal, held["rotation"])["collisions"] == []
    robot.gaps.clear()
    page.plan = {"plan": 0}
    page.ask("plan", scaling=0.5, replaces=True)
    page.take_until(lambda: page.plan["plan"] or page.motion["reason"])
    assert page.motion["reason"] == ""
    # It is there to be played, and one that is cancelled then is not executed.
    assert 0.0 < page.plan["within"] < 3.0
    page.ask("cancel")
    page.take_until(lambda: not page.plan["plan"])
    assert robot.heard.count == count + 1
    page.ask("plan", scaling=0.5, replaces=True)
    page.take_until(lambda: page.plan["plan"] or page.motion["reason"])
    assert page.motion["reason"] == ""
    page.ask("execute", plan=page.plan["plan"])
    page.until(lambda m: m["reason"] or robot.heard.count > count + 1)
    assert page.motion["reason"] == ""
    new = robot.heard.newest
    assert new.joint_names == old.joint_names
    assert len(new.points) <= PARAMETERS["max_trajectory_points"]
    old_start, start = (stamp_from_msg(each.header.stamp) for each in (old, new))
    curves = [joint_trajectory_from_msg(each)[1].trajectory() for each in (old, new)]
    shift = (start - old_start) * 1e-9
    same = [
        t
        for t in np.linspace(0.0, curves[1].end_time, 400)
        if t + shift <= curves[0].end_time
        and np.abs(curves[1].value(t) - curves[0].value(t + shift)).max() < 1e-7
    ]
    # They are one until they part for good.
    assert max(same) > 0.3 and len(same) == np.searchsorted(
        np.linspace(0.0, curves[1].end_time, 400), max(same), side="right"
    )
    page.until(lambda m: not m["executing"])
    wait_until(lambda: len(robot.gaps) > 20 and robot.gaps[-1] == 0.0, "rest")
    np.testing.assert_allclose(hand_of(robot, model), goal, atol=1e-6)
    assert "no motion is executed" in (
        page.drag((x, y - 0.1, z), held["rotation"])
        and page.refusal("plan", scaling=0.5, replaces=True)
    )


def test_what_has_come_into_the_way_stops_a_motion(page, robot, model, client):
    """Between plan and execution a ball comes: it is not executed, and the page is told why."""
    held = at_rest(page, robot, model)
    x, y, z = held["position"]
    plan = planned(page, (x, y + 0.3, z), held["rotation"])
    objects = client.publisher(MultiDOFJointState, "/objects/poses")
    wait_until(objects.get_subscription_count, "the node")

    def put(point):
        moved = Transform(
            translation=Vector3(**dict(zip("xyz", map(float, point), strict=True))),
            rotation=Quaternion(w=1.0),
        )
        message = MultiDOFJointState(joint_names=["ball"], transforms=[moved])
        message.header.stamp = client.now()
        objects.publish(message)
        page.take_until(lambda: np.allclose(page.position("ball"), point, atol=1e-9))

    put(plan["way"][25])
    before = robot.heard.count
    reason = page.refusal("execute", plan=plan["plan"])
    assert "not free any more" in reason and "objects/ball/ball" in reason
    put((0.62, 0.32, 0.53))
    page.motion["reason"] = ""
    assert robot.heard.count == before
    client.destroy(objects)


def test_one_goal_a_page_and_no_more_than_may_wait(page, client, node, robot):
    """While clients' goals are worked on and wait, a page is told that there are too many."""
    planner = Planner(client)
    far = PoseGoal(link="panda_hand")
    far.pose.position.x = 9.0
    goals = [Sent(planner, pose_goals=[far] * 1000, group="arm") for _ in range(9)]
    goals[0].wait_for(PlanPath.Feedback.CHECKING)
    held = page.hold()
    x, y, z = held["position"]
    page.drag((x, y, z - 0.05), held["rotation"])
    reason = page.refusal("plan", scaling=1.0, replaces=False)
    assert "8 goals wait for their turn already, and max_waiting_plans is 8" in reason
    goals[8].cancel()
    page.motion["reason"] = ""
    page.ask("plan", scaling=1.0, replaces=False)
    page.until(lambda m: m["planning"] == "waiting for its turn")
    assert "one at a time for each page" in page.refusal("plan", scaling=1.0, replaces=False)
    page.ask("cancel")
    told = page.until(lambda m: not m["planning"])
    assert "cancelled" in told["reason"]
    # A page that leaves takes its goal with it.
    page.motion["reason"] = ""
    page.ask("plan", scaling=1.0, replaces=False)
    page.until(lambda m: m["planning"] == "waiting for its turn")
    page.close()
    for goal in goals[:8]:
        goal.cancel()
        goal.end()
    result, _ = Sent(planner, pose_goals=[far], group="arm").end()
    assert result.failure == PlanPath.Result.GOAL_UNREACHED
    planner.destroy()


def test_pages_may_do_only_what_parameters_let_them(start_node, client):
    """Without `browser_execute` no topic, and the page is told; without control it is cut off."""
    asked = {**PARAMETERS, "browser_execute": False}
    node = start_node(asked, remaps=["__node:=shy", "joint_states:=elsewhere"])
    page = Page(node)
    page.take_until(lambda: page.items)
    assert page.scenes[-1]["draggable"][0]["executes"] is False
    page.hold()
    assert "browser_execute is false" in page.refusal("execute", plan=1)
    assert "/shy/trajectory" not in client.topics()
    page.close()
    assert node.stop() == 0
    node = start_node(
        {"browser": True, "browser_port": 0, "browser_token": "secret"}, remaps=["__node:=mute"]
    )
    page = Page(node)
    page.take()
    page.ask("hold", robot="panda", link="panda_hand", group="")
    assert page.wait_closed() == (1008, "robots can't be moved here")
    page.close()
    assert node.stop() == 0


def test_planning_comes_with_the_first_link():
    """What is imported for a page that may move robots has none of it."""
    code = (
        "import sys, scene_graph_ros.node.effects.page_motions as motions;"
        "import scene_graph_ros.node.effects.page_execution;"
        "print(*sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    names = done.stdout.split()
    assert "scene_graph_ros.node.effects.page_session" in names
    unwanted = ("scene_graph_ros.planning", "scene_graph_ros.node.effects.page_work", "casadi")
    assert [name for name in names if name.startswith(unwanted)] == []
