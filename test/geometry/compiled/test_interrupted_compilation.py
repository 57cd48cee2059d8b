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
from scene_graph_ros.geometry.spatial.poses import as_poses, inverse

TURNED = np.array([[0.0, 0, 1, 3], [1, 0, 0, 4], [0, 1, 0, 5], [0, 0, 0, 1]])

def ask():
    return inverse(as_poses([TURNED], "X"))[0] @ TURNED

def in_child(begin):
    child = os.fork()  # from a process in which no kernel was called
    if child == 0:
        begin()
        os._exit(0 if np.array_equal(ask(), np.eye(4)) else 1)
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
tries = int(sys.argv[2])
wrong = []
for k in range(tries):
    at = (2 * k + 1) * count // (2 * tries)
    if in_child(lambda: interrupted_at(ask, at)):
        wrong.append(f"instruction {at}")
    if in_child(lambda: alarmed(0.001 + 0.4 * k / tries)):
        wrong.append(f"signal {k}")
print("instructions:", count, "wrong:", wrong)
sys.exit(bool(wrong))
"""


@pytest.mark.search
@pytest.mark.compiled
def test_an_interrupt_in_the_first_kernel_leaves_what_the_next_needs():
    """By instructions all through the first call of a kernel, and by a real signal."""
    support = str(Path(sys.modules["searching"].__file__).parent)
    command = [sys.executable, "-c", PROGRAM, support, str(times(4))]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, (done.stdout, done.stderr[-2000:])
