"""Ask the node of a workspace a question, and hear what it publishes.

Everything of the project that this process loads must be installed below the folder it is given.
"""

from __future__ import annotations

from pathlib import Path
import sys

import rclpy
from rclpy.node import Node
from rclpy.task import Future

from scene_graph_msgs.msg import ContactArray, Status
from scene_graph_msgs.srv import DescribeScene

_SECONDS = 120.0  # until the node is there; it loads a robot first
_SERVICE = "/scene_graph/describe_scene"
_TOPIC = "/scene_graph/contacts"


def _result(node: Node, future: Future, what: str) -> object:
    rclpy.spin_until_future_complete(node, future, timeout_sec=_SECONDS)
    if not future.done():
        raise SystemExit(f"no {what} within {_SECONDS:g} s")
    return future.result()


def _describe(node: Node) -> None:
    client = node.create_client(DescribeScene, _SERVICE)
    if not client.wait_for_service(_SECONDS):
        raise SystemExit(f"no service {_SERVICE} within {_SECONDS:g} s")
    answer = _result(node, client.call_async(DescribeScene.Request()), f"answer of {_SERVICE}")
    assert isinstance(answer, DescribeScene.Response)
    if answer.status.code != Status.OK:
        raise SystemExit(f"{_SERVICE} answers {answer.status.code}: {answer.status.message}")
    if not answer.geometries:
        raise SystemExit(f"{_SERVICE} describes a scene without geometry")
    counts = f"{len(answer.sources)} sources, {len(answer.frames)} frames"
    print(f"{_SERVICE}: {counts}, {len(answer.geometries)} geometries")


def _hear(node: Node) -> None:
    heard = Future()

    def take(message: ContactArray) -> None:
        if not heard.done():
            heard.set_result(message)

    node.create_subscription(ContactArray, _TOPIC, take, 10)
    message = _result(node, heard, f"message on {_TOPIC}")
    assert isinstance(message, ContactArray)
    print(f"{_TOPIC}: {len(message.points)} contacts at scene version {message.scene_version}")


def _check_origin(workspace: Path) -> None:
    """Fail where a library of the messages was loaded from elsewhere."""
    lines = Path("/proc/self/maps").read_text().splitlines()
    loaded = {Path(line.split()[-1]) for line in lines if "scene_graph_msgs" in line}
    strangers = sorted(str(file) for file in loaded if not file.is_relative_to(workspace))
    if strangers or not loaded:
        raise SystemExit(f"messages of {workspace} are not loaded, but {strangers or 'none'}")
    print(f"messages: {len(loaded)} libraries, all of {workspace}")


if __name__ == "__main__":
    rclpy.init()
    own = rclpy.create_node("workspace_client")
    _describe(own)
    _hear(own)
    _check_origin(Path(sys.argv[1]).resolve())
    rclpy.shutdown()
