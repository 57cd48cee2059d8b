"""Requests with odd fields: a status that says why, and nothing has changed where refused."""

from __future__ import annotations

import atexit
import dataclasses
from functools import cache
import math
import os
from pathlib import Path
import random
import shutil
import tempfile
from typing import Any
from unittest.mock import Mock

from builtin_interfaces.msg import Time
from fuzzing import BAD_NUMBERS, BAD_TEXTS, fuzz, Target
from geometry_msgs.msg import Point
import numpy as np
import pytest
from robot_scenes import SLIDE
from scene_requests import camera, pose, sphere

from scene_graph_msgs.action import PlanPath
from scene_graph_msgs.msg import (
    CollisionFilterStatement,
    DeformableGeometryDescription,
    FrameDescription,
    GeometryReference,
    GeometrySet,
    MotionLimits,
    Property,
    QueryOptions,
    Region,
    RendererDescription,
    RobotConfigurations,
    RoleProperties,
    SourceHandle,
    Status,
    WhatIf,
)
import scene_graph_msgs.srv
from scene_graph_ros.geometry import SceneGraph
from scene_graph_ros.node.effects.declarations import EFFECT_NAMES
from scene_graph_ros.node.runtime.goals import Goal
from scene_graph_ros.node.runtime.parameters import PARAMETERS
from scene_graph_ros.node.services.plan_action import PlanAction
from scene_graph_ros.node.services.queries import QUERIES
from scene_graph_ros.node.services.request_counts import RequestCounts
from scene_graph_ros.node.services.services import Services
from scene_graph_ros.node.world.edits import EDITS, Tools
from scene_graph_ros.node.world.inputs import message_type
from scene_graph_ros.node.world.scenes import SceneLoader
from scene_graph_ros.node.world.world import World
from scene_graph_ros.scene_files import load_scene_text

ROBOT = """
version: 1
name: r
robots: [{name: slide, urdf: %s}]
"""
SCENE = """
version: 1
name: s
sources: [{name: arm}, {name: table}]
frames:
  - {name: base, source: arm}
  - {name: hand, source: arm, parent: base}
  - {name: cup, source: arm}
geometries:
  - {name: ball, source: arm, frame: base, shape: {type: sphere, radius: 0.4}}
  - {name: box, source: arm, frame: hand, shape: {type: box, size: [0.5, 0.6, 0.7]}}
  - {name: floor, source: table, shape: {type: half_space}}
cameras:
  - {name: eye, source: arm, frame: hand, size: [4, 3], fov_y: 1, images: [depth]}
"""
TOKEN = 7
LIMITS = {
    "max_rows_per_response": 1000,
    "max_points_per_request": 1000,
    "max_pixels_per_request": 1000,
    "max_planning_time": 0.05,
}
OWNER = SourceHandle(name="arm", token=TOKEN)
BALL, BOX = GeometryReference(name="ball"), GeometryReference(name="box")
CUBE_NORMALS = [float(v) for v in np.concatenate([np.eye(3), -np.eye(3)]).ravel()]
KEPT = "kept: {A: [[1, 0, 0], [0, 1, 0], [0, 0, 1], [-1, -1, -1]], b: [9, 9, 9, -26]}"
WHAT_IF = WhatIf(frames=["base"], poses=[0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0])

