"""A camera's points over DDS: distances, checks, plans and markers follow; faults are counted.

The ball of 0.1 m on its rail along x is that of `sliding_robots`; the post is out of its way.
"""

from __future__ import annotations

from cloud_messages import cloud_message
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from node_harness import diagnostics_from_now, diagnostics_values, wait_until
from plan_goals import at, Planner, Sent
import pytest
from scene_requests import reference
from sensor_msgs.msg import PointCloud2
from sliding_robots import rail_scene
from visualization_msgs.msg import Marker, MarkerArray

from scene_graph_msgs.msg import (
    ContactArray,
    GeometryDescription,
    PlanHolds,
    RoleProperties,
    Shape,
    Status,
)
from scene_graph_msgs.srv import CheckConfigurations

FREE, COLLIDES = CheckConfigurations.Response.FREE, CheckConfigurations.Response.COLLIDES

RADIUS = 0.0625
"""Of the cloud's balls."""

CLOUD = f"""
  - {{name: seen, source: camera, shape: {{type: point_cloud, radius: {RADIUS}}},
     roles: {{proximity: {{}}, illustration: {{}}}}}}
"""


@pytest.fixture(scope="module")
def node(start_node, tmp_path_factory):
    """A node with the ball on a rail and a camera; clouds of 1000 points at most."""
    scene = rail_scene(tmp_path_factory.mktemp("rails"), more=CLOUD)
    text = scene.read_text().replace("[{name: around}]", "[{name: around}, {name: camera}]")
    scene.write_text(text.replace("xyz: [1, 0, 0]", "xyz: [0, 7, 0]"))
    options = {"plan_from_unreported": True, "max_points_per_cloud": 1000}
    return start_node({"scene": scene, "diagnostics_rate": 20.0, "max_pose_age": 5.0, **options})


@pytest.fixture(scope="module")
def look(client, node):
    """Return a function that publishes what the camera sees now, and returns its stamp."""
    publisher = client.publisher(PointCloud2, "/camera/points")

    def send(points, frame_id="world", **fields):
        message = cloud_message(points, frame_id)
        for name, value in fields.items():
            setattr(message, name, value)
        message.header.stamp = client.now()
        publisher.publish(message)
        return message.header.stamp

    return send


@pytest.fixture(scope="module")
def diagnostics(client, node):
    """What the node says about itself."""
    listener = client.listen(DiagnosticArray, "/diagnostics")
    yield listener
    client.forget(listener)


def distance(client):
    """Return the distance of the ball and the cloud, None where it has no points."""
    pair = {"geometries_a": ["ball_collision_0"], "geometries_b": ["seen"]}
    answer = client.call("ComputeSignedDistancePair", **pair)
    assert answer.status.code == Status.OK, answer.status
    (found,) = answer.pairs
    if "has no points" in found.status.message:
        return None
    assert found.status.code == Status.OK, found.status
    return found.distance


def wait_for_distance(client, expected):
    """Wait until the ball and the cloud are so far from each other."""
    close = pytest.approx(expected, abs=1e-9)
    wait_until(lambda: distance(client) == close, f"a distance of {expected}")


def outcomes(client, *rails):
    """Return the outcomes of the ball's places on its rail."""
    answer = client.call("CheckConfigurations", configurations=at(*rails))
    assert answer.status.code == Status.OK, answer.status
    return list(answer.outcomes)


def faults(client, diagnostics):
    """Return what is said of the camera's points by now."""
    return diagnostics_values(diagnostics_from_now(client, diagnostics), "source camera points")


def test_distances_and_checks_follow_the_points(client, node, look):
    """The ball at -1: of points on the rail the nearest decides, in the frame they are in."""
    assert outcomes(client, 0.5) == [FREE]
    look([[0.5, 0.0, 0.0], [2.0, 0.0, 0.0], [float("nan")] * 3])
    wait_for_distance(client, 1.5 - 0.1 - RADIUS)
    # Free up to 0.1 + RADIUS from 0.5.
    assert outcomes(client, 0.3, 0.35, 0.5, 0.7) == [FREE, COLLIDES, COLLIDES, FREE]
    edges = client.call("CheckEdges", ends=at(-1.0, 0.3, 0.3, 0.7))
    assert list(edges.outcomes) == [edges.FREE, edges.COLLIDES]
    # The post's frame is at (0, 7, 0).
    look([[0.0, -7.0, 0.0]], "around/post")
    wait_for_distance(client, 1.0 - 0.1 - RADIUS)
    look([])
    wait_until(lambda: distance(client) is None, "no points")
    assert outcomes(client, 0.5) == [FREE]


def test_contacts_and_markers_have_the_points(client, node, look):
    """A point in the ball: as deep as their radii together; its marker is where it is."""
    contacts = client.listen(ContactArray, "contacts")
    markers = client.listen(MarkerArray, "markers/illustration")
    look([[-1.0, 0.0, 0.125], [4.0, 0.0, 0.0]])
    message = contacts.wait_for(lambda m: m.points, "a contact")
    assert message.points[0].depth == pytest.approx(0.1 + RADIUS - 0.125, abs=1e-9)
    seen = markers.wait_for(
        lambda m: any(len(x.points) == 2 for x in m.markers), "the cloud's marker"
    )
    (marker,) = [x for x in seen.markers if x.type == Marker.SPHERE_LIST and x.points]
    assert [(p.x, p.z) for p in marker.points] == [(-1.0, 0.125), (4.0, 0.0)]
    client.forget(contacts)
    client.forget(markers)


