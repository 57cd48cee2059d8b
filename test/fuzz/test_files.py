"""Scene files, robots and meshes with mistakes in them: refused with their name, or right."""

from __future__ import annotations

from functools import cache
import io
from pathlib import Path
import random
import tempfile
from typing import Any

from fuzzing import fuzz, Target
import meshio
import numpy as np
import pytest
import trimesh

from scene_graph_ros.geometry import SceneGraph
from scene_graph_ros.geometry.errors import MeshError
from scene_graph_ros.geometry.meshes.io import read_mesh_contents
from scene_graph_ros.geometry.meshes.volume_io import parse_volume_mesh
from scene_graph_ros.scene_files import (
    load_scene_text,
    load_srdf,
    load_urdf,
    register_robot,
    SceneFileError,
)

ROOT = Path(__file__).parents[2]
SCENE = """version: 1
name: cell
sources: [{name: arm}, {name: table, poses: {type: geometry_msgs/msg/PoseStamped, topic: /t}}]
frames:
  - &base {name: base, source: arm, pose: {xyz: [0, 0.5, 1e-3], rpy: [0, 1, 0]}}
  - {<<: *base, name: hand, parent: base, pose: {xyz: [1, 2, 3], quaternion: [0, 0, 0, 1]}}
geometries:
  - {name: ball, source: arm, frame: base, shape: {type: sphere, radius: 0.05}, color: [1, 0, 0]}
  - {name: hull, source: arm, frame: hand,
     shape: {type: convex, vertices: [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], scale: 2}}
  - name: floor
    source: table
    shape: {type: half_space}
    roles: {proximity: {mesh: {representation: triangles}}, illustration: {}}
collision_filters: [{between: [[arm/base], [table/world/floor]]}, {action: allow, within: [arm]}]
effects: {signed_distance: "off"}
"""
URDF = """<?xml version="1.0"?>
<robot name="chain"><material name="grey"><color rgba="0.5 0.5 0.5 1"/></material>
<link name="a"><collision name="c"><origin xyz="0 0 1" rpy="0 0.5 0"/>
<geometry><box size="1 2 3"/></geometry></collision></link>
<link name="b"><visual><geometry><cylinder radius="1" length="2"/></geometry>
<material name="grey"/></visual><collision><geometry><sphere radius="1"/></geometry></collision>
</link><link name="d"/>
<joint name="j" type="revolute"><parent link="a"/><child link="b"/><axis xyz="0 0 1"/>
<limit lower="-1" upper="1"/></joint>
<joint name="k" type="prismatic"><parent link="b"/><child link="d"/><mimic joint="j"/></joint>
</robot>"""
SRDF = """<robot name="chain"><disable_collisions link1="a" link2="b" reason="Adjacent"/>
<group_state name="up" group="arm"><joint name="j" value="0.5"/></group_state></robot>"""

TOKENS = (
    "[", "]", "{", "}", "<<: *base", "&x ", "*x", "- ", "\n", "\t", "#", "'", '"', "!!python/x ",
    "1e999", "-1", "0", ".nan", ".inf", "nan", "1e-320", "9" * 400, "null", "true", "world", "é",
    "\x00", "<a>", "</a>", "<!--", "<![CDATA[", "&amp;", "&x;", "<!DOCTYPE a>", "/>", 'name="a"',
    "xyz", "parent", "element vertex 9999999999", "f 1 2 99", "v nan 0 0", "v 1e400 0 0", "inf",
)  # fmt: skip
"""Words that mean something in one of the formats."""


@cache
def meshes() -> dict[str, bytes]:
    """Return a small mesh in each format."""
    solid = trimesh.creation.box((1.0, 2.0, 3.0))
    result = {}
    for kind in ("obj", "stl", "stl_ascii", "ply", "off", "glb", "dae"):
        data = solid.export(file_type=kind)
        result[kind] = data.encode() if isinstance(data, str) else data
    tetrahedron = meshio.Mesh(np.eye(4, 3), [("tetra", np.array([[0, 1, 2, 3]]))])
    with tempfile.TemporaryDirectory() as folder:
        for kind in ("vtk", "vtu"):
            path = Path(folder, f"mesh.{kind}")
            tetrahedron.write(path)
            result[kind] = path.read_bytes()
    return result


def bases() -> dict[str, bytes]:
    """Return what is changed: a file of each kind."""
    texts = {"scene": SCENE, "urdf": URDF, "srdf": SRDF}
    examples = {
        "gripper": (ROOT / "config/scenes/gripper.yaml").read_text(),
        "cell": (ROOT / "config/scenes/panda_cell.yaml").read_text(),
    }
    return {name: text.encode() for name, text in (texts | examples).items()} | meshes()


