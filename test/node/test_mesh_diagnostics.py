"""/diagnostics says how many meshes are no solids, and why one of them is none."""

from __future__ import annotations

from diagnostic_msgs.msg import DiagnosticArray
from node_harness import diagnostics_values

SCENE = """
version: 1
sources:
  - {name: bin}
geometries:
  - {name: tray, source: bin, shape: {type: mesh, file: tray.obj}}
  - {name: block, source: bin, shape: {type: mesh, file: block.obj}}
"""
BOX = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n"
BOX += "f 4 3 2 1\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n"
LID = "f 5 6 7 8\n"


def test_open_meshes_are_counted_with_a_reason(client, start_node, tmp_path):
    """Of a tray without a lid and a closed block, the tray."""
    (tmp_path / "tray.obj").write_text(BOX)
    (tmp_path / "block.obj").write_text(BOX + LID)
    scene = tmp_path / "scene.yaml"
    scene.write_text(SCENE)
    start_node({"scene": scene, "diagnostics_rate": 20.0})
    diagnostics = client.listen(DiagnosticArray, "/diagnostics")
    key = "meshes that are no solids"
    message = diagnostics.wait_for(lambda m: key in diagnostics_values(m, "world"), "the count")
    assert diagnostics_values(message, "world")[key] == (
        "1: mesh 'tray': 4 edges are open, one at (0.5, 0, 1), so a sheet has two sides and no"
        " inside"
    )
    client.forget(diagnostics)
