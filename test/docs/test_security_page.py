"""The page on security states the limits that the code has."""

from pathlib import Path
import re

from msg_adapters.renderers import MAX_REQUESTED_SAMPLES
from scene_graph_ros.geometry import files
from scene_graph_ros.geometry.meshes import promises, textures
from scene_graph_ros.geometry.shapes import voxel_runs
from scene_graph_ros.node.runtime.parameters import defaults
from scene_graph_ros.node.world import voxel_limits
from scene_graph_ros.planning.constraints import link_constraints
from scene_graph_ros.scene_files import yaml_document
from scene_graph_ros.views.browser import (
    assets,
    channels,
    connections,
    foxglove_talk,
    listener,
    server,
    waiting,
)

ROOT = Path(__file__).parents[2]
CONSTANTS = {
    "MAX_MESH_BYTES": files.MAX_MESH_BYTES,
    "MAX_TEXT_BYTES": files.MAX_TEXT_BYTES,
    "MAX_SECONDS": files.MAX_SECONDS,
    "MAX_VALUES": yaml_document.MAX_VALUES,
    "MAX_CORNERS": promises.MAX_CORNERS,
    "MAX_TEXELS": textures.MAX_TEXELS,
    "MOST_CONSTRAINTS": link_constraints.MOST_CONSTRAINTS,
    "MOST_IN_RUNS": voxel_runs.MOST_IN_RUNS,
    "MOST_IN_SCENE": voxel_limits.MOST_IN_SCENE,
}


def test_the_limits_are_those_of_the_code():
    """Each row has the value of its parameter or constant, and each `max_` parameter a row."""
    text = (ROOT / "docs" / "security.md").read_text()
    rows = dict(re.findall(r"^\| `(\w+)` \| (\d+)(?: \w+)? \|", text, re.MULTILINE))
    values = {**defaults(), **CONSTANTS}
    assert {name: float(value) for name, value in rows.items()} == {
        name: float(values[name]) for name in rows
    }
    limits = {name for name in defaults() if name.startswith("max_")} | set(CONSTANTS)
    assert limits <= set(rows)


def test_the_limit_of_files_is_that_of_the_code():
    """Of a mesh that a client fetches, in MiB."""
    text = " ".join((ROOT / "docs" / "browser.md").read_text().split())
    assert f"up to {assets.MAX_ASSET_BYTES >> 20} MiB each" in text


def test_the_limits_of_renderers_are_those_of_the_code():
    """Samples, and surfaces on a path, that requests may ask for."""
    text = " ".join((ROOT / "docs" / "security.md").read_text().split())
    most = MAX_REQUESTED_SAMPLES
    assert f"trace {most} samples of a pixel at most, and {most // 16} surfaces on a path" in text


def test_the_limits_of_the_browser_are_those_of_the_code():
    """Pages, connections, and what one of them may send."""
    text = " ".join((ROOT / "docs" / "security.md").read_text().split())
    assert (
        f"{server.MAX_PAGES} pages, and {connections.MAX_CONNECTIONS} connections in all, "
        "at a time; "
        f"{server._OPEN_SECONDS:g} s for a request, {server._MAX_WISH_BYTES} bytes for a message, "
        f"{server._MAX_WISHES_PER_SECOND:g} messages a second"
    ) in text
    assert (
        f"for Foxglove {server._MAX_REQUEST_BYTES // 1024} KiB, and "
        f"{foxglove_talk._REQUESTS_AT_ONCE:g} messages at once, then "
        f"{foxglove_talk._REQUESTS_PER_SECOND:g} a second"
    ) in text
    assert (
        f"{connections._FRAMES_AT_ONCE:g} frames at once, then "
        f"{connections._FRAMES_PER_SECOND:g} a second"
    ) in text
    assert (
        f"{listener._AT_ONCE:g} connections of one address at once, then "
        f"{listener._PER_SECOND:g} a second"
    ) in text
    assert f"{listener._RESERVED} file handles are left" in text
    assert f"{waiting.MOST_WAITING >> 20} MiB wait for all clients together" in text
    assert (
        f"{assets.FRAGMENT >> 10} KiB of it are read when those before have gone out, "
        f"{int(foxglove_talk._FILE_BYTES_PER_SECOND) >> 20} MiB a second for all clients; after "
        f"{foxglove_talk._FILES_AT_ONCE:g} requests for files "
        f"{foxglove_talk._FILES_PER_SECOND:g} a second of each"
    ) in text
    assert f"{channels._MOST_WAITING >> 20} MiB" in text
    assert connections._STUCK_SECONDS == 5.0
    assert "takes nothing for five to ten seconds" in text
