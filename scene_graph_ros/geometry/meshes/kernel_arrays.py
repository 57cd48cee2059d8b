"""Arrays as kernels are compiled for."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["for_kernels"]


def for_kernels(array: NDArray[Any]) -> NDArray[Any]:
    """Return an array, or a copy of one that is not contiguous or must not be written to.

    For those a kernel would be compiled anew. It only reads what it is given.
    """
    return np.require(array, requirements=("C", "A", "W"))
