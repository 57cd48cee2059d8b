"""Follow a thing on its way through the files: `python -m tools.walks`.

A walk is run uncompiled with a trace, so that kernels are entered as well. Its stations are the
files of the packages in the order in which something in them is first called; what runs when a
module is imported does not count. Where two stations that follow each other are of different
layers, the walk crosses from one to the other. With ``--write`` the walks of
docs/architecture.md are written anew, each between ``<!-- walk: pose -->`` and ``<!-- end -->``.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator
from contextlib import contextmanager
import inspect
import itertools
import os
from pathlib import Path
import re
import sys
import tempfile
import textwrap
import threading
import time
from types import FrameType
from typing import Any, NamedTuple, TYPE_CHECKING

if TYPE_CHECKING:
    from scene_graph_ros.geometry import SceneGraph

__all__ = ["PAGE", "WALKS", "Walk", "walk_all", "written"]

_ROOT = Path(__file__).resolve().parents[1]
PAGE = _ROOT / "docs" / "architecture.md"
_WIDTH = 99
_LAYERS = {
    "msg_adapters": "adapters",
    "scene_graph_ros/node": "node",
    "scene_graph_ros/scene_files": "scene files",
    "scene_graph_ros/robots": "robots",
    "scene_graph_ros/trajectories": "trajectories",
    "scene_graph_ros/geometry": "core",
}
_WITH_ROOMS = ("scene_graph_ros/planning", "scene_graph_ros/convex")
"""Packages whose folders count as layers."""
_PATIENCE = 60.0
"""Seconds to wait for an answer of the node."""


def _folder(station: str) -> str:
    """Return the folder that is a file's layer: a package, or a room of one."""
    if station.startswith(_WITH_ROOMS):
        return Path(station).parent.as_posix()
    return next(folder for folder in _LAYERS if station.startswith(f"{folder}/"))


def _layer(station: str) -> str:
    """Return the name of the layer that a file belongs to."""
    folder = _folder(station)
    return _LAYERS.get(folder, folder.removeprefix("scene_graph_ros/"))


class Walk(NamedTuple):
    """The files that something goes through, in order, without those that come again."""

    stations: tuple[str, ...]

    @property
    def legs(self) -> tuple[tuple[str, tuple[str, ...]], ...]:
        """The layers in turn, with the stations in each."""
        legs = itertools.groupby(self.stations, _layer)
        return tuple((name, tuple(stations)) for name, stations in legs)

    @property
    def crossings(self) -> int:
        """How often it goes from one layer to another."""
        return len(self.legs) - 1


class _Call(NamedTuple):
    thread: str
    station: str


class _Trace:
    """Notes what is called in any thread that begins after it was made, while it is on."""

    def __init__(self) -> None:
        self._calls: list[_Call] = []
        self._is_on = False
        self._stations: dict[str, str] = {}
        threading.setprofile(self._note)

    def _note(self, frame: FrameType, event: str, argument: Any) -> None:
        if event != "call" or not self._is_on or not frame.f_code.co_flags & inspect.CO_OPTIMIZED:
            # Bodies of modules and classes are not optimized: they run at an import.
            return
        name = frame.f_code.co_filename
        station = self._stations.get(name)
        if station is None:
            station = self._stations[name] = _station(name)
        if station:
            thread = threading.current_thread().name
            self._calls.append(_Call(thread, station))

    @contextmanager
    def on(self) -> Iterator[list[_Call]]:
        """Note what is called in the block."""
        calls: list[_Call] = []
        self._calls = calls
        self._is_on = True
        sys.setprofile(self._note)
        yield calls
        sys.setprofile(None)
        self._is_on = False


def _station(name: str) -> str:
    path = Path(name)
    if not path.is_relative_to(_ROOT):
        return ""
    station = path.relative_to(_ROOT).as_posix()
    folders = (*_LAYERS, *_WITH_ROOMS)
    return station if any(station.startswith(f"{folder}/") for folder in folders) else ""


def _walk(calls: list[_Call], thread: str) -> Walk:
    """Return the walk of the threads whose names begin so."""
    mine = [call.station for call in calls if call.thread.startswith(thread)]
    return Walk(tuple(dict.fromkeys(mine)))


