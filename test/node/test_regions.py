"""Regions as clients of the node ask for them: a ball of 0.2 m at 1 m comes into one and goes."""

from __future__ import annotations

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import Point
from node_harness import diagnostics_from_now
import numpy as np
import pytest
from rclpy.qos import DurabilityPolicy, QoSProfile
from scene_requests import transform
from sensor_msgs.msg import MultiDOFJointState
from spinning import wait_until
from visualization_msgs.msg import Marker, MarkerArray

from scene_graph_msgs.msg import GeometrySet, RegionArray, Status

TOPICS = ("/scene_graph/regions", "/scene_graph/markers/regions")
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
SCENE = """
version: 1
sources: [{name: s}]
frames: [{name: f, source: s, pose: {xyz: [1, 0, 0]}}]
geometries:
  - {name: ball, source: s, frame: f, shape: {type: sphere, radius: 0.2}}
"""


@pytest.fixture(scope="module")
def node(start_node, tmp_path_factory):
    """A node with the ball, which may write regions to a folder."""
    folder = tmp_path_factory.mktemp("regions")
    (folder / "scene.yaml").write_text(SCENE)
    parameters = {"regions_folder": folder, "diagnostics_rate": 20.0}
    return start_node({"scene": folder / "scene.yaml", **parameters})


@pytest.fixture(scope="module")
def put_ball(client, node):
    """Move the ball along x."""
    publisher = client.publisher(MultiDOFJointState, "/s/poses")

    def put(x):
        message = MultiDOFJointState(joint_names=["f"], transforms=[transform(x)])
        message.header.stamp = client.now()
        publisher.publish(message)

    return put


def grow(client, **fields):
    """Ask for a region around the origin, in a box of 2 m."""
    return client.call(
        "GrowRegion",
        domain_min=Point(x=-1.0, y=-1.0, z=-1.0),
        domain_max=Point(x=1.0, y=1.0, z=1.0),
        **fields,
    )


def effect(client, name):
    """Return what is said of an effect."""
    return next(e for e in client.call("ListEffects").effects if e.name == name)


def advertised(client):
    """Return the topics about regions that are there."""
    return {t for t, _ in client.node.get_topic_names_and_types() if t in TOPICS}


def test_regions_are_off_until_one_is_kept(client, node):
    """Growing one is a request; topics come with the first that has a name."""
    assert not effect(client, "regions").is_on
    assert not effect(client, "region_requests").is_on
    assert not advertised(client)
    answer = grow(client)
    assert answer.status.code == Status.OK, answer.status.message
    assert effect(client, "region_requests").is_on
    assert not effect(client, "regions").is_on
    assert not advertised(client)
    assert grow(client, name="middle").status.code == Status.OK
    wait_until(lambda: advertised(client) == {*TOPICS}, "both topics")
    report = effect(client, "regions")
    assert (report.is_on, report.reason) == (True, "1 region is kept")


def test_those_who_listen_are_told_when_something_moves_into_a_region(client, node, put_ball):
    """Free, cut by the ball, free again; the markers say the same."""
    regions = client.listen(RegionArray, TOPICS[0], LATCHED)
    markers = client.listen(MarkerArray, TOPICS[1], LATCHED)
    first = regions.wait_for(lambda m: list(m.outcomes) == [RegionArray.FREE], "a free region")
    assert [r.name for r in first.regions] == ["middle"]
    drawn = markers.wait_for(lambda m: len(m.markers) == 4, "its markers").markers
    faces, edges, words, dots = drawn
    assert (faces.type, edges.type) == (Marker.TRIANGLE_LIST, Marker.LINE_LIST)
    assert 0.0 < faces.color.a < 1.0
    assert (words.text, dots.action) == ("middle", Marker.DELETE)
    # Every corner that is drawn is on the region, and the triangles are closed: Euler.
    A = np.reshape(first.regions[0].a, (-1, 3))
    corners = np.array([[p.x, p.y, p.z] for p in faces.points])
    over = corners @ A.T - first.regions[0].b
    np.testing.assert_allclose(over.max(axis=1), 0.0, atol=1e-9)
    vertices, triangles = len({tuple(c) for c in corners.round(9).tolist()}), len(corners) // 3
    assert vertices - 3 * triangles // 2 + triangles == 2
    put_ball(0.3)
    cut = regions.wait_for(lambda m: list(m.outcomes) == [RegionArray.CUT], "the ball in it")
    assert list(cut.cuts.geometries.name) == ["ball"]
    red = markers.wait_for(lambda m: "cut by" in m.markers[2].text, "the reason").markers
    assert red[2].text == "middle: cut by s/f/ball"
    assert red[0].color.r > 0.8 > 0.2 > red[0].color.b
    assert (red[3].action, len(red[3].points)) == (Marker.ADD, 1)
    put_ball(1.0)
    regions.wait_for_newest(lambda m: list(m.outcomes) == [RegionArray.FREE], "a free region")
    client.forget(regions)
    client.forget(markers)


