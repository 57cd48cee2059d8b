"""Walks towards a configuration, along which conditions on links hold and nothing collides.

Each step goes straight towards the target and is projected to where the conditions hold (Berenson,
Srinivasa, Ferguson and Kuffner, *Manipulation Planning on Constraint Manifolds*, 2009, section
IV). The straight edge to there is proven; where it is not, steps are halved.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.planning.constraints.held_constraints import HeldConstraints
from scene_graph_ros.planning.constraints.proof_kernels import HELD
from scene_graph_ros.planning.edges.edge_proofs import EdgeProver
from scene_graph_ros.planning.edges.edge_stretches import EdgeRules
from scene_graph_ros.planning.pairs.checker_plan import CheckerPlan
from scene_graph_ros.planning.paths.manifold.projector import Projector
from scene_graph_ros.planning.paths.search.position_space import PositionSpace

__all__ = ["Walk", "Walks"]

Array = NDArray[np.float64]

_FIRST = 0.25
"""Of the longest step of the space: a walk's first step."""

_HALVINGS = 6
"""Of the longest step: a walk whose steps would have to be shorter ends."""

_PROGRESS = 0.1
"""Of a step: how much nearer to the target it has to lead."""

_AWAY = 2.0
"""Times a step: how far a projection may lead."""

_MOST_STEPS = 1000

_PART = 0.5
"""Of the rounding that counts as held: what a search uses up, so that proofs come out alike."""


class Walk(NamedTuple):
    """Where a walk leads."""

    configurations: list[Array]
    """``(nq,)`` each, without where it begins."""
    is_there: bool
    """Whether it leads to the target."""


class Walks:
    """Walks among the configurations at which conditions hold, with edges that are proven."""

    def __init__(
        self,
        plan: CheckerPlan,
        space: PositionSpace,
        held: HeldConstraints,
        moves: NDArray[np.bool_],
        stop: NDArray[np.int64],
    ) -> None:
        self._tree, self.space, self._held, self._stop = plan.tree, space, held, stop
        self._plan, self._projector = plan, Projector(held, moves)
        self._edge = np.empty((1, 2, plan.tree.num_positions))
        self.edges = 0
        """How many were looked at."""

    def prover(self, rules: EdgeRules) -> EdgeProver:
        """Return what proves edges to be free of collisions by some rules."""
        return EdgeProver(self._plan, rules, self._stop)

    def projected(self, q: Array) -> Array | None:
        """Return a configuration near by at which conditions hold with room, or None."""
        return self._projector.projected(q)

    def is_free(self, prover: EdgeProver, a: Array, b: Array) -> bool:
        """Tell whether an edge is proven to hold all conditions, and to be free."""
        self.edges += 1
        self._edge[0, 0], self._edge[0, 1] = a, b
        proofs = self._held.prove(self._edge, part=_PART, stop=self._stop)
        return bool(proofs.answers[0] == HELD) and prover.is_free(a, b)

    def walk(self, prover: EdgeProver, start: Array, target: Array, farthest: float) -> Walk:
        """Walk from a configuration ``(nq,)`` towards another, at most so far (rad and m)."""
        space, found, at = self.space, list[Array](), start
        longest = space.longest_step
        step, gone = _FIRST * longest, 0.0
        far = self._apart(at, target)
        while len(found) < _MOST_STEPS and self._stop[0] == 0:
            end = target + space.turns(at, target)
            if far <= max(step, 1e-12):
                if self.is_free(prover, at, end):
                    return Walk([*found, end], is_there=True)
                step = 0.5 * far
            if step <= longest / 2.0**_HALVINGS:
                break
            near = self._step(prover, at, end, step / far, step)
            if near is None:
                step *= 0.5
                continue
            left = self._apart(near, target)
            if left > far - _PROGRESS * step:
                break
            gone += self._apart(at, near)
            found.append(near)
            at, far = near, left
            if gone >= farthest:
                break
            step = min(2.0 * step, longest)
        return Walk(found, is_there=False)

    def _step(
        self, prover: EdgeProver, at: Array, end: Array, t: float, step: float
    ) -> Array | None:
        """Return where a step leads, or None where it is not proven."""
        near = self._projector.projected(self._tree.interpolate(at, end, min(t, 1.0)))
        if near is None or self._apart(at, near) > _AWAY * step:
            return None
        return near if self.is_free(prover, at, near) else None

    def _apart(self, a: Array, b: Array) -> float:
        return float(self.space.distances(a, b[np.newaxis])[0])