class _Scene:
    """A node with two balls, and a program that places one, hears of contacts and asks."""

    def __init__(self, trace: _Trace) -> None:
        from geometry_msgs.msg import Quaternion, Transform, Vector3
        import rclpy
        from rclpy.executors import SingleThreadedExecutor
        from rclpy.parameter import Parameter
        from sensor_msgs.msg import MultiDOFJointState

        from scene_graph_msgs.msg import ContactArray
        from scene_graph_msgs.srv import ComputeSignedDistanceToPoint
        from scene_graph_ros.node.node import SceneGraphNode

        def pose(x: float) -> MultiDOFJointState:
            transform = Transform(translation=Vector3(x=x), rotation=Quaternion(w=1.0))
            message = MultiDOFJointState(joint_names=["a"], transforms=[transform])
            message.header.stamp = self._other.get_clock().now().to_msg()
            return message

        self._trace, self._pose, self._x = trace, pose, 0.0
        self._request = ComputeSignedDistanceToPoint.Request(points=[1.0, 0.0, 0.0])
        rclpy.init()
        rates = {"min_update_rate": 5.0, "diagnostics_rate": 0.1}
        self._node = SceneGraphNode(
            scene_graph=_two_balls(),
            parameter_overrides=[Parameter(name, value=rate) for name, rate in rates.items()],
        )
        self._other = rclpy.create_node("walker")
        self._publisher = self._other.create_publisher(MultiDOFJointState, "/zoo/poses", 10)
        self._heard: list[Any] = []
        self._other.create_subscription(
            ContactArray, "/scene_graph/contacts", self._heard.append, 10
        )
        self._client = self._other.create_client(
            ComputeSignedDistanceToPoint, "/scene_graph/compute_signed_distance_to_point"
        )
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(self._other)
        self._wait(lambda: self._heard and self._client.service_is_ready())
        for _ in range(4):
            self._place()
            self._ask()

    def _wait(self, condition: Callable[[], Any]) -> None:
        end = time.monotonic() + _PATIENCE
        while not condition():
            self._executor.spin_once(0.02)
            if time.monotonic() > end:
                raise TimeoutError("the node does not answer")

    def _wait_for_updates(self) -> None:
        """Wait until an update has begun and ended; contacts come with each."""
        count = len(self._heard) + 2
        self._wait(lambda: len(self._heard) >= count)

    def _place(self) -> None:
        """Place a ball; return when its contact has come."""
        self._x += 1e-3
        message = self._pose(self._x)
        self._publisher.publish(message)
        self._wait(lambda: self._heard[-1].header.stamp == message.header.stamp)

    def _ask(self) -> None:
        future = self._client.call_async(self._request)
        self._wait(future.done)

    def walks(self) -> tuple[Walk, Walk]:
        """Return the walk of a pose to a contact, and of a point to its distances."""
        self._wait_for_updates()
        with self._trace.on() as placed:
            self._place()
            self._wait_for_updates()
        with self._trace.on() as asked:
            self._ask()
            self._wait_for_updates()
        return _walk(placed, "world"), _walk(asked, "requests")

    def close(self) -> None:
        """End both."""
        import rclpy

        self._node.destroy_node()
        self._other.destroy_node()
        rclpy.shutdown()


def _two_balls() -> SceneGraph:
    import numpy as np

    from scene_graph_ros.geometry import (
        GeometryFrame,
        GeometryInstance,
        ProximityProperties,
        SceneGraph,
        Sphere,
    )

    graph = SceneGraph()
    source = graph.register_source("zoo")
    for name, x in (("a", 0.0), ("b", 1.0)):
        frame = graph.register_frame(source, GeometryFrame(name))
        X_FG = np.eye(4)
        X_FG[0, 3] = x
        ball = graph.register_geometry(source, frame, GeometryInstance(X_FG, Sphere(1.0), name))
        graph.assign_role(source, ball, ProximityProperties())
    return graph


_MESH = "v 0 0 0\nv {0} 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"
_URDF = (
    '<robot name="r"><link name="a"><collision><geometry><mesh filename="{}/m.obj"/></geometry>'
    "</collision></link></robot>"
)
_FILE = "version: 1\nname: s\nrobots:\n- {{name: r, urdf: {}/r.urdf}}\n"


def _mesh_of_a_robot(trace: _Trace) -> Walk:
    """Return the walk of a mesh named by a URDF to its row of the table that kernels read."""
    from scene_graph_ros.geometry import SceneGraph

    _load_mesh(SceneGraph(), 2)  # Another mesh imports what there is to import.
    graph = SceneGraph()
    with trace.on() as calls:
        _load_mesh(graph, 1)
    return _walk(calls, threading.current_thread().name)


def _load_mesh(graph: SceneGraph, size: int) -> None:
    from scene_graph_ros.scene_files import load_scene_text

    with tempfile.TemporaryDirectory() as folder:
        Path(folder, "m.obj").write_text(_MESH.format(size))
        Path(folder, "r.urdf").write_text(_URDF.format(folder))
        load_scene_text(_FILE.format(folder), label="walk").apply(graph)
        _ = graph.create_default_context().snapshot.proximity.table


