"""Regions of the world on request: grown, tested, kept, written and read.

A ball of 0.2 m is at 1 m along x on a frame, a wall's face at -2 along y.
"""

from __future__ import annotations

from geometry_msgs.msg import Point
import numpy as np
import pytest

from msg_adapters.errors import MessageError, TooLargeError, UnavailableError
from msg_adapters.queries import options_from_msg
from msg_adapters.regions import region_from_msg
from scene_graph_msgs import srv
from scene_graph_msgs.msg import (
    GeometryReference,
    GeometrySet,
    QueryOptions,
    Region,
    RegionArray,
    WhatIf,
)
from scene_graph_ros.geometry.errors import NameConflictError, UnknownIdError
from scene_graph_ros.geometry.optimization import (
    HPolyhedron,
    load_iris_regions_yaml_file,
    RegionTest,
)
from scene_graph_ros.node.effects.declarations import EFFECT_NAMES
from scene_graph_ros.node.runtime.parameters import defaults
from scene_graph_ros.node.services.queries import QUERIES, QueryScope
from scene_graph_ros.node.world.inputs import message_type
from scene_graph_ros.node.world.kept_regions import KeptRegions
from scene_graph_ros.node.world.scenes import SceneLoader
from scene_graph_ros.node.world.world import World

SCENE = """
version: 1
sources: [{name: s}]
frames: [{name: f, source: s, pose: {xyz: [1, 0, 0]}}]
geometries:
  - {name: ball, source: s, frame: f, shape: {type: sphere, radius: 0.2}}
  - {name: wall, source: s, pose: {xyz: [0, -2.5, 0]}, shape: {type: box, size: [9, 1, 9]}}
"""
CUT, FREE = RegionArray.CUT, RegionArray.FREE
ROOM = {"domain_min": Point(x=-3.0, y=-3.0, z=-3.0), "domain_max": Point(x=3.0, y=3.0, z=3.0)}


class Node:
    """A world with what keeps its regions."""

    def __init__(self, text=SCENE, **values):
        self.world = World()
        self.loader = SceneLoader("", message_type, EFFECT_NAMES)
        request = srv.LoadScene.Request(text=text)
        self.world.edit(lambda edit: self.loader.load_request(edit, request))
        self.counts = []
        self.regions = KeptRegions(lambda: self.world.snapshot, self.counts.append)
        self.values = {**defaults(), **values}

    def ask(self, service, /, **fields):
        """Return an answer; raises what it would be refused for."""
        kind = getattr(srv, service)
        request, response = kind.Request(**fields), kind.Response()
        snapshot = self.world.snapshot
        options = options_from_msg(fields.get("options", QueryOptions()), snapshot.names)
        scope = QueryScope(
            snapshot,
            options,
            self.values.__getitem__,
            regions=lambda: self.regions,
            text=self.loader.text,
        )
        QUERIES[service].handler(request, response, scope)
        return response

    def grow(self, x=0.0, y=0.0, z=0.0, **fields):
        """Return the answer to GrowRegion in the room."""
        return self.ask("GrowRegion", seed=Point(x=x, y=y, z=z), **{**ROOM, **fields})

    def put_ball(self, x):
        """Move the ball."""
        with self.world.lock:
            self.world.frames("s").X_PF[0, 0, 3] = x
            self.world.commit({"s"}, None)


@pytest.fixture
def node():
    """The ball and the wall."""
    return Node()


def ball_at(*xs):
    """Return options that ask about the ball elsewhere."""
    poses = [number for x in xs for number in (x, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)]
    return QueryOptions(what_if=WhatIf(frames=["f"], poses=poses))


def box(name, low, high):
    """Return a box as a region."""
    faces = HPolyhedron.make_box(low, high)
    return Region(name=name, a=faces.A.ravel().tolist(), b=faces.b.tolist())


def faces_of(region):
    """Return the polyhedron of a message."""
    return region_from_msg(region.a, region.b, "a", "b")


