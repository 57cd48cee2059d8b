"""With uncompiled kernels, which have no addresses, clouds are as good as their balls, too."""

import os
from pathlib import Path
import subprocess
import sys

TEST = Path(__file__).parents[2]
SCRIPT = """
import sys
from pathlib import Path
import numpy as np
from test_clouds import Cell, ring

rng = np.random.default_rng(4)
points, radii = ring(rng, 20, 0.01)
q = rng.uniform(-2.0, 2.0, (8, 2))
answers = []
for as_spheres in (False, True):
    cell = Cell(Path(sys.argv[1]), points, radii, padding=0.03, as_spheres=as_spheres)
    checker = cell.checker
    clearances = checker.calc_robot_clearances(q, 0.2)
    answers.append((
        checker.check_configs_collision_free(q).tolist(),
        [each.name for each in checker.classify_body_collisions(q[0])],
        [round(each.distances.min(initial=9.0), 9) for each in clearances],
        [each.status.name for each in checker.measure_edges(np.stack([q[:3], q[3:6]], axis=1))],
    ))
assert answers[0] == answers[1], answers
assert set(answers[0][0]) == {False, True}
"""


def test_clouds_are_measured_without_compiled_kernels(tmp_path):
    """Configurations, what collides, clearances and edges are as with each ball as a geometry."""
    folders = TEST.parent, TEST / "support", Path(__file__).parent
    environment = {
        **os.environ,
        "NUMBA_DISABLE_JIT": "1",
        "PYTHONPATH": os.pathsep.join([*map(str, folders), os.environ.get("PYTHONPATH", "")]),
    }
    command = [sys.executable, "-W", "ignore", "-c", SCRIPT, str(tmp_path)]
    done = subprocess.run(
        command, env=environment, capture_output=True, text=True, timeout=240, check=False
    )
    assert done.returncode == 0, done.stderr
