import os
from pathlib import Path
import re
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


_OUTSIDE = """
import importlib
from scene_graph_ros.warmup import ask_everything
modules = [importlib.import_module(name) for name in {names!r}]
ask_everything()
for module in modules:
    for name, value in vars(module).items():
        if hasattr(value, "nopython_signatures") and not value.nopython_signatures:
            print(module.__name__, name)
"""
_ROOT = Path(__file__).parents[1]


@pytest.mark.skipif(os.environ.get("NUMBA_DISABLE_JIT") == "1", reason="there are no kernels")
def test_the_warm_up_has_every_kernel_that_is_called_from_outside_the_core():
    """Whoever calls a kernel directly, as what takes poses in does, finds it compiled."""
    importers = re.compile(r"from scene_graph_ros\.geometry\.[\w.]*(kernels|poses) import")
    files = [
        path.relative_to(_ROOT)
        for folder in ("scene_graph_ros/node", "scene_graph_ros/scene_files", "msg_adapters")
        for path in (_ROOT / folder).rglob("*.py")
        if importers.search(path.read_text())
    ]
    assert files
    names = [".".join(path.with_suffix("").parts) for path in files]
    done = subprocess.run(
        [sys.executable, "-c", _OUTSIDE.format(names=names)],
        check=True,
        capture_output=True,
        text=True,
    )
    assert done.stdout == ""