def test_a_region_grows_to_what_is_around_it(node):
    """The seed inside, the ball and the wall each beyond the face that is told."""
    answer = node.grow()
    region = faces_of(answer.region)
    assert region.point_in_set([0.0, 0.0, 0.0], 0.0)
    assert len(region.b) == 8
    assert answer.reason == "converged"
    assert answer.ellipsoid_volumes[-1] == max(answer.ellipsoid_volumes)
    names = dict(zip(answer.geometries.id, answer.geometries.name, strict=True))
    faces = {
        names[i]: face
        for i, face in zip(answer.separated_ids, answer.separating_faces, strict=True)
    }
    assert {*faces} == {"ball", "wall"}
    A, b = region.A, region.b
    # The wall's face is y = -2, the ball's least a . x is a . center - 0.2.
    np.testing.assert_allclose(A[faces["wall"]], [0.0, -1.0, 0.0], atol=1e-6)
    assert b[faces["wall"]] == pytest.approx(2.0, abs=1e-6)
    assert A[faces["ball"]] @ [1.0, 0.0, 0.0] - 0.2 - b[faces["ball"]] >= 0.0


def test_what_is_asked_about_may_be_elsewhere_and_ignored(node):
    """Free in all configurations; without the ball the room is cut by the wall alone."""
    region = faces_of(node.grow(options=ball_at(1.0, 1.0, -1.0)).region)
    for x in (1.0, -1.0):
        touched = [x - 0.2, 0.0, 0.0], [x + 0.2, 0.0, 0.0]
        assert not region.point_in_set(np.array(touched), 0.0).any()
    answer = node.grow(options=ball_at(1.0, 1.0, -1.0))
    assert len(answer.separated_ids) == 3
    answer = node.grow(ignored=GeometrySet(frames=["f"]))
    assert len(faces_of(answer.region).b) == 7
    assert list(answer.geometries.name) == ["wall"]


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ({"x": 0.9}, r"100 mm deep in s/f/ball"),
        ({"y": -2.1}, r"100 mm deep in s/world/wall"),
        ({"x": 0.8}, r"s/f/ball"),
        ({"x": 5.0}, r"seed.x 5.0 is outside the domain, from -3.0 to 3.0"),
        ({"x": float("nan")}, r"seed.x must be a number"),
        ({"domain_max": Point(x=float("inf"), y=1.0, z=1.0)}, r"domain_max.x must be a number"),
        ({"domain_max": Point(y=1.0, z=1.0), "x": 0.5}, r"outside the domain, from -3.0 to 0.0"),
        ({"domain_min": Point(x=4.0)}, r"domain_max.x 3.0 must be more than domain_min.x 4.0"),
        ({"domain_a": [1.0, 0.0, 0.0]}, r"domain_a has 1 normals, domain_b has 0"),
        ({"domain_a": [1.0, 0.0, 0.0], "domain_b": [-1.0]}, r"outside the domain, by its face 0"),
        ({"domain_a": [0.0] * 3, "domain_b": [1.0]}, r"domain_a: normal 0 must not be 0"),
        ({"iteration_limit": 0}, r"iteration_limit must be at least 1"),
        ({"time_limit": -1.0}, r"time_limit must be a number from 0 on"),
        ({"termination_threshold": float("nan")}, r"termination_threshold must be a number"),
    ],
)
def test_what_can_not_grow_is_refused(node, fields, words):
    """With the field and its value; a seed in a geometry with its name and how deep that is."""
    with pytest.raises(MessageError, match=words):
        node.grow(**fields)


def test_requests_over_the_limits_are_too_large():
    """Faces, regions, and regions times geometries."""
    node = Node(max_faces_per_region=8, max_regions=1, max_pairs_per_request=5)
    with pytest.raises(TooLargeError, match="max_faces_per_region, which is 8"):
        node.grow(domain_a=[1.0, 0.0, 0.0] * 3, domain_b=[9.0] * 3)
    node.grow(name="one")
    with pytest.raises(TooLargeError, match="max_regions, which is 1"):
        node.grow(name="two")
    with pytest.raises(TooLargeError, match="max_pairs_per_request, which is 5"):
        node.ask("CheckRegions", options=ball_at(0.0, 1.0, 2.0))
    with pytest.raises(TooLargeError, match="max_pairs_per_request, which is 5"):
        node.grow(options=ball_at(0.0, 1.0, 2.0))