VALID: dict[str, dict[str, Any]] = {
    "ApplyCollisionFilter": {
        "source": OWNER,
        "statements": [
            CollisionFilterStatement(
                operation=1, a=GeometrySet(geometries=[BALL]), b=GeometrySet(frames=["hand"])
            )
        ],
        "is_transient": True,
    },
    "AssignRole": {
        "source": OWNER,
        "geometries": [BALL],
        "role": RoleProperties(
            role=1, properties=[Property(group="a", name="b", type=2, doubles=[1.0])]
        ),
        "assign": 1,
    },
    "AttachFrame": {
        "source": OWNER,
        "frame": "hand",
        "link": "slide/ball",
        "touch_links": ["ball"],
        "with_pose": True,
        "pose": pose(x=0.5),
    },
    "CheckClearance": {
        "configurations": RobotConfigurations(names=["rail"], positions=[0.0, 1.0]),
        "influence_distance": 2.0,
        "with_jacobians": True,
    },
    "CheckConfigurations": {
        "configurations": RobotConfigurations(names=["rail"], positions=[0.0, 1.0]),
        "environment_padding": 0.01,
        "with_collisions": True,
    },
    "CheckEdges": {
        "ends": RobotConfigurations(names=["slide/rail"], positions=[0.0, 1.0]),
        "options": QueryOptions(what_if=WHAT_IF),
        "with_measures": True,
    },
    "CheckRegions": {
        "options": QueryOptions(what_if=WHAT_IF),
        "names": ["kept"],
        "regions": [Region(name="cube", a=CUBE_NORMALS, b=[1.0] * 6)],
    },
    "ComputePointPairPenetration": {"options": QueryOptions(what_if=WHAT_IF)},
    "ComputeSignedDistancePair": {"geometries_a": ["ball"], "geometries_b": ["box"]},
    "ComputeSignedDistancePairwise": {"max_distance": [1.0]},
    "ComputeSignedDistanceToPoint": {"points": [0.1, 0.2, 0.3], "threshold": [1.0]},
    "DetachFrame": {"source": OWNER, "frame": "cup"},
    "DescribeScene": {"with_shapes": True, "with_properties": True},
    "FindCollisionCandidates": {},
    "GetDeformableConfigurations": {},
    "GetPoseInWorld": {"frames": ["base"], "geometries": [BALL]},
    "GrowRegion": {
        "seed": Point(x=2.0, z=1.0),
        "domain_min": Point(x=1.0, y=-1.0, z=-1.0),
        "domain_max": Point(x=3.0, y=1.0, z=2.0),
        "domain_a": [1.0, 1.0, 0.0],
        "domain_b": [3.5],
        "ignored": GeometrySet(geometries=[BALL]),
        "name": "grown",
    },
    "HasCollisions": {},
    "IsCollisionFiltered": {"a": [BALL], "b": [BOX]},
    "LoadScene": {"text": SCENE.replace("arm", "leg").replace("table", "desk"), "prefix": "p_"},
    "LoadRegions": {
        "text": "a: {A: [[1, 0, 0], [0, 1, 0], [0, 0, 1], [-1, -1, -1]], b: [1, 1, 1, 0]}",
        "prefix": "p_",
    },
    "PlanPath": {
        "goals": RobotConfigurations(names=["rail"], positions=[3.0]),
        "with_trajectory": True,
        "limits": MotionLimits(names=["rail"], max_velocities=[1.0], max_acceleration=2.0),
    },
    "SetPadding": {
        "source": OWNER,
        "frames_a": ["cup", "cup"],
        "frames_b": ["base", "world"],
        "paddings": [0.02, -0.01],
    },
    "RegisterAnchoredGeometry": {
        "source": OWNER,
        "geometries": [sphere("lamp", at=pose(x=1.0))],
    },
    "RegisterCamera": {
        "source": OWNER,
        "cameras": [camera("nose", "hand", renderer="red")],
        "renderers": [
            RendererDescription(name="red", type="exact", parameters="default_diffuse: [1, 0, 0]")
        ],
    },
    "RegisterDeformableGeometry": {
        "source": OWNER,
        "geometries": [
            DeformableGeometryDescription(geometry=sphere("soft"), resolution_hint=[0.3])
        ],
    },
    "RegisterFrame": {"source": OWNER, "frames": [FrameDescription(name="tip", pose=pose())]},
    "RegisterGeometry": {
        "source": OWNER,
        "frame": "hand",
        "geometries": [sphere("knob", at=pose(x=0.1))],
    },
    "RegisterSource": {"name": "third", "token": 3},
    "RemoveCamera": {"source": OWNER, "cameras": ["eye"]},
    "RemoveCollisionFilter": {"source": OWNER, "filter_id": 1},
    "RemoveFrame": {"source": OWNER, "frames": ["hand"]},
    "RemoveGeometry": {"source": OWNER, "geometries": [BOX]},
    "RemoveRole": {"source": OWNER, "geometries": [BALL], "role": 1},
    "RemoveSource": {"source": OWNER},
    "RemoveRegions": {"names": ["kept"]},
    "RenderImages": {
        "camera": "eye",
        "images": ["color", "depth", "label"],
        "renderer": RendererDescription(type="exact", parameters="default_diffuse: [1, 0, 0]"),
    },
    "SaveRegions": {"names": ["kept"], "child_name": "all"},
}
"""A good request of each type, but those that are about surfaces: their kernels take minutes."""

