"""A group of two kernels, of which the second is not compiled before a file says so."""

from __future__ import annotations

import os
from pathlib import Path
import sys

from spinning import wait_until

from scene_graph_ros.geometry.compiled.kernel import kernel
from scene_graph_ros.warmup.groups import KernelGroup

FOLDER = "SLOW_KERNELS"
"""The variable that names the folder of the files."""


@kernel
def twice(x):
    """Double a number."""
    return x + x


@kernel
def thrice(x):
    """Treble a number."""
    return x + x + x


def compile_slowly():
    """Compile one kernel, write this process's id, and the other when the file is there."""
    folder = Path(os.environ[FOLDER])
    assert twice(2) == 4
    (folder / "begun.part").write_text(str(os.getpid()))
    (folder / "begun.part").rename(folder / "begun")
    wait_until((folder / "go").exists, "the test", timeout=300.0)
    assert thrice(2) == 6


def fail():
    """Compile nothing."""
    sys.exit("no compiler today")


def group(name="slow", function="compile_slowly"):
    """Return a group that is compiled by one of these functions."""
    return KernelGroup(name, "slow things", 2, (f"slow_kernels:{function}",))
