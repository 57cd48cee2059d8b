"""Whether two sets with curved members meet, from the plane between them: by Newton's method.

The two reach ``h(u)`` beyond each other along a unit vector u, and are apart where that is
negative for some u (Boyd and Vandenberghe, *Convex Optimization*, 2004, section 8.2). The least is
sought on the sphere: of members that reach furthest each has its gradient, the furthest point, and
its Hessian, so that steps are those of sequential quadratic programs (Nocedal and Wright,
*Numerical Optimization*, 2006, chapter 18; Absil, Mahony and Sepulchre, *Optimization Algorithms
on Matrix Manifolds*, 2008, chapter 6). All that is said follows from the members at the last u: a
plane with room for rounding, points nearer than rounding may tell, or a common point, where
members that were moved as far as the two overlap keep more of a ball inside than rounding takes.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from scene_graph_ros.convex.errors import SolverError
from scene_graph_ros.convex.questions.pieces import Piece
from scene_graph_ros.convex.solve.nearest.nearest_in_hull import nearest_in_hull
from scene_graph_ros.geometry.tolerances import EPSILON

__all__ = ["APART", "NEAR", "meet_by_plane"]

APART = 8.0 * EPSILON
"""Relative to coordinates, for each of them: what rounding does to how far a set reaches."""

NEAR = 1e-11
"""The same: curved sets that come so near may stay undecided, and count as touching."""

_ROUNDS = ((6, 5e-2), (12, 5e-3), (24, 5e-5))
"""Points of both sets that give a direction to begin with; more where that was too far away.

