"""A function that IPOPT, run by CasADi, calls at each iteration, and that may stop it."""

from __future__ import annotations

from collections.abc import Callable
import importlib
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

__all__ = ["IterationCallback", "iteration_callback"]


class IterationCallback(Protocol):
    """CasADi's option ``iteration_callback``; it has to live as long as its solver runs."""

    def raise_error(self) -> None:
        """Raise, once, the error that the function raised: CasADi lets none through."""


def iteration_callback(
    look: Callable[[NDArray[np.float64], float, NDArray[np.float64]], bool],
    *,
    x: int,
    g: int,
    p: int,
) -> IterationCallback:
    """Return a callback for a program of ``x`` variables, ``g`` rows and ``p`` parameters.

    ``look`` gets the iterate ``(x,)``, its cost and its rows ``(g,)``, and returns whether IPOPT
    should stop. An error in it stops IPOPT, too, and waits for `raise_error`.
    """
    ca: Any = importlib.import_module("casadi")
    names = [ca.nlpsol_out(k) for k in range(ca.nlpsol_n_out())]
    shown = [names.index(name) for name in ("x", "f", "g")]
    sizes = {"x": x, "lam_x": x, "g": g, "lam_g": g, "f": 1, "lam_p": p}

    class Callback(ca.Callback):
        """CasADi's view of ``look``."""

        def __init__(self) -> None:
            super().__init__()
            self._error: BaseException | None = None
            self.construct("iteration", {})

        def get_n_in(self) -> int:
            return len(names)

        def get_n_out(self) -> int:
            return 1

        def get_name_in(self, i: int) -> str:
            return str(names[i])

        def get_sparsity_in(self, i: int) -> Any:
            size = sizes[names[i]]
            return ca.Sparsity.dense(size, 1 if size else 0)

        def eval(self, given: Any) -> Any:
            try:
                point, cost, rows = (given[k].full().ravel() for k in shown)
                return [int(look(point, float(cost[0]), rows))]
            except BaseException as error:  # noqa: BLE001 - raised again when the solver ended
                self._error = error
                return [1]

        def raise_error(self) -> None:
            if self._error is not None:
                error, self._error = self._error, None
                raise error

    return Callback()
