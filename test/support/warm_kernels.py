"""Which kernels were loaded or compiled by this process, and running what the set-up runs."""

import importlib

from scene_graph_ros.geometry.compiled import kernel
from scene_graph_ros.warmup.groups import GROUPS


def called_kernels():
    """Return (module, name, types) of all kernels that were called from Python so far.

    Where the cache has them they were loaded, else compiled; what they call themselves is part
    of them and not listed.
    """
    return {
        (dispatcher.__module__, dispatcher.__name__, str(types))
        for dispatcher in kernel._dispatchers
        for counts in (dispatcher.stats.cache_hits, dispatcher.stats.cache_misses)
        for types in counts
    }


def run_tasks(*groups):
    """Run in this process what compiles these groups, all of them by default."""
    for name in groups or GROUPS:
        _run(GROUPS[name].tasks)


def run_checks(*groups):
    """Ask what these groups are checked with."""
    for name in groups or GROUPS:
        _run(GROUPS[name].checks)


def _run(functions):
    for each in functions:
        module, function = each.split(":")
        getattr(importlib.import_module(module), function)()
