"""Convex sets cost nothing where nobody asks for them."""

import subprocess
import sys

_CODE = """
import sys
import scene_graph_ros.geometry
sets = ("scene_graph_ros.geometry.optimization", "scene_graph_ros.convex")
print([name for name in sys.modules if name.startswith(sets)])
from scene_graph_ros.geometry.optimization import *
late = ("scipy.spatial", "scipy.optimize", "scipy.sparse", "clarabel")
print([name for name in sys.modules if name.startswith(late)])
"""


def test_importing_the_core_imports_no_sets():
    """Nor do sets import scipy's qhull, which only conversions and volumes need, or solvers."""
    command = [sys.executable, "-c", _CODE]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout.split() == ["[]", "[]"]
