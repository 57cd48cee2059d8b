"""A scene without compliant and deformable geometry pays nothing for them."""

from __future__ import annotations

import json
import subprocess
import sys

from forked import run_forked
from node_harness import environment, ROOT
import pytest

PLAIN = """
version: 1
sources: [{name: s}]
frames: [{name: f, source: s, pose: {xyz: [0, 0, 0.05]}}]
geometries:
  - {name: floor, source: s, shape: {type: half_space}}
  - name: ball
    source: s
    frame: f
    shape: {type: sphere, radius: 0.1}
    roles: {proximity: {hydroelastic: {%s}}, illustration: {}}
"""

RIGID = "compliance_type: rigid, resolution_hint: 0.1"
"""Rigid alone makes no surface."""

COMPLIANT = "compliance_type: compliant, resolution_hint: 0.1, hydroelastic_modulus: 1e5"

PROGRAM = """
import json, sys, threading, time
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.parameter import Parameter
from visualization_msgs.msg import MarkerArray
from scene_graph_msgs.msg import ContactArray
from scene_graph_ros.node.node import SceneGraphNode

rclpy.init()
node = SceneGraphNode(parameter_overrides=[Parameter("scene", value=sys.argv[1])])
got = {}
for kind, topic in ((ContactArray, "contacts"), (MarkerArray, "markers/proximity"),
                    (MarkerArray, "markers/illustration")):
    node.create_subscription(
        kind, f"/scene_graph/{topic}", lambda m, topic=topic: got.__setitem__(topic, m), 10)
executor = SingleThreadedExecutor()
executor.add_node(node)
end = time.monotonic() + 100
while len(got) < 3 and time.monotonic() < end:
    executor.spin_once(timeout_sec=0.1)
topics = sorted(name for name, _ in node.get_topic_names_and_types())
print(json.dumps({
    "got": sorted(got),
    "contacts": [len(got["contacts"].points), len(got["contacts"].surfaces)],
    "topics": topics,
    "modules": sorted(sys.modules),
    "threads": sorted(thread.name for thread in threading.enumerate()),
}))
node.destroy_node()
rclpy.shutdown()
"""

OF_SURFACES = (
    "scene_graph_ros.geometry.hydroelastic",
    "msg_adapters.contact_surface_markers",
    "msg_adapters.wire.contact_surface_markers",
    "msg_adapters.contact_surfaces",
    "scene_graph_ros.node.effects.contact_surfaces",
    "scene_graph_ros.views.surfaces",
)
OF_DEFORMABLES = (
    "scene_graph_ros.geometry.deformable",
    "msg_adapters.deformables",
    "msg_adapters.deformable_markers",
    "msg_adapters.wire.deformable_markers",
    "scene_graph_ros.node.world.configurations",
    "scene_graph_ros.node.effects.deformable_contact",
    "scene_graph_ros.node.effects.deformable_markers",
)
OF_CLOUDS = (
    "msg_adapters.point_clouds",
    "msg_adapters.wire.cloud_markers",
    "scene_graph_ros.geometry.query.elements",
    "scene_graph_ros.geometry.tables.point_tree",
    "scene_graph_ros.node.effects.cloud_markers",
    "scene_graph_ros.node.world.point_channel",
    "scene_graph_ros.node.world.pose_history",
    "scene_graph_ros.node.world.sensor_channel",
    "scene_graph_ros.node.world.sensor_state",
    "scene_graph_ros.sensing",
)
OF_FIELDS = (
    "msg_adapters.height_images",
    "scene_graph_ros.node.world.height_channel",
    "scene_graph_ros.geometry.query.elements",
    "scene_graph_ros.node.effects.field_markers",
    "scene_graph_ros.views.height_fields",
)
OF_DEPTH = (
    "msg_adapters.depth_images",
    "scene_graph_ros.node.effects.sensed_points",
    "scene_graph_ros.node.world.depth_channel",
)
OF_SENSED_GRIDS = ("scene_graph_ros.node.world.sensed_grids",)
OF_BOTH = (
    "scene_graph_ros.geometry.meshes.volume",
    "meshio",
    "pytetwild",
    "msg_adapters.wire.triangles",
    "scene_graph_ros.node.services.surface_",
)
OF_CAMERAS = (
    "scene_graph_ros.geometry.perception",
    "msg_adapters.cameras",
    "msg_adapters.images",
    "msg_adapters.labels",
    "msg_adapters.wire.images",
    "scene_graph_ros.node.effects.camera",
    "scene_graph_ros.node.effects.frames",
)
OF_BROWSER = (
    "scene_graph_ros.node.effects.browser",
    "scene_graph_ros.node.effects.page_",
    "scene_graph_ros.views.browser",
    "websockets",
)
OF_RECORDING = (
    "scene_graph_ros.node.effects.record",
    "scene_graph_ros.node.recording",
    "scene_graph_ros.replay",
    "rosbags",
)
OF_PLANNING = (
    "scene_graph_ros.planning",
    "msg_adapters.robot_configurations",
    "scene_graph_ros.node.services.path_plans",
    "scene_graph_ros.node.services.planning_queries",
    "scene_graph_ros.node.world.planning_robots",
)
OF_REGIONS = (
    "scene_graph_ros.geometry.optimization",
    "msg_adapters.region",
    "scene_graph_ros.node.effects.regions",
    "scene_graph_ros.node.services.region_",
    "scene_graph_ros.node.world.kept_regions",
)
CLOUD = """
  - name: seen
    source: s
    shape: {type: point_cloud, radius: 0.1, points: [[0, 0, 0.2]]}
    roles: {proximity: {}, illustration: {}}
"""
FIELD = """
  - name: ground
    source: s
    shape: {type: height_field, heights: [[0.2, 0.2], [0.2, 0.2]], size: [1, 1], floor: -1}
    roles: {proximity: {}, illustration: {}}
"""
GRID = """
  - name: space
    source: s
    pose: {xyz: [0, 0, 0.1]}
    shape: {type: voxel_grid, voxel: 0.1, counts: [1, 1, 1], runs: [[2, 1]]}
    roles: {proximity: {}, illustration: {}}
"""
CAMERA = """
cameras:
  - {name: eye, source: s, size: [4, 3], fov_y: 1, images: [depth]}
"""


