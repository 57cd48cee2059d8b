"""The page on the core in Python, and the one on the client: what they show is so."""

from pathlib import Path
import re
import subprocess
import sys

import pytest

ROOT = Path(__file__).parents[2]


def test_the_page_prints_what_it_shows():
    """Its blocks, one after the other, print the blocks below them."""
    page = (ROOT / "docs" / "python.md").read_text()
    blocks = re.findall(r"```python\n(.*?)```\n\n```\n(.*?)```", page, re.S)
    assert len(blocks) == 3
    command = [sys.executable, "-c", "".join(code for code, _ in blocks)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.stdout == "".join(shown for _, shown in blocks), done.stderr


def test_the_client_has_what_its_page_calls():
    """Each method and each question that the page names is there."""
    pytest.importorskip("rclpy", reason="no ROS here")
    from scene_graph_ros import client
    from scene_graph_ros.ask import _parser

    page = (ROOT / "docs" / "client.md").read_text()
    called = set(re.findall(r"\bworld\.(\w+)\(", page)) | set(re.findall(r"\| `(\w+)\(", page))
    assert called
    assert called <= set(dir(client.World)) | {"distance", "sources"}
    assert set(re.findall(r"\bmine\.(\w+)\(", page)) <= set(dir(client.Source))
    help_text = _parser().format_help()
    for question in re.findall(r"scene_graph_ros\.ask (?:--\w+ \S+ )?(\w+)", page):
        assert f"    {question} " in help_text or question == "is", question