LEFT_OUT = {"ComputeContactSurfaces", "ComputeDeformableContact"}

INTEGERS = (0, 1, 2, 3, 7, 8, 100, 255, -1, -(2**31), 2**31 - 1, 2**32 - 1, -(2**63), 2**63 - 1)
RANGES = {
    "boolean": (0, 1),
    "octet": (0, 255),
    "uint8": (0, 255),
    "int32": (-(2**31), 2**31 - 1),
    "uint32": (0, 2**32 - 1),
    "int64": (-(2**63), 2**63 - 1),
    "uint64": (0, 2**64 - 1),
}


class Host:
    """What the node is to its services, without one."""

    def __init__(self) -> None:
        self.node = self
        self.failures: list[str] = []
        self.recorder = self.channels = None
        self.kept: Any = None
        self.world: Any = None
        self.values = {parameter.name: parameter.default for parameter in PARAMETERS} | LIMITS

    def parameter(self, name: str) -> Any:
        return self.values[name]

    def scene_changed(self) -> None:
        """Subscribe to nothing."""

    def pose_topics(self, snapshot: Any) -> dict[str, str]:
        return {}

    def configuration_topics(self, snapshot: Any) -> dict[str, str]:
        class Topics(dict):
            def __missing__(self, name: str) -> str:
                return f"/{name}/configurations"

        return Topics()

    def regions(self) -> Any:
        from scene_graph_ros.node.world.kept_regions import KeptRegions

        if self.kept is None:
            self.kept = KeptRegions(lambda: self.world.snapshot, lambda count: None)
        return self.kept

    def is_running(self) -> bool:
        return False

    def lack_of_kernels(self, group: str) -> str:
        return ""

    def get_logger(self) -> Host:
        return self

    def error(self, text: str) -> None:
        self.failures.append(text)

    warning = info = error


def offer(world: World, host: Host) -> Services:
    """Return the services without the middleware."""
    loader = SceneLoader("", message_type, EFFECT_NAMES)
    services = object.__new__(Services)
    services._host, services._world = host, world
    services._effects = Mock()  # what is published is not tried here
    services._tools = Tools(loader.resolve, message_type, loader.load_request, loader.text)
    services.counts = RequestCounts()
    host.world = world
    kept = ask(services, "LoadRegions", scene_graph_msgs.srv.LoadRegions.Request(text=KEPT))
    assert kept.status.code == Status.OK
    return services


@cache
def robot_file() -> Path:
    """Return the URDF of a ball on a rail, which stays until the process ends."""
    folder = Path(tempfile.mkdtemp())
    atexit.register(shutil.rmtree, folder)
    (folder / "slide.urdf").write_text(SLIDE)
    return folder / "slide.urdf"


def new_world() -> World:
    """Return a world whose source the requests own."""
    graph = SceneGraph()
    loaded = load_scene_text(SCENE).apply(graph)
    robot = load_scene_text(ROBOT % robot_file()).apply(graph).sources["slide"].robot
    world = World(graph)

    def own(edit: Any) -> None:
        records = edit.records
        records["arm"] = dataclasses.replace(records["arm"], token=TOKEN)
        records["slide"] = dataclasses.replace(records["slide"], robot=robot)
        edit.add_cameras(loaded.cameras)

    world.edit(own)
    held = scene_graph_msgs.srv.AttachFrame.Request(source=OWNER, frame="cup", link="ball")
    answer = scene_graph_msgs.srv.AttachFrame.Response()
    world.edit(lambda edit: EDITS["AttachFrame"](held, answer, edit, None))
    return world