def test_a_plan_is_looked_at_again_when_the_cloud_changes(client, node, look):
    """A way that was free has a point in it, and then none again; an edit changes nothing."""
    look([[3.0, 0.0, 0.0]])
    wait_for_distance(client, 4.0 - 0.1 - RADIUS)
    planner = Planner(client)
    result, _ = Sent(planner, start=at(-1.0), goals=at(2.0)).end()
    assert (result.status.code, result.failure) == (Status.OK, 0), result.status.message
    holds = client.listen(PlanHolds, "plan_holds")
    holds.wait_for(lambda m: m.holds, "that the plan holds")
    look([[0.5, 0.0, 0.0]])
    stopped = holds.wait_for(lambda m: not m.holds, "that it holds no more")
    assert {stopped.geometry_a.name, stopped.geometry_b.name} == {"ball_collision_0", "seen"}
    # The goal is in the point by now, which is said at once.
    result, _ = Sent(planner, start=at(-1.0), goals=at(0.5)).end()
    assert (result.status.code, result.failure != 0) == (Status.OK, True), result.status
    look([[3.0, 0.0, 0.0]])
    holds.wait_for(lambda m: m.holds, "that it holds again")
    planner.destroy()
    client.forget(holds)


def test_an_edit_of_the_scene_keeps_the_points(client, node, look):
    """Of a cloud that a request brings, too, once it is there."""
    look([[1.0, 0.0, 0.0]])
    wait_for_distance(client, 2.0 - 0.1 - RADIUS)
    source = client.call("RegisterSource", name="second", token=5).source
    cloud = GeometryDescription(
        name="late",
        shape=Shape(kind=Shape.POINT_CLOUD, dimensions=[0.25]),
        roles=[RoleProperties(role=RoleProperties.PROXIMITY)],
    )
    cloud.pose.orientation.w = 1.0
    answer = client.call("RegisterAnchoredGeometry", source=source, geometries=[cloud])
    assert answer.status.code == Status.OK, answer.status
    assert distance(client) == pytest.approx(2.0 - 0.1 - RADIUS, abs=1e-9)
    publisher = client.publisher(PointCloud2, "/second/points")
    message = cloud_message([[-0.5, 0.0, 0.0]])
    message.header.stamp = client.now()
    publisher.publish(message)
    wait_until(lambda: outcomes(client, -0.75) == [COLLIDES], "the second camera's point")
    assert outcomes(client, -1.0) == [FREE]
    removed = client.call("RemoveSource", source=source)
    assert removed.status.code == Status.OK, removed.status
    assert outcomes(client, -0.75) == [FREE]
    assert distance(client) == pytest.approx(2.0 - 0.1 - RADIUS, abs=1e-9)


@pytest.mark.parametrize(
    ("fault", "points", "fields"),
    [
        ("malformed", [[1, 2, 3]], {"frame_id": ""}),
        ("malformed", [[1, 2, 3]], {"point_step": 8}),
        ("malformed", [[1, 2, 3]], {"fields": []}),
        ("unknown_frame", [[1, 2, 3]], {"frame_id": "odom"}),
        ("too_large", [[1, 2, 3]] * 1001, {}),
        ("too_large", [[1, 2, 3]] * 33_000, {}),
    ],
)
def test_faults_are_counted_and_change_nothing(
    client, node, look, diagnostics, fault, points, fields
):
    """The points before hold, and the node goes on."""
    look([[0.0, 0.0, 0.0]])
    wait_for_distance(client, 1.0 - 0.1 - RADIUS)
    before = int(faults(client, diagnostics)[fault])
    look(points, **fields)
    wait_until(lambda: int(faults(client, diagnostics)[fault]) == before + 1, f"one more {fault}")
    assert distance(client) == pytest.approx(1.0 - 0.1 - RADIUS, abs=1e-9)


def test_a_camera_that_stops_makes_its_source_stale(client, node, look, diagnostics):
    """The points hold, and the diagnostics say how old they are."""
    look([[0.0, 0.0, 0.0]])
    values = faults(client, diagnostics)
    assert values["topic"] == "/camera/points"
    message = diagnostics.wait_for(
        lambda m: any(
            status.name.endswith("source camera points") and status.level == DiagnosticStatus.STALE
            for status in m.status
        ),
        "a stale camera",
    )
    (status,) = [s for s in message.status if s.name.endswith("source camera points")]
    assert status.message.startswith("no points for ")
    assert distance(client) == pytest.approx(1.0 - 0.1 - RADIUS, abs=1e-9)
    answer = client.call("GetPoseInWorld", geometries=[reference("seen")])
    assert answer.status.code == Status.OK, answer.status


def test_the_node_survived_all_of_it(client, node):
    """After all this the node lives, and has no internal error on record."""
    assert node.is_alive()
    assert "Traceback" not in node.output()
