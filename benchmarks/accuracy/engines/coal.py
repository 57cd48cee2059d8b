"""Coal, a call of its narrowphase for each pair."""

from __future__ import annotations

from collections.abc import Sequence
import importlib
from typing import Any

from benchmarks.accuracy.constructions import KnownPair, KnownPoint
from benchmarks.accuracy.engines.engine import one_by_one, Refused, Reply
from benchmarks.peer_shapes import coal_shape

__all__ = ["Coal"]


class Coal:
    """``coal.distance`` and ``coal.collide``, with the library's tolerances or given ones."""

    def __init__(self, tolerance: float | None = None) -> None:
        self.name = "Coal" if tolerance is None else f"Coal, tolerance {tolerance:.0e}"
        self._coal: Any = importlib.import_module("coal")
        self._tolerance = tolerance

    def _request(self, kind: str, **options: Any) -> Any:
        request = getattr(self._coal, kind)()
        for name, value in options.items():
            setattr(request, name, value)
        if self._tolerance is not None:
            request.gjk_tolerance = request.epa_tolerance = self._tolerance
            request.gjk_max_iterations = request.epa_max_iterations = 1000
        return request

    def _arguments(self, pairs: Sequence[KnownPair]) -> list[tuple[Any, ...]]:
        def place(X: Any) -> Any:
            return self._coal.Transform3s(X[:3, :3], X[:3, 3])

        return [
            (coal_shape(p.shape_A), place(p.X_WA), coal_shape(p.shape_B), place(p.X_WB))
            for p in pairs
        ]

    def distances(self, pairs: Sequence[KnownPair]) -> Reply:
        """See Engine."""
        request, result = self._request("DistanceRequest"), self._coal.DistanceResult()

        def ask(*pair: Any) -> float:
            result.clear()
            return self._coal.distance(*pair, request, result)

        return _checked(ask, self._arguments(pairs))

    def penetrations(self, pairs: Sequence[KnownPair]) -> Reply:
        """See Engine."""
        request = self._request("CollisionRequest", num_max_contacts=1, enable_contact=True)
        result = self._coal.CollisionResult()

        def ask(*pair: Any) -> float:
            result.clear()
            if self._coal.collide(*pair, request, result) == 0:
                return 0.0
            return -abs(result.getContact(0).penetration_depth)

        return _checked(ask, self._arguments(pairs))

    def points(self, points: Sequence[KnownPoint]) -> Reply:
        """Refuse: Coal has no query for points."""
        raise Refused("no query for points")


def _checked(ask: Any, arguments: list[tuple[Any, ...]]) -> Reply:
    try:
        return one_by_one(ask, arguments)
    except (RuntimeError, ValueError) as error:
        raise Refused(str(error)) from error
