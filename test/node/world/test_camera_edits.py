"""Cameras come and go by requests: who may, on which frames, all of them or none. No DDS."""

from __future__ import annotations

from copy import deepcopy
import re

from geometry_msgs.msg import Quaternion
import numpy as np
import pytest
from scene_requests import camera

from msg_adapters.queries import NO_OPTIONS
from msg_adapters.status import status_from_exception
from scene_graph_msgs.msg import RendererDescription, SourceHandle, Status
import scene_graph_msgs.srv
from scene_graph_ros.geometry.errors import SceneGraphError
from scene_graph_ros.geometry.perception import ImageKind
from scene_graph_ros.node.effects.camera_frame import CameraFrame
from scene_graph_ros.node.effects.declarations import EFFECT_NAMES
from scene_graph_ros.node.services.queries import QUERIES, QueryScope
from scene_graph_ros.node.world.edits import EDITS, Tools
from scene_graph_ros.node.world.inputs import message_type
from scene_graph_ros.node.world.scenes import SceneLoader
from scene_graph_ros.node.world.world import World

SCENE = """
version: 1
sources: [{name: arm}, {name: cell}]
frames: [{name: hand, source: arm, pose: {xyz: [0.1, 0, 0]}}, {name: rail, source: cell}]
geometries:
  - {name: ball, source: cell, pose: {xyz: [0, 0, 2]}, shape: {type: sphere, radius: 0.5}}
cameras:
  - name: eye
    source: arm
    frame: hand
    pose: {xyz: [0, 0.1, 0], rpy: [0.1, 0.2, 0.3]}
    size: [16, 12]
    fov_y: 1.1
    depth_range: [0.5, 4]
    images: [points, depth]
    rate: 12.5
  - {name: still, source: cell, size: [8, 6], intrinsics: {fx: 6, fy: 7, cx: 3, cy: 2}}
"""


class Clients:
    """A world, and the sources of its scene with their tokens."""

    def __init__(self):
        self.world, loader = World(), SceneLoader("", message_type, EFFECT_NAMES)
        self._tools = Tools(loader.resolve, message_type, loader.load_request, loader.text)
        self.sources = {s.name: s for s in self.edit("LoadScene", text=SCENE).sources}

    def edit(self, name, **fields):
        """Return the response of a service that changes the scene, or raise."""
        service = getattr(scene_graph_msgs.srv, name)
        request, response = service.Request(**fields), service.Response()
        self.world.edit(lambda edit: EDITS[name](request, response, edit, self._tools))
        return response

    def register(self, source, *cameras):
        """Register cameras of a source."""
        self.bring(source, (), *cameras)

    def bring(self, source, renderers, *cameras):
        """Register cameras of a source, with renderers (name, type, parameters)."""
        told = [RendererDescription(name=n, type=t, parameters=p) for n, t, p in renderers]
        fields = {"source": self.sources[source], "cameras": list(cameras)}
        self.edit("RegisterCamera", renderers=told, **fields)

    def remove(self, source, *names):
        """Remove cameras of a source."""
        self.edit("RemoveCamera", source=self.sources[source], cameras=list(names))

    def described(self, **fields):
        """Return what DescribeScene tells of cameras."""
        service = scene_graph_msgs.srv.DescribeScene
        response = service.Response()
        scope = QueryScope(self.world.snapshot, NO_OPTIONS, lambda name: 10**9)
        QUERIES["DescribeScene"].handler(service.Request(**fields), response, scope)
        return response.cameras

    def renderers(self):
        """Return what DescribeScene tells of renderers, by name."""
        service = scene_graph_msgs.srv.DescribeScene
        response = service.Response()
        scope = QueryScope(self.world.snapshot, NO_OPTIONS, lambda name: 10**9)
        QUERIES["DescribeScene"].handler(service.Request(), response, scope)
        return {each.name: each for each in response.renderers}

    def refusal(self, action, *arguments):
        """Return the status of what is refused; the scene is as it was."""
        before = self.world.snapshot
        with pytest.raises(SceneGraphError) as caught:
            action(*arguments)
        assert self.world.snapshot is before
        return status_from_exception(caught.value)


@pytest.fixture
def clients():
    """A world with two sources, and a camera of each."""
    return Clients()


def test_cameras_are_told_by_name_and_by_source(clients):
    """Those of the scene file and those of requests, sorted; frames by bare name."""
    clients.register("cell", camera("a", "rail"), camera("z"))
    assert [c.camera.name for c in clients.described()] == ["a", "eye", "still", "z"]
    told = {c.camera.name: c for c in clients.described(source="cell")}
    assert {n: c.camera.description.frame for n, c in told.items()} == {
        "a": "rail",
        "still": "world",
        "z": "world",
    }
    assert {c.source for c in told.values()} == {"cell"}


