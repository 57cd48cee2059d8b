"""Division as kernels have it, also where they are not compiled."""

import numba.core.config as numba_config
import numpy as np

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel

__all__ = ["reciprocal"]

if numba_config.DISABLE_JIT:

    def reciprocal(number):
        """Return 1 / number, infinite for 0 as numpy's; numbers of Python would raise."""
        with np.errstate(divide="ignore"):
            return np.float64(1.0) / number

else:

    @inlined_kernel
    def reciprocal(number):
        """Return 1 / number, infinite for 0."""
        return 1.0 / number