And which members are in the first step: relative to coordinates, by how much less they reach.
"""

_MOST_STEPS = 25

_MOST_HALVINGS = 12

_LEAST_GAIN = 1e-4
"""Share of what a step promises that it has to gain (Armijo's condition)."""

_STOPS = 4.0 * EPSILON
"""Relative to coordinates: a gain that is rounding."""

_STILL = 1e-14
"""A turn of the direction that is rounding."""

_MOST_HESSIANS, _SAME = 3, 1e-3
"""How often the model's Hessian follows its shares, and a change of these that is none."""


def meet_by_plane(one: Any, other: Any) -> bool | None:
    """Tell whether two bounded sets that aren't empty meet, None where that is left open.

    Those that come nearer than `NEAR` count as touching.
    """
    both = _Facing(one, other)
    points = np.zeros((0, one.ambient_dimension))
    try:
        u = both.first()
        if both.along(u, 0.0) is None:
            return None
        for count, near in _ROUNDS:
            for _ in range(count):
                overlap, difference, size = both.reach(u)
                if overlap < -APART * len(u) * size:
                    here = both.along(u, 0.0)
                    if here is not None and here.is_apart:
                        return False
                points = np.concatenate([points, difference[None]])
                nearest, weights, _ = nearest_in_hull(points, np.zeros((1, len(u))))
                points, distance = points[weights[0] > 0.0], float(np.linalg.norm(nearest[0]))
                if distance <= size * NEAR:
                    return True
                u = -nearest[0] / distance
            answer = both.descend(u, near)
            if answer is not None:
                return answer
    except (SolverError, np.linalg.LinAlgError):
        return None
    return None


class _Faced(NamedTuple):
    """Two sets along u: pieces of the one, those of the other along -u, and what follows."""

    u: np.ndarray
    first: Sequence[Piece]
    second: Sequence[Piece]
    overlap: float
    size: float

    @property
    def is_apart(self) -> bool:
        """Whether the plane between them is surely one."""
        outward = sum(max(p.outward for p in some) for some in (self.first, self.second))
        return self.overlap + outward < -APART * len(self.u) * self.size


class _Facing:
    def __init__(self, one: Any, other: Any) -> None:
        self._one, self._other = one, other

    def first(self) -> np.ndarray:
        """Return a direction to begin with: from the middle of the one to that of the other."""
        axis = np.eye(self._one.ambient_dimension)[0]
        first, second = (
            0.5 * (each.support(axis).point + each.support(-axis).point)
            for each in (self._one, self._other)
        )
        way: np.ndarray = second - first
        length = float(np.linalg.norm(way))
        return way / length if length > 0.0 else axis

    def reach(self, u: np.ndarray) -> tuple[float, np.ndarray, float]:
        """Return the overlap along u, rounded up, the difference ``(n,)``, and coordinates."""
        first, second = self._one.support(u), self._other.support(-u)
        size = max(float(np.abs(each.point).max()) for each in (first, second))
        overlap = first.value + second.value + first.gap + second.gap
        return overlap, first.point - second.point, size

    def along(self, u: np.ndarray, within: float) -> _Faced | None:
        """Return the pieces that reach furthest but for ``within``; None where unknown."""
        pair = self._one._pieces(u, within), self._other._pieces(-u, within)
        if pair[0] is None or pair[1] is None:
            return None
        first, second = (sorted(some, key=lambda piece: -piece.value) for some in pair)
        size = max(float(np.abs(some[0].point).max()) for some in (first, second))
        return _Faced(u, first, second, first[0].value + second[0].value, size)

    def descend(self, u: np.ndarray, near: float) -> bool | None:
        """Tell what is seen at the least overlap near a direction, from members so near."""
        here = self.along(u, 0.0)
        within = np.inf if here is None else near * here.size
        here = self.along(u, within)
        model: _Model | None = None
        for _ in range(_MOST_STEPS):
            if here is None or here.is_apart:
                break
            model = _Model.make(here)
            length = float(np.linalg.norm(model.step))
            if length <= _STILL:
                break
            within = min(within, max(4.0 * length, NEAR) * here.size)
            after = self._shorter(here, model, within)
            if after is None:
                break
            here, model = after, None
        if here is None:
            return None
        return False if here.is_apart else _meets(here, (model or _Model.make(here)).shares)

    def _shorter(self, here: _Faced, model: _Model, within: float) -> _Faced | None:
        """Return what is seen after a step, or a part of it, that gains; None without one."""
        share, most = 1.0, here.overlap + _STOPS * here.size
        for _ in range(_MOST_HALVINGS):
            u = here.u + share * model.step
            after = self.along(u / np.linalg.norm(u), within)
            if after is None or after.overlap <= most - _LEAST_GAIN * share * model.promised:
                return after
            share *= 0.5
        return None


class _Model(NamedTuple):
    """The least overlap of quadratic models: where, by which shares of pieces, and the gain."""

    step: np.ndarray
    shares: tuple[np.ndarray, np.ndarray]
    promised: float

    @classmethod
    def make(cls, here: _Faced) -> _Model:
        """Return the model whose Hessian is that of its own shares, nearly."""
        shares = tuple(np.eye(len(some))[0] for some in (here.first, here.second))
        is_smooth = len(here.first) == len(here.second) == 1
        for _ in range(1 if is_smooth else _MOST_HESSIANS):
            model = _least_of_models(here, shares)
            change = max(
                float(np.abs(a - b).max()) for a, b in zip(model.shares, shares, strict=True)
            )
            shares = model.shares
            if change <= _SAME:
                break
        return model


def _least_of_models(here: _Faced, shares: Sequence[np.ndarray]) -> _Model:
    """Return the least overlap of models of the pieces with one Hessian, of ``shares``.

    An active-set method: pieces that reach furthest after the step are added, those with negative
    shares left out.
    """
    u, sides, size = here.u, (here.first, here.second), here.size
    flat = np.eye(len(u)) - np.outer(u, u)
    hessian = sum(
        share * piece.hessian
        for some, each in zip(sides, shares, strict=True)
        for piece, share in zip(some, each, strict=True)
    )
    curved = flat @ hessian @ flat
    least = float(np.linalg.eigvalsh(curved)[1:].min(initial=0.0))
    W = curved - min(here.overlap, 0.5 * least) * flat + max(size, EPSILON) * np.outer(u, u)
    points = [
        sign * np.array([p.point for p in some]) for some, sign in zip(sides, (1, -1), strict=True)
    ]
    values = [np.array([p.value for p in some]) for some in sides]
    kept: list[list[int]] = [[0], [0]]
    for _ in range(2 * sum(map(len, sides))):
        solved = [list(each) for each in kept]
        step, weights, ends = _stationary(
            W,
            u,
            [x[k] for x, k in zip(points, kept, strict=True)],
            [v[k] for v, k in zip(values, kept, strict=True)],
        )
        side, place = min(
            ((s, i) for s in (0, 1) for i in range(len(kept[s]))),
            key=lambda at: weights[at[0]][at[1]],
        )
        if weights[side][place] < 0.0 and len(kept[side]) > 1:
            del kept[side][place]
            continue
        over = [v + x @ step - end for v, x, end in zip(values, points, ends, strict=True)]
        side = int(over[1].max() > over[0].max())
        most = int(over[side].argmax())
        if over[side][most] <= _STOPS * size or most in kept[side]:
            break
        kept[side].append(most)
    given = []
    for some, each, own in zip(sides, solved, weights, strict=True):
        share = np.zeros(len(some))
        share[each] = np.maximum(own, 0.0)
        given.append(share / share.sum())
    return _Model(step - float(step @ u) * u, (given[0], given[1]), here.overlap - sum(ends))


def _stationary(
    W: np.ndarray, u: np.ndarray, points: Sequence[np.ndarray], values: Sequence[np.ndarray]
) -> tuple[np.ndarray, list[np.ndarray], list[float]]:
    """Return the step ``(n,)``, the shares of pieces and how far both sides reach after it.

    Of the stationary point of ``W / 2`` and both sides, whose pieces given all reach as far.
    """
    n, k, m = len(u), len(points[0]), len(points[1])
    G = np.concatenate([*points, u[None]])
    ends = np.zeros((k + m + 1, 2))
    ends[:k, 0], ends[k : k + m, 1] = -1.0, -1.0
    K = np.zeros((n + k + m + 3, n + k + m + 3))
    K[:n, :n], K[:n, n : n + k + m + 1], K[n : n + k + m + 1, :n] = W, G.T, G
    K[n : n + k + m + 1, n + k + m + 1 :], K[n + k + m + 1 :, n : n + k + m + 1] = ends, ends.T
    side = np.concatenate([np.zeros(n), *(-v for v in values), [0.0, -1.0, -1.0]])
    found = np.linalg.lstsq(K, side, rcond=None)[0]
    return found[:n], [found[n : n + k], found[n + k : n + k + m]], found[-2:].tolist()


def _meets(here: _Faced, shares: tuple[np.ndarray, np.ndarray]) -> bool | None:
    """Tell whether sets are shown to meet by shares of their pieces, or come near enough."""
    n = len(here.u)
    sides = here.first, here.second
    both = list(zip(sides, shares, strict=True))
    inner = [_mean([piece.inner() for piece in some], own) for some, own in both]
    difference = inner[0] - inner[1]
    tops = [_mean([piece.point for piece in some], own) for some, own in both]
    if float(np.linalg.norm(tops[0] - tops[1])) <= NEAR * here.size:
        return True
    rounding = sum(max(piece.rounding for piece in some) for some in sides)
    rounding += 4.0 * EPSILON * here.size * sum(map(len, sides))
    for some, own, others, sign in (
        (sides[0], shares[0], inner[1], -1.0),
        (sides[1], shares[1], inner[0], 1.0),
    ):
        found = [
            piece.moved(sign * difference) for piece, w in zip(some, own, strict=True) if w > 0.0
        ]
        moved = [each for each in found if each is not None]
        if len(moved) < len(found):
            continue
        own = own[own > 0.0]
        away = float(np.linalg.norm(_mean([point for point, _ in moved], own) - others))
        kept = float(own @ np.array([radius for _, radius in moved]))
        if away + np.sqrt(n) * rounding < kept:
            return True
    return None


def _mean(points: Sequence[np.ndarray], shares: np.ndarray) -> np.ndarray:
    found: np.ndarray = shares @ np.array(points)
    return found
