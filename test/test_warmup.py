import os
import subprocess
import sys

import pytest

_CODE = """
from scene_graph_ros.geometry.compiled import kernel
from scene_graph_ros.warmup import ask_everything
ask_everything()
print(kernel.compilation_count())
"""


@pytest.mark.skipif(os.environ.get("NUMBA_DISABLE_JIT") == "1", reason="there are no kernels")
@pytest.mark.timeout(600)
def test_no_query_compiles_after_the_warm_up():
    """Once warmed up, a new process that asks every query loads all kernels and compiles none."""
    warm = [sys.executable, "-m", "scene_graph_ros.warmup"]
    subprocess.run(warm, check=True, capture_output=True)
    done = subprocess.run(
        [sys.executable, "-c", _CODE], check=True, capture_output=True, text=True
    )
    assert int(done.stdout) == 0