@pytest.fixture
def run(domain, tmp_path):
    """Run a node with a ball of given properties until all that is asked for has come.

    Unless it is fresh, it is forked from what has imported some of what nodes are asked for.
    """

    def run_with(properties, more="", sources="{name: s}", *, fresh=False):
        text = PLAIN.replace("%s", properties).replace("{name: s}", sources, 1)
        (tmp_path / "scene.yaml").write_text(text + more)
        arguments, variables = [str(tmp_path / "scene.yaml")], environment(domain)
        if fresh:
            command = [sys.executable, "-c", PROGRAM, *arguments]
            options = {"capture_output": True, "text": True, "timeout": 120.0}
            done = subprocess.run(command, env=variables, cwd=ROOT, check=False, **options)
            code, said = done.returncode, done.stderr + done.stdout
        else:
            code, said = run_forked(PROGRAM, arguments, variables, 120.0)
        assert code == 0, said
        return json.loads(said.splitlines()[-1])

    return run_with


@pytest.mark.parametrize("properties", ["", RIGID])
def test_nothing_is_imported_or_advertised_unasked(run, properties):
    """With all ordinary topics heard: no module of theirs, no topic of theirs, points as ever."""
    report = run(properties, fresh=True)
    assert report["got"] == ["contacts", "markers/illustration", "markers/proximity"]
    assert report["contacts"] == [1, 0]
    unwanted = OF_SURFACES + OF_DEFORMABLES + OF_BOTH + OF_CAMERAS + OF_BROWSER
    unwanted += OF_PLANNING + OF_RECORDING + OF_REGIONS + OF_CLOUDS + OF_FIELDS + OF_DEPTH
    assert [m for m in report["modules"] if m.startswith(unwanted)] == []
    words = ("surface", "configurations", "camera", "region", "points", "sensed")
    assert not [t for t in report["topics"] if any(word in t for word in words)]
    assert not [
        t for t in report["threads"] if any(w in t for w in ("camera", "browser", "recording"))
    ]


def test_what_is_asked_for_is_there(run):
    """The same with a compliant ball and a camera: else the test above would show nothing.

    Nobody hears the camera, so it has no thread.
    """
    report = run(COMPLIANT, CAMERA)
    modules = set(report["modules"])
    assert {"scene_graph_ros.node.effects.contact_surfaces", "msg_adapters.contact_surfaces"} <= (
        modules
    )
    assert "/scene_graph/contact_surface_markers" in report["topics"]
    assert not [m for m in modules if m.startswith(OF_DEFORMABLES)]
    assert {"scene_graph_ros.node.effects.camera", "msg_adapters.images"} <= modules
    assert "/scene_graph/cameras/eye/depth/image" in report["topics"]
    assert not [t for t in report["threads"] if "camera" in t]


def test_clouds_come_with_the_first(run):
    """Their modules and their topic, and a point that is deep in the ball."""
    report = run("", CLOUD)
    assert not [name for name in OF_CLOUDS if name not in report["modules"]]
    assert "/s/points" in report["topics"]
    assert not [name for name in report["modules"] if name.startswith(OF_DEPTH)]
    assert report["contacts"] == [2, 0]


def test_height_fields_come_with_the_first(run):
    """Their modules, no topic of points, and a contact of the ball with the ground."""
    report = run("", FIELD)
    loaded = report["modules"]
    assert not [name for name in OF_FIELDS if not any(m.startswith(name) for m in loaded)]
    assert "/s/points" not in report["topics"]
    assert report["contacts"] == [2, 0]


def test_images_of_depth_come_with_their_settings(run):
    """Their modules, the topics of image and lens, and that of the points; none for a cloud."""
    depth = "{name: s, depth: {image: eye/depth}}"
    report = run("", CLOUD, sources=depth)
    assert not [name for name in OF_DEPTH if name not in report["modules"]]
    assert {"/eye/depth", "/eye/camera_info", "/scene_graph/sensed/s"} <= set(report["topics"])
    assert "/s/points" not in report["topics"]
    assert not [name for name in report["modules"] if name.startswith(OF_SENSED_GRIDS)]
    assert report["contacts"] == [2, 0]


def test_grids_that_images_fill_come_with_their_settings(run):
    """Their modules and the images' topics, none of maps; and a voxel that is deep in the ball."""
    report = run("", GRID, sources="{name: s, depth: {image: eye/depth, into: voxel_grid}}")
    assert not [name for name in OF_SENSED_GRIDS if name not in report["modules"]]
    assert {"/eye/depth", "/eye/camera_info", "/scene_graph/sensed/s"} <= set(report["topics"])
    assert not {"/s/points", "/s/voxels"} & set(report["topics"])
    assert report["contacts"] == [2, 0]
