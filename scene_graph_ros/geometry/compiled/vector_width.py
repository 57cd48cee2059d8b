"""Let the compiler compute as many numbers in step as the processor's widest registers hold.

For processors that have them, the compiler prefers registers of half the width, which were faster
in programs with little such code.
"""

from numba.core import types
import numba.core.config as numba_config
from numba.extending import intrinsic

__all__ = ["use_widest_vectors"]

_ATTRIBUTE = '"prefer-vector-width"="512"'

if numba_config.DISABLE_JIT:

    def use_widest_vectors():
        """Do nothing: nothing is compiled."""

else:

    @intrinsic
    def use_widest_vectors(typing_context):
        """Have the loops of the kernel that calls this computed with the widest registers.

        It takes no time. The kernels that it calls have to ask for themselves.
        """

        def lower(context, builder, signature, arguments):
            # llvmlite knows the names of attributes without a value only.
            set.add(builder.function.attributes, _ATTRIBUTE)
            return context.get_dummy_value()

        return types.void(), lower
