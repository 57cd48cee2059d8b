"""The page on cameras: its example prints what it shows, its limits are the code's."""

from pathlib import Path
import re
import subprocess
import sys

from scene_graph_ros.geometry.perception import RenderLabel
from scene_graph_ros.geometry.perception.camera import MAX_PIXELS
from scene_graph_ros.geometry.perception.exact.screen import TIE

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "cameras.md").read_text()


def test_the_example_prints_what_the_page_shows():
    """The lines run as they stand."""
    code, shown = re.search(r"```python\n(.*?)```\n\n```\n(.*?)```", PAGE, re.S).groups()
    command = [sys.executable, "-c", code]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    assert done.stdout == shown


def test_the_numbers_are_those_of_the_code():
    """Limits of labels, pixels and of what counts as one place."""
    assert f"from 0 to {RenderLabel.MAX_FREE}" in PAGE
    assert "8192 x 8192" in PAGE
    assert MAX_PIXELS == 8192 * 8192
    assert f"within {1.0 - TIE:.1e} of the depth" in PAGE


def test_the_camera_of_the_page_is_that_of_scene_files():
    """Both pages show the same one."""
    (camera,) = re.findall(r"```yaml\n(cameras:.*?)```", PAGE, re.S)
    assert f"```yaml\n{camera}```" in (ROOT / "docs" / "scene_files.md").read_text()
