"""The command ``scene_graph_node``: signals are obeyed from here on, before the long imports."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NoReturn

from scene_graph_ros.node.runtime.ending import Ending

__all__ = ["main"]


def main(args: Sequence[str] | None = None) -> NoReturn:
    """Run the node until SIGINT or SIGTERM, and end the process."""
    ending = Ending()
    from scene_graph_ros.node.process import run

    ending.exit(run(args, ending))