_SLIDES = """<robot name="r"><link name="base"/><link name="x"/>
<link name="hand"><collision><geometry><sphere radius="0.1"/></geometry></collision></link>
<joint name="x" type="prismatic"><parent link="base"/><child link="x"/><axis xyz="1 0 0"/>
<limit lower="-1" upper="1" velocity="1" effort="1"/></joint>
<joint name="y" type="prismatic"><parent link="x"/><child link="hand"/><axis xyz="0 1 0"/>
<limit lower="-1" upper="1" velocity="1" effort="1"/></joint></robot>"""
_PILLAR = """version: 1
name: s
sources: [{name: around}]
geometries: [{name: pillar, source: around, shape: {type: sphere, radius: 0.1}}]
robots: [{name: r, urdf: r.urdf}]
"""


def _plans(trace: _Trace) -> tuple[Walk, Walk]:
    """Return the walks of an edge to its proof, and of two configurations to a path."""
    from scene_graph_ros.planning import (
        load_robot_diagram,
        plan_path,
        SceneGraphCollisionChecker,
    )

    with tempfile.TemporaryDirectory() as folder:
        Path(folder, "r.urdf").write_text(_SLIDES)
        scene = Path(folder, "s.yaml")
        scene.write_text(_PILLAR)
        checker = SceneGraphCollisionChecker(load_robot_diagram(scene))
    # The pillar is beside the edge, and in the way of the path.
    (start, end), goal = ([-0.5, -0.3], [0.5, -0.3]), [0.5, 0.3]
    walks = []
    for ask in (
        lambda: checker.check_edge_collision_free(start, end),
        lambda: plan_path(checker, start, goal).is_success,
    ):
        assert ask()  # The first imports what there is to import.
        with trace.on() as calls:
            ask()
        walks.append(_walk(calls, threading.current_thread().name))
    return walks[0], walks[1]


def _set(trace: _Trace) -> Walk:
    """Return the walk of a polyhedron to the proof that it is not empty."""
    from scene_graph_ros.geometry.optimization import HPolyhedron

    for _ in range(2):
        triangle = HPolyhedron([[-1.0, 0.0], [0.0, -1.0], [1.0, 1.0]], [0.0, 0.0, 1.0])
        with trace.on() as calls:
            triangle.is_empty(certificate=True)
    return _walk(calls, threading.current_thread().name)


WALKS = {
    "pose": "A pose, from the bytes of its message to those of a contact",
    "point": "A point, from a request to the response with its distances",
    "mesh": "A mesh named by a URDF, to its row of the table that kernels read",
    "edge": "An edge between two configurations, to its proof",
    "path": "Two configurations, to a path between them that is proven free",
    "set": "A polyhedron, to the proof that it is not empty",
}
"""What walks, and from where to where."""


def walk_all() -> dict[str, Walk]:
    """Walk all of `WALKS`, in a process where kernels are not compiled."""
    trace = _Trace()
    scene = _Scene(trace)
    pose, point = scene.walks()
    scene.close()
    mesh = _mesh_of_a_robot(trace)
    edge, path = _plans(trace)
    return {
        "pose": pose,
        "point": point,
        "mesh": mesh,
        "edge": edge,
        "path": path,
        "set": _set(trace),
    }


def written(walk: Walk) -> str:
    """Return the walk as the page shows it: a list of its layers with the files in each.

    Files are named from their layer's folder on.
    """
    lines = [f"{len(walk.stations)} files, {walk.crossings} crossings:", ""]
    for number, (name, stations) in enumerate(walk.legs, 1):
        files = ", ".join(f"`{Path(each).relative_to(_folder(each))}`" for each in stations)
        text = f"{number}. {name}: {files}"
        lines += textwrap.wrap(text, _WIDTH, subsequent_indent="   ", break_on_hyphens=False)
    return "\n".join(lines)


def main() -> None:
    """Print the walks, or write them to the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--write", action="store_true", help=f"write them to {PAGE.name}")
    asked = parser.parse_args()
    os.environ["NUMBA_DISABLE_JIT"] = "1"
    page = PAGE.read_text(encoding="utf-8")
    for name, walk in walk_all().items():
        text = written(walk)
        print(f"{WALKS[name]}: {text}\n")
        before, after = f"<!-- walk: {name} -->\n", "<!-- end -->"
        page = re.sub(f"{before}.*?{after}", before + text + "\n" + after, page, flags=re.DOTALL)
    if asked.write:
        PAGE.write_text(page, encoding="utf-8")


if __name__ == "__main__":
    main()
