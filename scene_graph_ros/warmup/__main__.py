"""Compile kernels once: ``python -m scene_graph_ros.warmup``.

Without arguments, those of the main job and of points; those of a capability are compiled by its
name, by --all, or by a node when a scene first asks for them. The big entry points are compiled in
processes of their own, side by side, each kernel by the first that needs it; then a process asks
everything, which must find nothing left to compile. A second call does only that.
"""

from __future__ import annotations

import argparse
import os
import sys
import time

from scene_graph_ros.geometry.compiled.cache import cache_problem, cache_root
from scene_graph_ros.warmup.compiler import Compiler, CompilingError, Progress
from scene_graph_ros.warmup.groups import GROUPS, MAIN, POINTS

__all__ = ["main", "warm_up"]

_TOLD_FROM = 0.05
"""The share of the work from which on the bar says how long the other will take."""


def warm_up(names: list[str], processes: int | None = None) -> list[str]:
    """Compile the groups of these names under a progress bar; see `Compiler.run`.

    Args:
        names: of groups; the main one has to be ready or among them.
        processes: how many to use; by default one per processor, and one for when one waits
            for a kernel that another compiles.

    """
    from tqdm import tqdm

    groups = [GROUPS[name] for name in names]
    compiler = Compiler(groups, processes=processes or 1 + (os.cpu_count() or 1))
    # The time left is that of the mean so far: what comes next is no quicker than what has been.
    # The first kernels of a process wait for its imports, and say nothing of the time.
    form = "{l_bar}{bar}| {elapsed}<{remaining}{postfix}"
    begun = form.replace("<{remaining}", "")
    with tqdm(
        total=100, desc="compiling kernels", bar_format=begun, smoothing=0.0, dynamic_ncols=True
    ) as bar:

        def tell(progress: Progress) -> None:
            kernels = f"{progress.done} of {progress.total} kernels"
            bar.set_postfix_str(kernels, refresh=False)
            bar.bar_format = begun if progress.share < _TOLD_FROM else form
            bar.update(100.0 * progress.share - bar.n)

        late = compiler.run(tell)
        bar.update(100.0 - bar.n)
        bar.refresh()
    return late


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m scene_graph_ros.warmup",
        description=__doc__,
        epilog="Groups:\n" + "\n".join(f"  {g.name:12}{g.what}" for g in GROUPS.values()),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "groups", nargs="*", metavar="group", help="see below; main and points by default"
    )
    parser.add_argument("--all", action="store_true", help="compile all groups")
    parser.add_argument("--processes", type=int, help="how many to compile with")
    return parser


def main(arguments: list[str] | None = None) -> int:
    """Run the command line; return the exit code."""
    parser = _parser()
    options = parser.parse_args(arguments)
    unknown = [name for name in options.groups if name not in GROUPS]
    if unknown:
        parser.error(f"no group is called {', '.join(unknown)}; there are {', '.join(GROUPS)}")
    # What a capability adds is built on the main job's.
    asked = options.groups or [POINTS]
    names = list(GROUPS) if options.all else list(dict.fromkeys([MAIN, *asked]))
    problem = cache_problem()
    if problem:
        sys.stderr.write(f"{problem}\n")
        return 1
    start = time.perf_counter()
    try:
        late = warm_up(names, options.processes)
    except CompilingError as error:
        sys.stderr.write(f"{error}\n")
        return 1
    elapsed = time.perf_counter() - start
    note = f" ({', '.join(late)} late)" if late else ""
    sys.stdout.write(
        f"kernels ({', '.join(names)}) are ready in {cache_root()}{note}: {elapsed:.1f} s\n"
    )
    return 0


if __name__ == "__main__":
    sys.exit(main())