def make(rng: random.Random) -> list[Any]:
    """Return a kind of file, and changes to be made one after another."""
    # The examples take longest: robots and soft bodies.
    kinds = [kind for kind in bases() if kind not in ("gripper", "cell") or rng.random() < 0.02]
    kind = rng.choice(kinds)
    changes = [change(rng) for _ in range(rng.choice([1, 1, 2, 3, 8]))]
    return [kind, *changes]


def change(rng: random.Random) -> Any:
    """Return a change: what, where as a share of the file, and with what."""
    place, length = rng.random(), rng.choice([1, 2, 5, 20, 100])
    what = rng.choice(["flip", "insert", "replace", "delete", "repeat", "number"])
    if what == "flip":
        return what, place, rng.randrange(1, 256)
    if what in ("insert", "replace"):
        return what, place, rng.choice(TOKENS)
    if what == "number":
        return what, place, rng.choice([0, 2**31, 2**32 - 1, 10**6])
    return what, place, length


def changed(data: bytes, changes: list[Any]) -> bytes:
    """Return a file after the changes."""
    result = bytearray(data)
    for what, share, value in changes:
        place = int(share * len(result))
        if what == "flip" and result:
            result[min(place, len(result) - 1)] ^= value
        elif what == "insert":
            result[place:place] = value.encode()
        elif what == "replace":
            result[place : place + len(value)] = value.encode()
        elif what == "delete":
            del result[place : place + value]
        elif what == "repeat":
            result[place:place] = result[place : place + value] * 3
        elif what == "number":
            result[place : place + 4] = value.to_bytes(4, "little")
    return bytes(result)


def run(steps: list[Any]) -> None:
    """Read a file: what comes out is right, or there is an error that names it."""
    if not steps or not isinstance(steps[0], str):
        return
    kind, *changes = steps
    data = changed(bases()[kind], changes)
    message = ""
    try:
        if kind in meshes():
            read_mesh_of(kind, data)
        elif kind in ("urdf", "srdf"):
            read_robot(kind, data)
        else:
            read_scene(data)
    except (SceneFileError, MeshError) as error:
        message = str(error)
    assert not message or message.startswith(("<text>", "the mesh")), message
    assert len(message) < 100_000


def read_mesh_of(kind: str, data: bytes) -> None:
    """Read a surface or tetrahedra."""
    if kind in ("vtk", "vtu"):
        mesh = parse_volume_mesh(data, kind, name="the mesh")
        assert np.isfinite(mesh.vertices).all()
        assert mesh.tetrahedra.max() < len(mesh.vertices)
        return
    vertices, triangles = read_mesh_contents(data, kind.partition("_")[0], name="the mesh")
    assert np.isfinite(vertices).all()
    assert not triangles.size or 0 <= triangles.min() <= triangles.max() < len(vertices)


def read_robot(kind: str, data: bytes) -> None:
    """Read a robot or what is said of one, and place it."""
    text = data.decode(errors="replace").lstrip()
    text = text if text.startswith("<") else f"<{text}"
    if kind == "srdf":
        load_srdf(text, load_urdf(URDF))
        return
    robot = load_urdf(text)
    graph = SceneGraph()
    source = graph.register_source("robot")
    with_poses(graph, lambda: register_robot(robot, graph, source))


def read_scene(data: bytes) -> None:
    """Read a scene, and register it as a whole or not at all."""
    graph = SceneGraph()
    scene = load_scene_text(data.decode(errors="replace"))
    with_poses(graph, lambda: scene.apply(graph).set_initial_poses)


def with_poses(graph: SceneGraph, register: Any) -> None:
    """Register something; where it is refused nothing stays."""
    before = graph.model_inspector().num_sources(), graph.model_inspector().num_geometries()
    try:
        set_poses = register()
    except SceneFileError:
        inspector = graph.model_inspector()
        assert (inspector.num_sources(), inspector.num_geometries()) == before
        raise
    context = graph.create_default_context()
    if callable(set_poses):
        set_poses(context)
    assert np.isfinite(context.snapshot.X_WF).all()


def test_what_is_changed_was_right():
    """Each file is read without a change, so that the fuzzer gets behind the first check."""
    for kind in bases():
        run([kind])
        assert changed(bases()[kind], []) == bases()[kind]
    assert io.BytesIO(bases()["stl"]).read(5)


@pytest.mark.filterwarnings("error::RuntimeWarning")
def test_files_with_mistakes():
    """No exception but those that are documented, no number that is none, nothing half done."""
    fuzz(Target("files", make, run), 6000)