def test_diagnostics_tell_of_what_nobody_looked_at(client, node, put_ball):
    """Stale while the ball has moved and nobody asked; then what it is."""
    listener = client.listen(DiagnosticArray, "/diagnostics")

    def status():
        message = diagnostics_from_now(client, listener)
        return next(s for s in message.status if s.name.endswith("effect: regions"))

    put_ball(0.3)
    wait_until(lambda: "were not looked at" in status().message, "that it is not known")
    assert status().level == DiagnosticStatus.STALE
    assert list(client.call("CheckRegions").outcomes) == [RegionArray.CUT]
    wait_until(lambda: "s/f/ball reaches into middle" in status().message, "what is in it")
    put_ball(1.0)
    wait_until(lambda: "were not looked at" in status().message, "that it is not known")
    assert list(client.call("CheckRegions").outcomes) == [RegionArray.FREE]
    wait_until(lambda: status().level == DiagnosticStatus.OK, "that all is well")
    client.forget(listener)


def test_requests_that_mean_nothing_get_a_status(client, node):
    """A seed in the ball by its name; names; and the node goes on."""
    answer = grow(client, seed=Point(x=0.85))
    assert answer.status.code == Status.INVALID_ARGUMENT
    assert "50 mm deep in s/f/ball" in answer.status.message
    for code, fields in (
        (Status.NAME_CONFLICT, {"name": "middle"}),
        (Status.INVALID_ARGUMENT, {"seed": Point(x=float("nan"))}),
        (Status.UNKNOWN_NAME, {"ignored": GeometrySet(frames=["g"])}),
    ):
        answer = grow(client, **fields)
        assert answer.status.code == code, answer.status
    answer = client.call("CheckRegions", names=["midle"])
    assert answer.status.code == Status.UNKNOWN_NAME
    assert list(client.call("CheckRegions").outcomes) == [RegionArray.FREE]


def test_regions_go_to_a_file_and_come_back(client, node):
    """Removed they are gone, with their topics."""
    saved = client.call("SaveRegions", file="kept.yaml")
    assert saved.status.code == Status.OK, saved.status.message
    assert client.call("SaveRegions", file="kept.yaml").status.code == Status.NAME_CONFLICT
    markers = client.listen(MarkerArray, TOPICS[1], LATCHED)
    markers.wait_for(lambda m: len(m.markers) == 4, "its markers")
    assert list(client.call("RemoveRegions").names) == ["middle"]
    # Each message says it, as one may replace another.
    gone = markers.wait_for_newest(lambda m: m.markers[0].action == Marker.DELETE, "their end")
    assert {(m.ns, m.action) for m in gone.markers} == {("regions/middle", Marker.DELETE)}
    client.forget(markers)
    wait_until(lambda: not advertised(client), "the end of both topics")
    loaded = client.call("LoadRegions", resource=saved.path, prefix="again/")
    assert list(loaded.names) == ["again/middle"]
    assert list(client.call("CheckRegions").outcomes) == [RegionArray.FREE]
    wait_until(lambda: advertised(client) == {*TOPICS}, "both topics")
