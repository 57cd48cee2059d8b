"""Paths along which conditions on links hold: two trees of projected walks, and shortcuts.

RRT-Connect (Kuffner and LaValle, 2000) on the configurations at which the conditions hold, as
CBiRRT does (Berenson, Srinivasa, Ferguson and Kuffner, *Manipulation Planning on Constraint
Manifolds*, 2009): one tree walks towards a random configuration, the other towards where that led.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.planning.constraints.held_constraints import HeldConstraints
from scene_graph_ros.planning.edges.edge_proofs import EdgeProver
from scene_graph_ros.planning.paths.manifold.projected_walks import Walks
from scene_graph_ros.planning.paths.search.path_search import PathSearch, SearchTask

__all__ = ["ManifoldSearch"]

Array = NDArray[np.float64]

_ROOM = 256
"""Nodes that a tree has room for at first; it is doubled as it grows."""

_MOST_NODES = 2**17
"""Of a tree: more are not made."""

_KEPT = 1e-3
"""m: what shortcuts keep where they are measured."""

_SHORTCUTS, _IN_VAIN = 200, 40
"""Shortcuts that are tried at most, and one after another in vain."""


class _Tree:
    """Nodes ``(n, nq)`` and their parents, -1 for roots."""

    def __init__(self, roots: Array) -> None:
        size = max(_ROOM, 2 * len(roots))
        self._nodes = np.empty((size, roots.shape[1]))
        self._nodes[: len(roots)] = roots
        self.parents = [-1] * len(roots)

    @property
    def nodes(self) -> Array:
        return self._nodes[: len(self.parents)]

    def add(self, q: Array, parent: int) -> int:
        row = len(self.parents)
        if row == len(self._nodes):
            self._nodes = np.concatenate([self._nodes, np.empty_like(self._nodes)])
        self._nodes[row] = q
        self.parents.append(parent)
        return row

    def way_to_root(self, row: int) -> list[int]:
        way = [row]
        while self.parents[way[-1]] >= 0:
            way.append(self.parents[way[-1]])
        return way


class ManifoldSearch(PathSearch):
    """A search from one start to one of several goals, all along which conditions hold."""

    def __init__(
        self, task: SearchTask, *, held: HeldConstraints, moves: NDArray[np.bool_]
    ) -> None:
        super().__init__(task)
        self._walks = Walks(task.plan, task.space, held, moves, task.stop)
        nothing = np.empty((0, task.plan.tree.num_positions))
        self._grown = (_Tree(nothing), _Tree(nothing))
        self._gap = np.inf

    @property
    def tree_sizes(self) -> tuple[int, int]:
        """How many configurations the trees from start and goals have."""
        return len(self._grown[0].parents), len(self._grown[1].parents)

    @property
    def edges(self) -> int:
        """How many edges were looked at."""
        return self._walks.edges

    @property
    def gap(self) -> float:
        """How near (rad and m) the trees came to each other; at first infinite."""
        return self._gap

    def load_kernel(self) -> None:
        """Load the kernels of the search, or compile them: a time limit is for its work."""
        q = self._task.plan.tree.zero_configuration()
        self._walks.projected(q)
        self._walks.is_free(self._walks.prover(self._task.rules), q, q)
        self._walks.edges = 0

    def find(self, start: Array, goals: Array) -> tuple[Array, int] | None:
        """Return a path ``(n, nq)`` and the row of its goal; None when stopped, or out of room.

        ``start`` is ``(nq,)``, ``goals`` ``(m, nq)``; conditions must hold there, and they must be
        free. Walks from the goals to the start are tried first.
        """
        task, walks = self._task, self._walks
        space, prover = task.space, walks.prover(task.rules)
        trees = self._grown = (_Tree(start[np.newaxis]), _Tree(goals))
        rng = np.random.default_rng(task.seed)
        for row in range(len(goals)):
            met = self._connect(prover, 1, row, 0)
            if met is not None:
                return self._path_through(*met)
        grows = 0
        while task.stop[0] == 0 and max(self.tree_sizes) < _MOST_NODES:
            grows = 0 if self.tree_sizes[0] <= self.tree_sizes[1] else 1
            (sample,) = space.samples(rng, 1)
            near = int(np.argmin(space.distances(sample, trees[grows].nodes)))
            last = self._extend(prover, grows, near, sample, space.longest_step)[0]
            if last == near:
                continue
            other = trees[1 - grows]
            nearest = int(np.argmin(space.distances(trees[grows].nodes[last], other.nodes)))
            met = self._connect(prover, 1 - grows, nearest, last)
            if met is not None:
                return self._path_through(*met)
        return None

    def _extend(
        self, prover: EdgeProver, which: int, row: int, target: Array, farthest: float
    ) -> tuple[int, bool]:
        """Add a walk towards a target to a tree; return its last node, and whether it is there."""
        tree = self._grown[which]
        walk = self._walks.walk(prover, tree.nodes[row].copy(), target, farthest)
        for q in walk.configurations:
            row = tree.add(q, row)
        return row, walk.is_there

    def _connect(
        self, prover: EdgeProver, which: int, row: int, target: int
    ) -> tuple[int, int] | None:
        """Let a tree walk to a node of the other; return the nodes of start and goal that met."""
        goal = self._grown[1 - which].nodes[target].copy()
        row, is_there = self._extend(prover, which, row, goal, np.inf)
        at = self._grown[which].nodes[row]
        self._gap = min(self._gap, float(self._task.space.distances(at, goal[np.newaxis])[0]))
        if not is_there:
            return None
        return (row, target) if which == 0 else (target, row)

    def _path_through(self, from_start: int, from_goal: int) -> tuple[Array, int]:
        """Return the path through two nodes that met, with all turns counted."""
        first, second = self._grown
        here = first.nodes[first.way_to_root(from_start)[::-1]]
        way = second.way_to_root(from_goal)
        there = second.nodes[way]
        turns = self._task.space.turns(here[-1], there[0])
        return self._task.space.settled(np.concatenate([here, there[1:] + turns])), way[-1]

    def shortened(self, path: Array) -> Array:
        """Return a path that is shorter where shortcuts were found before it was stopped.

        Walks between two random nodes replace the part between them where they are shorter
        (Geraerts and Overmars, *Creating High-quality Paths for Motion Planning*, 2007, section
        3), the one from end to end first. Then nodes are left out where edges allow it.
        """
        task, walks = self._task, self._walks
        if task.least_saving >= 1.0 or len(path) < 3:
            return path
        # Turns of the path are counted: its nodes are met as they are.
        walks.space = replace(task.space, table=task.space.unwound())
        kept = max(task.rules.tolerance, _KEPT)
        prover = walks.prover(task.rules._replace(tolerance=kept))
        rng, rows = np.random.default_rng(task.seed), list(path)
        in_vain = 0
        for turn in range(_SHORTCUTS):
            if task.stop[0] != 0 or in_vain >= _IN_VAIN or len(rows) < 3:
                break
            first, last = 0, len(rows) - 1
            if turn:
                first, last = sorted(rng.choice(len(rows), 2, replace=False).tolist())
            in_vain += 1
            if last - first < 2:
                continue
            before, whole = self._length(rows[first : last + 1]), self._length(rows)
            walk = walks.walk(prover, rows[first], rows[last], np.inf)
            way = [rows[first], *walk.configurations]
            if walk.is_there and before - self._length(way) > task.least_saving * whole:
                rows[first : last + 1] = way
                in_vain = 0
        return task.space.settled(np.array(self._without_corners(prover, rows)))

    def _length(self, rows: list[Array]) -> float:
        return self._task.space.length(np.array(rows))

    def _without_corners(self, prover: EdgeProver, rows: list[Array]) -> list[Array]:
        """Return rows without those that others need not, one after another."""
        result, at = [rows[0]], 0
        while at < len(rows) - 1:
            to = at + 1
            # Ever longer edges, until one is not proven.
            while to < len(rows) - 1 and self._task.stop[0] == 0:
                if not self._walks.is_free(prover, rows[at], rows[to + 1]):
                    break
                to += 1
            result.append(rows[to])
            at = to
        return result
