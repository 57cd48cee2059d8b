"""A function of NumPy arrays and its Jacobian, as CasADi calls it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.planning.optimal_control.casadi_backend import get_casadi

__all__ = ["NumpyFunction"]

Values = Sequence[NDArray[np.float64]]


class NumpyFunction:
    """A function of vectors to a vector, with first derivatives and no second ones.

    ``value`` takes arrays ``(n_i,)`` and returns ``(m,)``, ``jacobian`` a matrix ``(m, n_i)`` for
    each. CasADi loses errors that are raised inside: ``error`` keeps them.
    """

    def __init__(
        self,
        name: str,
        sizes: Sequence[int],
        rows: int,
        value: Callable[..., NDArray[np.float64]],
        jacobian: Callable[..., Values],
    ) -> None:
        self.error: BaseException | None = None
        ca = get_casadi()
        owner = self
        shapes = [(rows, size) for size in sizes]

        class _Called(ca.Callback):  # type: ignore[name-defined]
            """The callback of CasADi."""

            def __init__(self, label: str, outer: bool) -> None:
                super().__init__()
                self.outer = outer
                self.kept: Any = None
                self.construct(label, {"enable_fd": False})

            def get_n_in(self) -> int:
                return len(sizes) + (0 if self.outer else 1)

            def get_n_out(self) -> int:
                return 1 if self.outer else len(sizes)

            def get_sparsity_in(self, i: int) -> Any:
                return ca.Sparsity.dense(sizes[i] if i < len(sizes) else rows, 1)

            def get_sparsity_out(self, i: int) -> Any:
                return ca.Sparsity.dense(*((rows, 1) if self.outer else shapes[i]))

            def has_jacobian(self) -> bool:
                return self.outer

            def get_jacobian(self, label: str, *_: Any) -> Any:
                self.kept = _Called(label, False)
                return self.kept

            def eval(self, given: Any) -> Any:
                arrays = [np.array(each, dtype=np.float64).ravel() for each in given[: len(sizes)]]
                try:
                    if self.outer:
                        return [ca.DM(value(*arrays))]
                    return [ca.DM(np.asarray(part)) for part in jacobian(*arrays)]
                except BaseException as error:
                    owner.error = error
                    raise

        self.function = _Called(name, True)
        """What is called with expressions of MX, or numbers."""

    def raise_error(self) -> None:
        """Raise the error that was raised inside CasADi, if there was one."""
        if self.error is not None:
            error, self.error = self.error, None
            raise error
