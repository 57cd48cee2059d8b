"""The command ``scene_graph_node``: signals are obeyed from here on, before the long imports."""

from __future__ import annotations

from collections.abc import Sequence
import sys
from typing import NoReturn

from scene_graph_ros.node.runtime.ending import Ending
from scene_graph_ros.node.runtime.garbage_collection import start_without

__all__ = ["main"]


def main(args: Sequence[str] | None = None) -> NoReturn:
    """Run the node until SIGINT or SIGTERM, and end the process."""
    ending = Ending()
    start_without()
    try:
        from scene_graph_ros.node.process import run

        code = run(args, ending)
    except Warning as warning:
        sys.stderr.write(
            f"scene_graph: a warning was made an error by PYTHONWARNINGS or -W: {warning}; start "
            "without that\n"
        )
        code = 1
    ending.exit(code)