def test_time_ends_growing(node):
    """After the first region, which is a region all the same."""
    answer = node.grow(time_limit=1e-9)
    assert answer.reason == "time"
    assert len(answer.ellipsoid_volumes) == 1


def test_regions_are_tested_where_things_are_or_may_be(node):
    """Which geometry is in, how far the nearest face is from it, and a point of both."""
    cube = box("cube", [-1.0] * 3, [1.0] * 3)
    answer = node.ask("CheckRegions", regions=[cube], options=ball_at(0.9, 1.1, 1.3))
    assert list(answer.names) == ["cube"]
    assert list(answer.outcomes) == [CUT, CUT, FREE]
    assert list(answer.cuts.row) == [0, 1]
    np.testing.assert_allclose(answer.cuts.depth, [0.3, 0.1], atol=1e-12)
    assert list(answer.cuts.geometries.name) == ["ball"]
    for point, x in zip(np.reshape(answer.cuts.points, (-1, 3)), (0.9, 1.1), strict=True):
        assert np.linalg.norm(point - [x, 0.0, 0.0]) <= 0.2 + 1e-12
        assert np.abs(point).max() <= 1.0 + 1e-12
    ignored = GeometrySet(geometries=[GeometryReference(name="ball")])
    answer = node.ask("CheckRegions", regions=[cube], ignored=ignored)
    assert list(answer.outcomes) == [FREE]


def test_kept_regions_are_looked_at_again_when_something_has_moved(node):
    """Free as grown, cut when the ball comes, free again; and told stale meanwhile."""
    node.grow(name="left")
    node.grow(name="all", ignored=GeometrySet(frames=["f"]))
    assert node.counts == [1, 2]
    assert "2 regions were not looked at" in node.regions.stale()
    assert list(node.ask("CheckRegions").outcomes) == [FREE, FREE]
    assert node.regions.stale() == ""
    before = node.regions.follow(node.world.snapshot).revision
    node.put_ball(0.5)
    assert "regions were not looked at" in node.regions.stale()
    answer = node.ask("CheckRegions")
    assert (list(answer.names), list(answer.outcomes)) == (["all", "left"], [FREE, CUT])
    assert list(answer.cuts.row) == [1]
    assert "1 of 2 regions are not free: s/f/ball reaches into left" in node.regions.stale()
    assert node.regions.follow(node.world.snapshot).revision > before
    assert list(node.ask("CheckRegions", names=["left"]).outcomes) == [CUT]
    node.put_ball(1.0)
    assert list(node.ask("CheckRegions").outcomes) == [FREE, FREE]


def test_only_what_moved_is_looked_at_again(node, monkeypatch):
    """And nothing where nothing has."""
    node.grow(name="left")
    node.regions.follow(node.world.snapshot)
    asked, cuts = [], RegionTest.cuts

    def noted(test, query, **options):
        asked.append(options["among"])
        return cuts(test, query, **options)

    monkeypatch.setattr(RegionTest, "cuts", noted)
    node.regions.follow(node.world.snapshot)
    assert asked == []
    node.put_ball(0.5)
    node.regions.follow(node.world.snapshot)
    inspector = node.world.snapshot.inspector
    assert [{inspector.get_name(g) for g in among} for among in asked] == [{"ball"}]


def test_new_and_removed_geometry_counts(node):
    """A scene that is loaded puts a box into the region, and its source goes again."""
    node.grow(name="left")
    assert list(node.ask("CheckRegions").outcomes) == [FREE]
    more = """
version: 1
sources: [{name: t}]
geometries: [{name: box, source: t, pose: {xyz: [0, 0, 0]}, shape: {type: box, size: [1, 1, 1]}}]
"""
    request = srv.LoadScene.Request(text=more)
    node.world.edit(lambda edit: node.loader.load_request(edit, request))
    answer = node.ask("CheckRegions")
    assert list(answer.outcomes) == [CUT]
    assert list(answer.cuts.geometries.name) == ["box"]

    def remove(edit):
        edit.scene_graph.remove_source(edit.records.pop("t").id)

    node.world.edit(remove)
    assert list(node.ask("CheckRegions").outcomes) == [FREE]


