"""Tell the compiler which branches are rare.

Such code is laid aside, so that the code that runs lies together. Only where it is really rare,
once in a hundred times or less, is that worth its word: of branches that are taken more often, and
of some that are not, the hint cost as much as it gained.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba.core import types
import numba.core.config as numba_config
from numba.extending import intrinsic

__all__ = ["is_rare"]

_BIT = ir.IntType(1)

if numba_config.DISABLE_JIT:

    def is_rare(condition):
        """Return the condition, which is nearly always False."""
        return condition

else:

    @intrinsic
    def is_rare(typing_context, condition):
        """Return the condition, which is nearly always False."""

        def lower(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            function = builder.module.declare_intrinsic(
                "llvm.expect", (_BIT,), ir.FunctionType(_BIT, [_BIT, _BIT])
            )
            return builder.call(function, [arguments[0], ir.Constant(_BIT, 0)])

        return types.boolean(types.boolean), lower
