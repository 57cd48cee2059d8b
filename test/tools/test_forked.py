"""Nodes that tests fork end with them, also where nobody can tell them to."""

import os
from pathlib import Path
import signal
import subprocess
import sys

from spinning import wait_until

ROOT = Path(__file__).parents[2]
STARTS_ONE = """
import sys
from pathlib import Path
sys.path.insert(0, "test/support")
from forked import ForkedProcess
if __name__ == "__main__":
    sleeping = "import signal; print('awake'); signal.pause()"
    process = ForkedProcess(sleeping, [], {}, Path(sys.argv[1]))
    print(process.pid, flush=True)
    process.wait()
"""


def is_gone(pid):
    """Tell whether a process has ended."""
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return True
    return False


def test_a_forked_process_ends_with_the_tests(tmp_path):
    """Which are killed, and say no word."""
    log = tmp_path / "log"
    with subprocess.Popen(
        [sys.executable, "-c", STARTS_ONE, str(log)], stdout=subprocess.PIPE, cwd=ROOT, text=True
    ) as tests:
        pid = int(tests.stdout.readline())
        wait_until(lambda: log.exists() and "awake" in log.read_text(), "the forked process")
        tests.send_signal(signal.SIGKILL)
    wait_until(lambda: is_gone(pid), "its end")
