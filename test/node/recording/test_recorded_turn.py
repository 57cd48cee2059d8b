"""glTF is turned from +Y up to +Z up: in markers, on the page, and in recordings alike."""

from __future__ import annotations

import re

from browser_page import PageClient
from letter_gltf import FACES, letter_gltf, TURNED
import numpy as np
from page_files import FileReader
from rclpy.serialization import deserialize_message
from recordings import replay
from visualization_msgs.msg import Marker, MarkerArray

from scene_graph_ros.replay.reader import RecordingReader

X_WG = "{xyz: [1, -2, 3], rpy: [0.1, 0.2, 0.3]}"


def corners_of(markers):
    """Return the corners (m, 3, 3) that a message of markers draws of the letter, in G."""
    (found,) = markers.markers
    assert (found.type, found.mesh_resource) == (Marker.TRIANGLE_LIST, "")
    return np.array([(p.x, p.y, p.z) for p in found.points]).reshape(-1, 3, 3)


def corners_on(page):
    """Return those that a page draws of it, in G."""
    vertices, triangles, *_ = page.meshes[page.named("letter", "illustration")["mesh"]]
    return np.asarray(vertices)[np.asarray(triangles)]


def test_markers_page_and_recording_have_one_turn(start_node, client, domain, tmp_path):
    """Corner by corner: the file's (x, y, z) is (x, -z, y) everywhere, its pose another matter."""
    (tmp_path / "letter.gltf").write_bytes(letter_gltf())
    scene, folder = tmp_path / "scene.yaml", tmp_path / "bag"
    scene.write_text(f"""
version: 1
sources: [{{name: shelf}}]
geometries:
  - {{name: letter, source: shelf, pose: {X_WG}, shape: {{type: mesh, file: letter.gltf}},
     roles: {{proximity: {{mesh: {{representation: triangles}}}}, illustration: {{}}}}}}
""")
    node = start_node({"scene": scene, "record": folder, "browser": True, "browser_port": 0})
    node.wait_for_output("browser view at ")
    page = PageClient(re.search(r"browser view at (http://127\.0\.0\.1:\d+/)", node.output())[1])
    page.take_until(lambda: page.named("letter", "illustration"))
    sent = client.listen(MarkerArray, "markers/illustration").wait_for(lambda m: m.markers, "F")
    seen = {"marker": corners_of(sent), "page": corners_on(page)}
    page.close()
    assert node.stop() == 0
    recorded = [
        deserialize_message(m.data, MarkerArray)
        for m in RecordingReader(folder)
        if m.topic.endswith("markers/illustration")
    ]
    seen["recorded marker"] = corners_of(next(m for m in recorded if m.markers))
    code, said = replay(domain, folder, "--html", tmp_path / "page.html")
    assert code == 0, said
    reader = FileReader((tmp_path / "page.html").read_text())
    reader.go(0)
    seen["page of the recording"] = corners_on(reader)
    for place, corners in seen.items():
        np.testing.assert_allclose(corners, TURNED[FACES], atol=1e-6, err_msg=place)
