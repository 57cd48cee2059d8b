"""README's node snippet, as a reader runs it: in a new process, with a node that runs."""

from __future__ import annotations

from pathlib import Path
import re
import subprocess
import sys

from node_harness import environment
import pytest
from spinning import wait_until

ROOT = Path(__file__).parents[2]
SCENE = """version: 1
sources: [{name: objects}]
frames: [{name: ball, source: objects}]
geometries: [{name: ball, source: objects, frame: ball, shape: {type: sphere, radius: 0.1}}]
"""


def test_the_snippet_moves_the_ball(client, start_node, domain, tmp_path):
    """To z = 0.5, each time: what it waits for is all that it needs."""
    (tmp_path / "my_cell.yaml").write_text(SCENE)
    start_node({"scene": tmp_path / "my_cell.yaml"})
    section = (ROOT / "README.md").read_text().split("## The node in ten lines\n", 1)[1]
    block = re.search(r"```python\n(.*?)```", section, re.S)
    assert block is not None
    for height in (0.5, 0.75):
        code = block[1].replace("z=0.5", f"z={height}")
        subprocess.run(
            [sys.executable, "-c", code], env=environment(domain), check=True, timeout=200
        )

        def is_there(height=height):
            pose = client.call("GetPoseInWorld", frames=["objects/ball"]).poses[0]
            return pose.position.z == pytest.approx(height)

        wait_until(is_there, f"the ball at {height}")
