"""A collision checker as a value that another process can read."""

from __future__ import annotations

from dataclasses import dataclass, replace
import hashlib
import pickle
from typing import Any
import zlib

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.meshes.cache import BuildCache
from scene_graph_ros.planning.checker.checker_interface import CollisionChecker
from scene_graph_ros.planning.checker.collision_checker import SceneGraphCollisionChecker
from scene_graph_ros.planning.checker.configuration_checks import first_pairs
from scene_graph_ros.planning.edges.edge_proofs import prove
from scene_graph_ros.planning.edges.edge_stretches import EdgeRules, FREE
from scene_graph_ros.planning.errors import CollisionCheckerError
from scene_graph_ros.planning.pairs.check_kernels import NO_PAIR
from scene_graph_ros.planning.pairs.checker_plan import CheckerPlan
from scene_graph_ros.planning.pairs.near_pairs import near_pairs, NearPairs

__all__ = ["CarriedChecker", "PackedChecker", "pack"]

_KEPT = 4
"""Checkers that a process keeps unpacked."""


@dataclass(frozen=True)
class PackedChecker:
    """A checker as bytes; some 10 kB where shapes are simple, more with hulls and meshes."""

    data: bytes
    digest: str

    def unpacked(self) -> Any:
        """Return the checker; a process unpacks it once."""
        # Executors unpickle the shares that it comes in, so it is as safe as these.
        return _UNPACKED.get(
            self.digest,
            lambda: pickle.loads(zlib.decompress(self.data)),  # noqa: S301
        )


_UNPACKED: BuildCache[Any] = BuildCache(_KEPT)


class CarriedChecker:
    """Answers as the checker that it was made of did then, about configurations and edges.

    Its arrays go wherever pickles go; addresses are those of the process that it is in.
    """

    def __init__(self, plan: CheckerPlan, tolerance: float) -> None:
        self.plan, self.tolerance = plan, tolerance

    def __getstate__(self) -> dict[str, Any]:
        """Return all that is no address."""
        plan = self.plan
        return {
            "plan": plan._replace(
                tree=replace(plan.tree, groups={}),
                shapes=plan.shapes.packed(),
                bodies=plan.bodies._replace(measure=0),
            ),
            "tolerance": self.tolerance,
        }

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Write down the addresses of this process."""
        plan = state["plan"]
        shapes = plan.shapes.again()
        bodies = plan.bodies._replace(measure=shapes.measure)
        self.plan = plan._replace(shapes=shapes, bodies=bodies)
        self.tolerance = state["tolerance"]

    def check_configs_collision_free(
        self, configurations: NDArray[np.float64], *, threads: int = 1
    ) -> NDArray[np.bool_]:
        """Tell of configurations ``(n, nq)``, which were checked, whether each is free."""
        result: NDArray[np.bool_] = first_pairs(self.plan, configurations, threads) == NO_PAIR
        return result

    def check_edges_collision_free(
        self, edges: NDArray[np.float64], *, threads: int = 1
    ) -> NDArray[np.bool_]:
        """Tell of straight edges ``(n, 2, nq)``, which were checked, whether each is proven."""
        rules = EdgeRules(measures=False, part=1.0, tolerance=self.tolerance)
        result: NDArray[np.bool_] = (
            prove(self.plan, edges, rules, threads=threads).statuses == FREE
        )
        return result

    def calc_robot_clearance(self, q: NDArray[np.float64], influence_distance: float) -> NearPairs:
        """Return padded distances at q ``(nq,)``, which was checked, up to one (m)."""
        return near_pairs(self.plan, q[np.newaxis], influence_distance)[0]


def pack(checker: CollisionChecker) -> PackedChecker:
    """Return a checker as bytes. Raises CollisionCheckerError where it has none.

    Of a `SceneGraphCollisionChecker` whose edges are straight these are the kernels' inputs, any
    other one is pickled as it is.
    """
    carried: Any = checker
    if type(checker) is SceneGraphCollisionChecker:
        if not checker.is_straight:
            raise CollisionCheckerError(
                "executor: the checker's provider has ways of its own, which other processes do"
                " not know; leave the executor out, or use a linear provider"
            )
        carried = CarriedChecker(checker.plan, checker.tolerance)
    try:
        data = pickle.dumps(carried, protocol=pickle.HIGHEST_PROTOCOL)
    except (pickle.PicklingError, TypeError, AttributeError) as error:
        raise CollisionCheckerError(
            f"executor: a {type(checker).__name__} can't be sent to other processes ({error});"
            " leave the executor out, or give the class __getstate__ and __setstate__"
        ) from error
    packed = zlib.compress(data, 1)
    return PackedChecker(packed, hashlib.sha256(packed).hexdigest())
