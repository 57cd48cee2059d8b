"""The cache of compiled kernels, shared by all processes of a user."""

import os
from pathlib import Path
import subprocess
import sys

_MODULE = """
import sys
import time
from numba.core import caching
from scene_graph_ros.geometry import jit

slow_index = caching.IndexDataCacheFile._save_index
def save_slowly(self, overloads):
    time.sleep(1.0)  # so that the processes overlap in saving
    slow_index(self, overloads)
caching.IndexDataCacheFile._save_index = save_slowly

@jit.kernel
def doubled(x):
    return x + x

print(*(doubled(value) for value in eval(sys.argv[1])), jit.compilation_count())
"""


def _start(script: Path, values: str, cache: Path) -> subprocess.Popen[str]:
    environment = os.environ | {
        "SCENE_GRAPH_ROS_KERNEL_CACHE": str(cache),
        "PYTHONPATH": str(Path(__file__).parents[2]),
    }
    command = [sys.executable, str(script), values]
    return subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, text=True)


def _answer(process: subprocess.Popen[str]) -> str:
    answer, _ = process.communicate(timeout=120)
    assert process.returncode == 0
    return answer.strip()


def test_processes_that_compile_one_kernel_at_once_keep_each_others_work(tmp_path):
    """Two types of one kernel, compiled at the same time, are both loaded later."""
    script = tmp_path / "module.py"
    script.write_text(_MODULE)
    both = [_start(script, values, tmp_path / "cache") for values in ("(3,)", "(0.5,)")]
    assert [_answer(process) for process in both] == ["6 1", "1.0 1"]
    assert _answer(_start(script, "(3, 0.5)", tmp_path / "cache")) == "6 1.0 0"
