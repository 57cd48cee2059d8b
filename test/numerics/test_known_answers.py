"""Answers do not depend on the processor: bits of kernels alone, stated errors of the others."""

from concurrent.futures import ThreadPoolExecutor
import os
from pathlib import Path
import subprocess
import sys

import pytest

from tools.same_everywhere import variants

_SCRIPT = Path(__file__).with_name("known_answers.py")
_BITS = Path(__file__).with_name("same_bits.py")


def _bits(variables):
    done = subprocess.run(
        [sys.executable, str(_BITS)],
        env=os.environ | variables,
        stdout=subprocess.PIPE,
        text=True,
        check=True,
    )
    return done.stdout.splitlines()


def test_bits_do_not_depend_on_the_libraries_kernels():
    """Of BLAS, NumPy and the C library: the oldest of each, which other processors have."""
    others = {}
    for variant in variants([], None):
        if not variant.left_out and variant.name != "this processor":
            others |= variant.variables
    assert {"OPENBLAS_CORETYPE", "NPY_DISABLE_CPU_FEATURES", "GLIBC_TUNABLES"} <= others.keys()
    with ThreadPoolExecutor() as pool:
        here, there = pool.map(_bits, ({}, others | {"OPENBLAS_CORETYPE": "Nehalem"}))
    assert here == there
    assert len(here) > 8


@pytest.mark.parametrize("threads", ["1", "2"])
def test_known_answers_do_not_depend_on_threads_or_last_digits(threads):
    """Regions, curved sets, plans and trajectories; `make same-everywhere` asks for more."""
    environment = os.environ | {"OPENBLAS_NUM_THREADS": threads}
    done = subprocess.run(
        [sys.executable, str(_SCRIPT), "--off", "0", "1e-12"],
        env=environment,
        stdout=subprocess.PIPE,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout
