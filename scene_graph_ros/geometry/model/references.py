"""How many references an array has that a local variable holds, and nobody else."""

from __future__ import annotations

import sys

import numpy as np

__all__ = ["UNSHARED"]


def _references_of_a_local() -> int:
    array = np.empty(1)
    return sys.getrefcount(array)


UNSHARED = _references_of_a_local()
"""What ``sys.getrefcount(array)`` says of it: 2 up to Python 3.13, whose calls take a reference to
their argument; interpreters that lend it say 1. To take such an array for free would be wrong."""
