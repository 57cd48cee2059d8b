"""Ctrl-C while a kernel is compiled or loaded leaves a process that answers."""

from pathlib import Path
import subprocess
import sys

import pytest
from searching import times

PROGRAM = """
import os, signal, sys
import numpy as np
sys.path.append(sys.argv[1])
from interrupting import instruction_count, interrupted_at
from scene_graph_ros.geometry import *
from scene_graph_ros.geometry.spatial.poses import as_poses, inverse

TURNED = np.array([[0.0, 0, 1, 3], [1, 0, 0, 4], [0, 1, 0, 5], [0, 0, 0, 1]])

def kernel():
    return inverse(as_poses([TURNED], "X"))[0] @ TURNED

def query():  # Of a ball and a cube whose face is at x = 0.75 there is 0.25 inside the other.
    graph = SceneGraph()
    source = graph.register_source("s")
    for k, shape in enumerate((Sphere(1.0), Box(1, 1, 1), Sphere(0.5))):
        frame = graph.register_frame(source, GeometryFrame(f"f{k}"))
        body = GeometryInstance(np.eye(4), shape, f"g{k}")
        body.set_proximity_properties(ProximityProperties())
        graph.register_geometry(source, frame, body)
    context = graph.create_default_context()
    poses = np.tile(np.eye(4), (3, 1, 1))
    poses[1:, 0, 3] = 1.25, 9.0
    context.set_frame_poses(source, poses)
    return graph.query_object(context).compute_point_pair_penetration().depth

ask, expected = {"kernel": (kernel, np.eye(4)), "query": (query, [0.25])}[sys.argv[4]]

def in_child(begin):
    child = os.fork()  # from a process in which no kernel was called
    if child == 0:
        begin()
        os._exit(0 if np.array_equal(ask(), expected) else 1)
    return os.waitpid(child, 0)[1]

def alarmed(seconds):
    def ring(number, frame):
        raise KeyboardInterrupt
    signal.signal(signal.SIGALRM, ring)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        ask()
    except KeyboardInterrupt:
        pass
    signal.setitimer(signal.ITIMER_REAL, 0.0)

read, write = os.pipe()
in_child(lambda: os.write(write, str(instruction_count(ask)).encode()))
count = int(os.read(read, 20))
tries, signals = int(sys.argv[2]), int(sys.argv[3])
wrong = []
for k in range(tries):
    at = (2 * k + 1) * count // (2 * tries)
    if in_child(lambda: interrupted_at(ask, at)):
        wrong.append(f"instruction {at}")
for k in range(signals):
    if in_child(lambda: alarmed(0.001 + 0.4 * k / signals)):
        wrong.append(f"signal {k}")
print("instructions:", count, "wrong:", wrong)
sys.exit(bool(wrong))
"""


@pytest.mark.search
@pytest.mark.compiled
@pytest.mark.parametrize("asked", ["kernel", "query"])
def test_an_interrupt_in_what_is_asked_first_leaves_what_the_next_needs(asked):
    """By instructions all through the first call of a kernel or a query, and by a real signal."""
    tries = 3 if times(1) == 1 else times(6)
    support = str(Path(sys.modules["searching"].__file__).parent)
    command = [sys.executable, "-c", PROGRAM, support, str(tries), str(times(3)), asked]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, (done.stdout, done.stderr[-2000:])