def test_regions_are_written_and_read_as_they_were(node, tmp_path):
    """As text, in a file, below a key, and by the core's own reader."""
    grown = faces_of(node.grow(name="a").region)
    node.grow(name="ö b", y=1.0)
    node.values["regions_folder"] = str(tmp_path)
    answer = node.ask("SaveRegions", file="some.yaml", child_name="all")
    assert answer.path == str(tmp_path / "some.yaml")
    assert (tmp_path / "some.yaml").read_text() == answer.text
    assert [path.name for path in tmp_path.iterdir()] == ["some.yaml"]
    read = load_iris_regions_yaml_file(answer.path, "all")
    assert read["a"].A.tobytes() == grown.A.tobytes()
    assert list(node.ask("RemoveRegions").names) == ["a", "ö b"]
    assert node.counts[-1] == 0
    for fields in ({"text": answer.text}, {"resource": answer.path, "prefix": "p "}):
        node.ask("LoadRegions", child_name="all", **fields)
    assert list(node.ask("CheckRegions").names) == ["a", "p a", "p ö b", "ö b"]
    kept = node.regions.named(["p a"])[0].region
    assert (kept.A.tobytes(), kept.b.tobytes()) == (grown.A.tobytes(), grown.b.tobytes())


def test_files_are_written_into_the_folder_alone(node, tmp_path):
    """By plain names, whole, and not over others unless asked to; without a folder nowhere."""
    node.grow(name="a")
    with pytest.raises(UnavailableError, match="regions_folder names no folder"):
        node.ask("SaveRegions", file="a.yaml")
    node.values["regions_folder"] = str(tmp_path / "in")
    with pytest.raises(UnavailableError, match="No such file"):
        node.ask("SaveRegions", file="a.yaml")
    (tmp_path / "in").mkdir()
    for bad in ("../a.yaml", "/a.yaml", ".a.yaml", "a", "b/a.yaml", "a\n.yaml", "\0.yaml"):
        with pytest.raises(MessageError, match="file must be the name"):
            node.ask("SaveRegions", file=bad)
    node.ask("SaveRegions", file="a.yaml")
    with pytest.raises(NameConflictError, match="there already"):
        node.ask("SaveRegions", file="a.yaml")
    node.ask("SaveRegions", file="a.yaml", replace=True)
    assert [path.name for path in tmp_path.rglob("*")] == ["in", "a.yaml"]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("a: {A: [[1, 0, 0]], b: [1]}", "'a' is unbounded: add the faces of a box"),
        ("a: {A: [[1, 0, 0], [-1, 0, 0]], b: [1, -2]}", "'a' is empty"),
        ("a: {A: [[1], [-1]], b: [1, 1]}", "'a' has 1 dimensions"),
        ("a: {A: [[.nan, 0, 0]], b: [1]}", "a"),
        ("a: 3", "a has no 'A'"),
        ("[" * 500, "nested more than 100 deep"),
        ("", "either resource or text"),
    ],
)
def test_what_is_no_region_is_not_loaded(node, text, words):
    """All or nothing, with the entry named."""
    good = "z: {A: [[1, 0, 0], [0, 1, 0], [0, 0, 1], [-1, -1, -1]], b: [1, 1, 1, 0]}\n"
    with pytest.raises(ValueError, match=words):
        node.ask("LoadRegions", text=good * text.startswith("a") + text)
    assert node.counts == []


def test_names_are_known_or_taken(node):
    """Of regions, with what may be meant."""
    node.grow(name="shelf")
    with pytest.raises(NameConflictError, match="there is a region 'shelf' already"):
        node.grow(name="shelf")
    node.grow(name="shelf", replace=True)
    with pytest.raises(UnknownIdError, match="no region is called 'shelv'; did you mean 'shelf'"):
        node.ask("CheckRegions", names=["shelv"])
    with pytest.raises(NameConflictError, match="name of a region"):
        node.grow(name="a\nb")