def test_a_camera_of_a_scene_file_goes_through_messages(clients):
    """Removed and registered as it was told, it is told the same, and sees the same.

    Its rotation is a matrix between two quaternions, which costs an ulp or two.
    """

    def sees(name):
        snapshot = clients.world.snapshot
        frame = CameraFrame(snapshot.cameras[name], snapshot)
        frame.render(frozenset(ImageKind))
        return frame.images

    def without_rotations(told):
        told = deepcopy(told)
        for each in told:
            each.camera.description.pose.orientation = Quaternion()
        return told

    def rotations(told):
        given = [each.camera.description.pose.orientation for each in told]
        return [[q.x, q.y, q.z, q.w] for q in given]

    before, seen = clients.described(), {name: sees(name) for name in ("eye", "still")}
    assert (before[0].camera.rate, before[0].camera.images) == (12.5, ["depth", "points"])
    for told in before:
        clients.remove(told.source, told.camera.name)
    assert clients.described() == []
    for told in before:
        clients.register(told.source, told.camera)
    after = clients.described()
    assert without_rotations(after) == without_rotations(before)
    np.testing.assert_allclose(rotations(after), rotations(before), rtol=0.0, atol=1e-15)
    for name, images in seen.items():
        assert np.isfinite(images.depth).any()
        np.testing.assert_allclose(sees(name).depth, images.depth, rtol=1e-6)
        np.testing.assert_array_equal(sees(name).label, images.label)


def test_the_first_camera_brings_the_renderer():
    """Where no scene file had one."""
    world = World()
    handle = SourceHandle(token=1)

    def register(edit):
        handle.name = edit.add_source("late", token=1).name
        service = scene_graph_msgs.srv.RegisterCamera
        request = service.Request(source=handle, cameras=[camera("eye")])
        EDITS["RegisterCamera"](request, service.Response(), edit, None)

    assert world.snapshot.query.get_render_engine_by_name("exact") is None
    world.edit(register)
    snapshot = world.snapshot
    frame = CameraFrame(snapshot.cameras["eye"], snapshot)
    frame.render(frozenset({ImageKind.DEPTH}))
    np.testing.assert_array_equal(frame.images.depth, np.full((3, 4), np.inf, np.float32))


@pytest.mark.parametrize(
    ("source", "wanted", "code", "words"),
    [
        ("arm", camera("eye"), Status.NAME_CONFLICT, "a camera named 'eye' already"),
        ("cell", camera("eye"), Status.NAME_CONFLICT, "a camera named 'eye' already"),
        ("arm", camera("b", "hnad"), Status.UNKNOWN_NAME, "'arm' has no frame 'hnad'"),
        ("arm", camera("b", "rail"), Status.UNKNOWN_NAME, "'arm' has no frame 'rail'"),
        ("arm", camera("b", "arm/hand"), Status.UNKNOWN_NAME, "no frame 'arm/hand'"),
        ("arm", camera("b c"), Status.INVALID_ARGUMENT, "'b c'"),
        ("arm", camera("b", width=0), Status.INVALID_ARGUMENT, "camera 'b': .* width"),
        ("arm", camera("b", rate=0.0), Status.INVALID_ARGUMENT, "camera 'b': rate"),
        ("arm", camera("b", images=()), Status.INVALID_ARGUMENT, "camera 'b': outputs"),
    ],
)
def test_one_refused_camera_refuses_the_request(clients, source, wanted, code, words):
    """With the rule of scene files and the name of what is wrong; the good one is not there."""
    status = clients.refusal(clients.register, source, camera("good"), wanted)
    assert status.code == code
    assert re.search(words, status.message), status.message


def test_two_of_one_name_in_a_request_are_refused(clients):
    """As one after the other would be."""
    status = clients.refusal(clients.register, "arm", camera("twin"), camera("twin"))
    assert status.code == Status.NAME_CONFLICT


def test_only_its_source_removes_a_camera(clients):
    """The others get NOT_OWNER, and all of a request stay."""
    clients.register("cell", camera("a"))
    status = clients.refusal(clients.remove, "cell", "a", "eye")
    assert (status.code, "'eye' is of source 'arm'" in status.message) == (Status.NOT_OWNER, True)
    status = clients.refusal(clients.remove, "cell", "a", "nobody")
    assert (status.code, "'nobody'" in status.message) == (Status.UNKNOWN_NAME, True)
    clients.sources["cell"].token += 1
    for action in (clients.register, clients.remove):
        assert clients.refusal(action, "cell").code == Status.NOT_OWNER
    clients.sources["cell"].token -= 1
    clients.remove("cell", "a", "still", "a")
    assert [c.camera.name for c in clients.described()] == ["eye"]


STUDIO = """
version: 1
sources: [{name: film}]
renderers: [{name: white, type: exact, default_clear_color: [1, 1, 1]}]
cameras: [{name: lens, source: film, size: [4, 3], fov_y: 1, renderer: white, images: [color]}]
"""