def fields(message: Any, path: tuple[Any, ...] = ()) -> list[tuple[tuple[Any, ...], str]]:
    """Return where all fields of a message are, and their types."""
    found = []
    for name, kind in message.get_fields_and_field_types().items():
        value, place = getattr(message, name), (*path, name)
        found.append((place, kind))
        if hasattr(value, "get_fields_and_field_types"):
            found += fields(value, place)
        elif isinstance(value, list):
            for index, item in enumerate(value[:2]):
                if hasattr(item, "get_fields_and_field_types"):
                    found += fields(item, (*place, index))
    return found


def anything(rng: random.Random, kind: str) -> Any:
    """Return a value for a field of a type, None for a message, which stays as it is."""
    if kind.startswith("sequence<"):
        inner, _, bound = kind[len("sequence<") : -1].partition(", ")
        most = int(bound) if bound else rng.choice([0, 1, 2, 3, 7, 14, 100])
        items = [anything(rng, inner) for _ in range(rng.randint(0, most))]
        return None if None in items else items
    if kind.endswith("]"):
        inner, _, count = kind[:-1].partition("[")
        return [anything(rng, inner) for _ in range(int(count))]
    if kind == "string":
        known = ["base", "hand", "ball", "box", "floor", "table", "proximity", "mesh", "triangles"]
        known += ["eye", "depth", "points"]
        return rng.choice([*BAD_TEXTS, *known])
    if kind in ("double", "float"):
        return rng.choice(BAD_NUMBERS)
    if kind in RANGES:
        low, high = RANGES[kind]
        value = rng.choice([i for i in INTEGERS if low <= i <= high])
        return bool(value) if kind == "boolean" else value
    return None


def make(rng: random.Random) -> list[Any]:
    """Return requests in a row: each a type, and fields that are not as in the good one."""
    steps = []
    for _ in range(rng.choice([1, 1, 2, 4])):
        name = rng.choice(list(VALID))
        places = fields(request_of(name, []))
        chosen = rng.sample(places, min(rng.choice([0, 1, 1, 2, 3]), len(places)))
        changes = [(place, anything(rng, kind)) for place, kind in chosen]
        steps.append((name, [change for change in changes if change[1] is not None]))
    return steps


def request_of(name: str, changes: list[Any]) -> Any:
    """Return a good request with some fields changed."""
    from copy import deepcopy

    kind = PlanPath.Goal if name == "PlanPath" else getattr(scene_graph_msgs.srv, name).Request
    request = kind(**deepcopy(VALID[name]))
    for place, value in sorted(changes, key=lambda change: -len(change[0])):
        *way, last = place
        target = request
        for part in way:
            target = target[part] if isinstance(part, int) else getattr(target, part)
        setattr(target, last, value)
    return request


def run(steps: list[Any]) -> None:
    """Ask, and look at the answers and at what is left of the scene."""
    world, host = new_world(), Host()
    services = offer(world, host)
    for name, changes in steps:
        request = request_of(name, changes)
        before = state(world)
        response = ask(services, name, request)
        assert response.status.code != Status.INTERNAL_ERROR, host.failures
        if response.status.code == Status.OK:
            assert_finite(response)
            continue
        assert response.status.message.strip()
        assert len(response.status.message) < 20_000
        assert state(world) == before
    assert ask(services, "HasCollisions", request_of("HasCollisions", [])).status.code in (
        Status.OK,
        Status.UNSUPPORTED_PAIR,
    )


