"""A path that was planned, to be shown and proven again."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

__all__ = ["PlannedPath"]


@dataclass(frozen=True, eq=False)
class PlannedPath:
    """A path of the robots of a scene, or a trajectory along one, as an action found it.

    ``configurations`` ``(n, nq)`` are of the positions ``position_names``, of which ``moving``
    ``(k,)`` were to move. ``curves`` ``(n - 1, m, nq)`` are the control points of the curves from
    each to the next. A trajectory passes them at ``times`` ``(n,)``, s. Paddings in metres.
    From configuration ``free_from`` on it was free; before, it leads out of a collision.
    """

    goal_id: bytes
    configurations: NDArray[np.float64]
    curves: NDArray[np.float64]
    times: NDArray[np.float64] | None
    position_names: tuple[str, ...]
    moving: NDArray[np.intp]
    environment_padding: float
    self_padding: float
    free_from: int = 0
