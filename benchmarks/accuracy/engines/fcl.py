"""FCL by way of python-fcl, a call of its narrowphase for each pair."""

from __future__ import annotations

from collections.abc import Sequence
import importlib
from typing import Any

from benchmarks.accuracy.constructions import KnownPair, KnownPoint
from benchmarks.accuracy.engines.engine import one_by_one, Refused, Reply
from benchmarks.peer_shapes import fcl_shape
from scene_graph_ros.geometry import HalfSpace

__all__ = ["Fcl"]

_CONTACTS = 8


class Fcl:
    """``fcl.distance`` (signed) and ``fcl.collide``."""

    name = "FCL"

    def __init__(self) -> None:
        self._fcl: Any = importlib.import_module("fcl")

    def _arguments(self, pairs: Sequence[KnownPair]) -> list[tuple[Any, Any]]:
        def place(shape: Any, X: Any) -> Any:
            transform = self._fcl.Transform(X[:3, :3], X[:3, 3])
            return self._fcl.CollisionObject(fcl_shape(shape), transform)

        return [(place(p.shape_A, p.X_WA), place(p.shape_B, p.X_WB)) for p in pairs]

    def distances(self, pairs: Sequence[KnownPair]) -> Reply:
        """See Engine; refuses half spaces, for which the library ends the whole process."""
        if any(isinstance(s, HalfSpace) for p in pairs for s in (p.shape_A, p.shape_B)):
            raise Refused("fcl.distance of a half space is a segmentation fault")
        request = self._fcl.DistanceRequest(enable_signed_distance=True)

        def ask(a: Any, b: Any) -> float:
            return self._fcl.distance(a, b, request, self._fcl.DistanceResult())

        return one_by_one(ask, self._arguments(pairs))

    def penetrations(self, pairs: Sequence[KnownPair]) -> Reply:
        """See Engine; the deepest of the contacts counts."""
        request = self._fcl.CollisionRequest(num_max_contacts=_CONTACTS, enable_contact=True)

        def ask(a: Any, b: Any) -> float:
            result = self._fcl.CollisionResult()
            self._fcl.collide(a, b, request, result)
            return -max((c.penetration_depth for c in result.contacts), default=0.0)

        return one_by_one(ask, self._arguments(pairs))

    def points(self, points: Sequence[KnownPoint]) -> Reply:
        """Refuse: FCL has no query for points."""
        raise Refused("no query for points")