def ask(services: Services, name: str, request: Any) -> Any:
    """Return the response to a request, or the result of a goal."""
    if name == "PlanPath":
        action = object.__new__(PlanAction)
        action._host, action._world = services._host, services._world
        action._refuse, action._answered = services._refuse, services._plan_answered
        goal = Goal(bytes(16), request, Time(), lambda goal, feedback: assert_finite(feedback))
        return action._plan(goal).result
    if name in QUERIES:
        answers: list[Any] = []
        services._query_callback(name)(request, answers.append)
        return answers[0]
    assert name in EDITS
    return services._edit_callback(name)(request, getattr(scene_graph_msgs.srv, name).Response())


def state(world: World) -> tuple[Any, ...]:
    """Return what an edit changes: the scene's version, who owns what, cameras, and the poses."""
    snapshot = world.snapshot
    poses = snapshot.query.snapshot.X_PF.tobytes()
    cameras = tuple(sorted(snapshot.cameras))
    return snapshot.scene_version, tuple(sorted(world.records)), cameras, poses


def assert_finite(message: Any) -> None:
    """Fail for a number in a message that is none."""
    for name, kind in message.get_fields_and_field_types().items():
        value = getattr(message, name)
        if hasattr(value, "get_fields_and_field_types"):
            assert_finite(value)
        elif isinstance(value, list):
            for item in value:
                if hasattr(item, "get_fields_and_field_types"):
                    assert_finite(item)
        elif kind == "double":
            assert math.isfinite(value), (name, value)
        elif kind.startswith(("double[", "sequence<double")):
            assert np.isfinite(np.asarray(value, dtype=np.float64)).all(), (name, value)


def test_every_service_is_tried() -> None:
    """And the action; but those about surfaces, and the list of effects, which asks nothing."""
    assert {*VALID} == ({*QUERIES, *EDITS} - LEFT_OUT) | {"PlanPath"}


@pytest.mark.parametrize("name", VALID)
def test_good_requests_are_answered(name):
    """What the fuzzer starts from is right, so that it gets behind the first check."""
    world, host = new_world(), Host()
    response = ask(offer(world, host), name, request_of(name, []))
    assert response.status.code == Status.OK, (response.status, host.failures)


@pytest.mark.parametrize("kind", ["fifo", "device", "sparse", "deep", "long", "missing"])
@pytest.mark.parametrize("name", ["LoadScene", "RegisterGeometry"])
def test_files_that_never_end_are_invalid(tmp_path, name, kind):
    """A pipe, a device, 40 GB, a bomb and a name of 100 000 characters are INVALID_ARGUMENT."""
    path, words = tmp_path / "scene.obj", "no such file"
    if kind == "fifo":
        os.mkfifo(path)
        words = "no regular file"
    elif kind == "device":
        path, words = Path("/dev/zero"), "no regular file"
    elif kind == "sparse":
        with path.open("wb") as file:
            file.truncate(40 * 2**30)
        words = "has 42949672960 bytes, the limit is"
    elif kind == "deep":
        path.write_text("[" * 2000)
        words = "100 deep" if name == "LoadScene" else "no vertices"
    resource = "a" * 100_000 if kind == "long" else str(path)
    words = "at most 4096 characters, got 100000" if kind == "long" else words
    place = ("resource",) if name == "LoadScene" else ("geometries", 0, "shape", "resource")
    changes: list[Any] = [(place, resource)]
    if name == "LoadScene":
        changes.append((("text",), ""))
    if name == "RegisterGeometry":
        changes += [((*place[:-1], "kind"), 7), ((*place[:-1], "dimensions"), [])]
    world, host = new_world(), Host()
    before = state(world)
    response = ask(offer(world, host), name, request_of(name, changes))
    assert response.status.code == Status.INVALID_ARGUMENT, response.status
    assert words in response.status.message
    assert state(world) == before


@pytest.mark.filterwarnings("error::RuntimeWarning")
def test_requests_with_odd_fields():
    """Each answer is finite or has a status with a reason, and a refusal changes nothing."""
    fuzz(Target("services", make, run), 1000)
