"""Write compiled kernels to one file: ``python -m scene_graph_ros.warmup.pack FILE``.

For wheels, which bring them along. ``NUMBA_CPU_NAME`` names the baseline of processors that they
are for; missing kernels are compiled first.
"""

from __future__ import annotations

import argparse
import importlib
from pathlib import Path
import sys

from scene_graph_ros.geometry.compiled.pack_writer import pack_kernels
from scene_graph_ros.warmup.__main__ import main as compile_groups
from scene_graph_ros.warmup.groups import GROUPS, MAIN

__all__ = ["main"]


def main(arguments: list[str] | None = None) -> int:
    """Run the command line; return the exit code."""
    parser = argparse.ArgumentParser(
        prog="python -m scene_graph_ros.warmup.pack", description=__doc__
    )
    parser.add_argument("file", type=Path)
    parser.add_argument("--groups", nargs="+", choices=list(GROUPS), default=list(GROUPS))
    options = parser.parse_args(arguments)
    exit_code = compile_groups(options.groups)
    if exit_code != 0:
        return exit_code
    for name in options.groups:
        for task in GROUPS[name].tasks:
            importlib.import_module(task.partition(":")[0])
    package = f"{GROUPS[MAIN].__module__.partition('.')[0]}."
    modules = [name for name in sys.modules if name.startswith(package)]
    count = pack_kernels(options.file, modules, options.groups)
    size = options.file.stat().st_size / 1e6
    sys.stdout.write(f"{options.file}: {count} kernels, {size:.1f} MB\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