def test_a_camera_chooses_a_renderer_of_its_scene(clients):
    """By its name; one that a request registers has the default one."""

    def color(name):
        snapshot = clients.world.snapshot
        frame = CameraFrame(snapshot.cameras[name], snapshot)
        frame.render(frozenset({ImageKind.COLOR}))
        return frame.images.color

    clients.sources["film"] = clients.edit("LoadScene", text=STUDIO).sources[0]
    clients.register("film", camera("second"))
    # The ball is in the middle; in the corners nothing is, and the sky is the renderer's.
    assert (color("lens")[0, 0] == 255).all()
    assert color("second")[0, 0].tolist() == [204, 229, 255, 255]
    snapshot = clients.world.snapshot
    response = scene_graph_msgs.srv.RenderImages.Response()
    request = scene_graph_msgs.srv.RenderImages.Request(camera="lens", images=["color"])
    scope = QueryScope(snapshot, NO_OPTIONS, lambda name: 10**9)
    QUERIES["RenderImages"].handler(request, response, scope)
    assert bytes(response.color[0].data[:3]) == b"\xff\xff\xff"


def test_a_request_names_no_render_server(clients):
    """Only the scene that the node starts with has it ask one."""
    text = STUDIO.replace("type: exact, default_clear_color: [1, 1, 1]", "type: gltf_client")
    status = clients.refusal(lambda: clients.edit("LoadScene", text=text))
    assert status.code == Status.INVALID_ARGUMENT
    assert "renderers: white: the node asks a render server only where" in status.message


LIGHT = "lights: [{type: point, position: [0, 0, 1], intensity: 2, frame: world}]"


def test_a_camera_brings_its_renderer_along(clients):
    """It is told with all its parameters; described so again it is the same, and is shared."""
    parameters = f"samples: 4\n{LIGHT}\ndefault_diffuse: [0.5, 0.25, 1]"
    clients.bring("cell", [("soft", "traced", parameters)], camera("a", renderer="soft"))
    assert [c.camera.renderer for c in clients.described()] == ["soft", "exact", "exact"]
    told = clients.renderers()
    assert set(told) == {"exact", "soft"}
    assert told["exact"].type == "exact"
    assert "samples: 4\n" in told["soft"].parameters
    assert "default_diffuse: [0.5, 0.25, 1.0, 1.0]\n" in told["soft"].parameters
    same = (told["soft"].name, told["soft"].type, told["soft"].parameters)
    clients.bring("arm", [same], camera("b", renderer="soft"))
    assert clients.renderers() == told
    refused = clients.refusal(
        clients.bring, "arm", [("soft", "traced", "samples: 5")], camera("c", renderer="soft")
    )
    assert refused.code == Status.NAME_CONFLICT
    assert "another renderer named 'soft'" in refused.message


def test_a_renderer_that_was_brought_goes_with_its_last_camera(clients):
    """Or with the source of that; one that no camera has does not come."""
    soft = ("soft", "exact", "default_clear_color: [1, 0, 0]")
    clients.bring("cell", [soft, ("idle", "exact", "")], camera("a", renderer="soft"))
    clients.register("arm", camera("b", renderer="soft"))
    assert set(clients.renderers()) == {"exact", "soft"}
    clients.remove("cell", "a")
    assert set(clients.renderers()) == {"exact", "soft"}
    clients.edit("RemoveSource", source=clients.sources["arm"])
    assert set(clients.renderers()) == {"exact"}


@pytest.mark.parametrize(
    ("kind", "parameters", "code", "reason"),
    [
        ("fast", "", Status.INVALID_ARGUMENT, r"renderers\[0\].type must be .*, not 'fast'"),
        ("", "", Status.INVALID_ARGUMENT, "must be 'exact' or 'traced', not ''"),
        (
            "gltf_client",
            "",
            Status.INVALID_ARGUMENT,
            "only where the scene says so that it starts",
        ),
        (
            "exact",
            "samples: 4",
            Status.INVALID_ARGUMENT,
            r"renderers\[0\].parameters:1: samples: u",
        ),
        (
            "traced",
            "seed: 1\nsamples: 0",
            Status.INVALID_ARGUMENT,
            "parameters:2: samples: must be",
        ),
        ("traced", "samples: 257", Status.INVALID_ARGUMENT, "samples is 257, .* 256 at most"),
        ("traced", "max_depth: 17", Status.INVALID_ARGUMENT, "max_depth is 17, .* 16 at most"),
        ("exact", "type: traced", Status.INVALID_ARGUMENT, "type: is no parameter, but a field"),
        ("exact", "[1]", Status.INVALID_ARGUMENT, "parameters: must be a mapping of parameters"),
        ("exact", "a: b: c", Status.INVALID_ARGUMENT, "parameters:1: not YAML"),
        (
            "exact",
            "default_diffuse: [2, 0, 0]",
            Status.INVALID_ARGUMENT,
            "must be at most 1, got 2",
        ),
    ],
)
def test_what_no_request_may_bring(clients, kind, parameters, code, reason):
    """Field, line, name and value are told, and the scene is as it was."""
    refused = clients.refusal(clients.bring, "cell", [("r", kind, parameters)], camera("a"))
    assert refused.code == code, refused.message
    assert re.search(reason, refused.message), refused.message


def test_a_camera_names_a_renderer_that_there_is(clients):
    """With the name that may have been meant."""
    refused = clients.refusal(clients.register, "cell", camera("a", renderer="exakt"))
    assert refused.code == Status.UNKNOWN_NAME
    assert refused.message.startswith("camera 'a': there is no renderer 'exakt'")
    assert "exact" in refused.message
