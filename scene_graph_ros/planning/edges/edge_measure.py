"""The measure of an edge between two configurations."""

from __future__ import annotations

from dataclasses import dataclass
import enum

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.model.paths import GeometryPair
from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.geometry.spatial.sums import length
from scene_graph_ros.planning.edges.curves import point_on_curve
from scene_graph_ros.planning.edges.edge_proofs import EdgeProofs
from scene_graph_ros.planning.edges.edge_stretches import COLLIDES, FREE, UNDECIDED
from scene_graph_ros.planning.pairs.check_kernels import NO_PAIR
from scene_graph_ros.planning.pairs.checker_plan import CheckerPlan

__all__ = ["EdgeMeasure", "EdgeStatus", "measure_of"]


class EdgeStatus(enum.Enum):
    """The status of an edge."""

    FREE = FREE
    """Proven: no configuration on it collides."""
    COLLIDES = COLLIDES
    """There is a configuration on it that collides."""
    UNDECIDED = UNDECIDED
    """Somewhere the clearance is below the tolerance, so that it counts as not free."""


@one_line()
@dataclass(frozen=True, eq=False)
class EdgeMeasure:
    """How far an edge from q1 to q2 is free.

    ``distance`` is that of q1 and q2 by the checker's provider; of curves it is Euclidean.
    ``alpha`` is the largest value found for which
    all configurations from q1 up to it are proven free, ``q1 + alpha (q2 - q1)`` where the edge is
    straight: 1 where all are, negative where q1 collides.
    ``least_clearance`` (m) is a lower bound of all pairs' distances beyond their padding, 0 unless
    the edge is free. Where it collides or is undecided, ``configuration``, which is ``at`` from 0
    to 1 on the edge, shows it, and ``pair`` are the two geometries, with their names.
    """

    distance: float
    alpha: float
    status: EdgeStatus
    least_clearance: float
    configuration: NDArray[np.float64] | None
    pair: GeometryPair | None
    at: float | None

    @property
    def completely_free(self) -> bool:
        """Whether the whole edge is free."""
        return self.status is EdgeStatus.FREE

    @property
    def proven(self) -> bool:
        """Whether the whole edge is proven free: always where it is free, as no samples decide."""
        return self.completely_free

    @property
    def partially_free(self) -> bool:
        """Whether q1 is free, so that ``alpha`` tells up to where."""
        return self.alpha >= 0.0

    def alpha_or(self, default_value: float) -> float:
        """Return ``alpha``, or another value where q1 collides."""
        return self.alpha if self.partially_free else default_value


def measure_of(
    plan: CheckerPlan, edge: NDArray[np.float64], proofs: EdgeProofs, row: int
) -> EdgeMeasure:
    """Return the measure of an edge ``(m, nq)`` by its row of proofs."""
    status, pair = int(proofs.statuses[row]), int(proofs.pairs[row])
    alpha, t, least, _ = proofs.numbers[row].tolist()
    is_free = status == FREE
    return EdgeMeasure(
        distance=length(edge[-1] - edge[0]),
        alpha=-1.0 if status == COLLIDES and t == 0.0 else alpha,
        status=EdgeStatus(status),
        least_clearance=max(least, 0.0) if is_free else 0.0,
        configuration=None if is_free else point_on_curve(plan.tree, edge, t),
        pair=None if pair == NO_PAIR else plan.ids(pair),
        at=None if is_free else t,
    )
