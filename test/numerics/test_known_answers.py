"""Answers that pass BLAS or a solver keep to their stated errors, with one thread or two."""

import os
from pathlib import Path
import subprocess
import sys

import pytest

_SCRIPT = Path(__file__).with_name("known_answers.py")


@pytest.mark.parametrize("arguments", [(), ("--off", "1e-12")])
@pytest.mark.parametrize("threads", ["1", "2"])
def test_known_answers_do_not_depend_on_threads_or_last_digits(threads, arguments):
    """Regions, curved sets, plans and trajectories; `make same-everywhere` asks for more."""
    environment = os.environ | {"OPENBLAS_NUM_THREADS": threads}
    done = subprocess.run(
        [sys.executable, str(_SCRIPT), *arguments],
        env=environment,
        stdout=subprocess.PIPE,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout
