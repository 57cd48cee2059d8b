"""Whether paths may begin and end at configurations, and why not."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.model.ids import GeometryId
from scene_graph_ros.planning.checker.collision_checker import SceneGraphCollisionChecker
from scene_graph_ros.planning.checker.position_limits import beyond_limits, describe_excess
from scene_graph_ros.planning.edges.edge_proofs import EdgeProofs, prove
from scene_graph_ros.planning.edges.edge_stretches import COLLIDES, EdgeRules, FREE
from scene_graph_ros.planning.plan_failure import PlanFailure

__all__ = ["EndTrouble", "find_troubles", "pair_words"]


class EndTrouble(NamedTuple):
    """The fault of a configuration: as a failure where it is a start or a goal."""

    of_start: PlanFailure
    of_goal: PlanFailure
    words: str


def find_troubles(
    checker: SceneGraphCollisionChecker,
    configurations: NDArray[np.float64],
    tolerance: float,
    stop: NDArray[np.int64],
    prover: Callable[..., EdgeProofs] = prove,
    moves: NDArray[np.bool_] | None = None,
) -> list[EndTrouble | None]:
    """Return, for each configuration ``(n, nq)``, why no path begins or ends there, or None.

    They must keep more than ``tolerance`` (m) beyond all paddings. ``prover`` does as `prove`.
    Only the positions in ``moves`` ``(nq,)``, where given, have to be within limits.
    """
    points = np.repeat(configurations[:, np.newaxis], 2, axis=1)
    rules = EdgeRules(measures=False, part=1.0, tolerance=tolerance)
    proofs = prover(checker.plan, points, rules, stop=stop)
    result: list[EndTrouble | None] = [None] * len(configurations)
    is_outside = beyond_limits(checker.plan.tree, configurations, moves)
    if (proofs.statuses == FREE).all() and not is_outside.any():
        return result
    result.clear()
    for row, q in enumerate(configurations):
        outside = describe_excess(checker.plan.tree, q, moves)
        status, pair = int(proofs.statuses[row]), int(proofs.pairs[row])
        if outside is not None:
            kinds = PlanFailure.START_BEYOND_LIMITS, PlanFailure.GOAL_BEYOND_LIMITS
            result.append(EndTrouble(*kinds, outside))
        elif status == FREE:
            result.append(None)
        elif stop[0] != 0:
            words = "could not be checked in time"
            result.append(EndTrouble(PlanFailure.TIMEOUT, PlanFailure.TIMEOUT, words))
        else:
            kinds = PlanFailure.START_COLLIDES, PlanFailure.GOAL_COLLIDES
            words = _collision(checker, q) if status == COLLIDES else ""
            if not words:
                names = pair_words(checker, checker.plan.ids(pair))
                words = (
                    f"is too near to a collision: {names} keep less than {1e3 * tolerance:g} mm"
                )
            result.append(EndTrouble(*kinds, words))
    return result


def _collision(checker: SceneGraphCollisionChecker, q: NDArray[np.float64]) -> str:
    """Return a sentence on the pair that is deepest in each other, or in its padding."""
    clearance = checker.calc_robot_clearance(q, 0.0)
    if not clearance.pairs:
        return ""
    deepest = int(np.argmin(clearance.distances))
    names = pair_words(checker, clearance.pairs[deepest])
    depth = f"{-1e3 * clearance.distances[deepest]:.4g} mm"
    pair = checker.plan.pair_of(*(int(each) for each in clearance.pairs[deepest]))
    padding = 0.0 if pair is None else float(checker.plan.pairs.paddings[pair])
    if padding == 0.0:
        return f"collides: {names} overlap by {depth}"
    return (
        f"collides: {names} are {depth} nearer than their padding of {1e3 * padding:.4g} mm;"
        " set_padding gives such a pair one of its own"
    )


def pair_words(checker: SceneGraphCollisionChecker, pair: Iterable[GeometryId]) -> str:
    """Return two geometries' names, as scene files call them: source, frame, name."""
    inspector = checker.snapshot.inspector
    return " and ".join(inspector.get_path(each) for each in pair)
