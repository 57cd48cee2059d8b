"""One search for a path by two trees, and for shorter ones: inputs of kernels of ``search``."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.planning.edges.edge_proofs import edge_scratch
from scene_graph_ros.planning.edges.edge_stretches import EdgeRules
from scene_graph_ros.planning.pairs.checker_plan import CheckerPlan
from scene_graph_ros.planning.parallel.stoppable import ENDLESS, Turns
from scene_graph_ros.planning.parallel.stoppable import LOOKS as LOOKS_IN_A_TURN
from scene_graph_ros.planning.paths.search.position_space import PositionSpace
from scene_graph_ros.planning.paths.search.rrt_connect_kernels import Trees
from scene_graph_ros.planning.paths.search.search_kernels import search, SearchTables
from scene_graph_ros.planning.paths.search.search_state import (
    CONNECT,
    COUNT,
    DONE,
    EDGES,
    ENTRIES,
    LOOKS,
    NEAR,
    NEEDS_ROOM,
    NEEDS_SAMPLES,
    PAUSED,
    PHASE,
    ROOTS,
    SAMPLE,
    SHORTEN,
    TARGET,
    TREE,
)
from scene_graph_ros.planning.paths.search.shortcut_kernels import more_corners, new_corners
from scene_graph_ros.planning.paths.search.space_kernels import SpaceTable

__all__ = ["LEAST_SAVING", "PathSearch", "SearchTask", "search_rules"]

_ROOM = 256
"""Nodes that trees have room for at first; it is doubled as they grow."""

_MOST_NODES = 2**20
"""Of a tree: more are not made."""

_SAMPLES = 128
"""Random configurations that are made at once."""

_ROOM_FOR_CORNERS = 64
"""Corners more than a path has at first."""

LEAST_SAVING = 0.005
"""Of a path's length: corners that save less are not cut off."""

_KEPT_BY_SHORTCUTS = 1e-3
"""Metres that shortcuts keep where they are measured: the shortest paths graze corners, and who
proves them once more pays for it."""

_PART, _KEPT = 0.9, 20.0
"""How much of a distance a search uses up, and times the checker's tolerance what is left where it
measures. A tenth is kept in between: two tolerances, so that parts of edges can be proven, too."""


def search_rules(tolerance: float) -> EdgeRules:
    """Return the rules of proofs during a search, for a checker's tolerance (m)."""
    return EdgeRules(False, part=_PART, tolerance=_KEPT * tolerance, asks_ends=False)


class SearchTask(NamedTuple):
    """The inputs of every search, by any method."""

    plan: CheckerPlan
    space: PositionSpace
    rules: EdgeRules
    """What counts as proven."""
    seed: int
    stop: NDArray[np.int64]
    """``(2,)``: soon after its first entry is set, the search ends; see `new_stop`."""
    least_saving: float = LEAST_SAVING
    """Of a path's length: corners that save less are not cut off."""
    turns: Turns | None = None
    """Whom it takes turns with; without, it is in a thread of its own."""


class PathSearch:
    """A search from one start to one of several goals; the same for the same seed.

    ``tree_sizes``, ``edges`` and ``gap`` may be read meanwhile. ``scratch`` is for proofs.
    """

    def __init__(self, task: SearchTask) -> None:
        self._task = task
        self._rng: np.random.Generator | None = None
        nq = task.plan.tree.num_positions
        self._trees = _room(_ROOM, nq)
        self._path = new_corners(np.empty((0, nq)), 1, 1.0)
        self._samples = np.empty((0, nq))
        self._longest_step = task.space.longest_step
        self._state = np.zeros(ENTRIES, dtype=np.int64)
        self._state[LOOKS] = ENDLESS
        self.scratch = edge_scratch(task.plan)
        self._own_scratch = (np.empty((3, nq)), np.empty(4))

    @property
    def tree_sizes(self) -> tuple[int, int]:
        """How many configurations the trees from start and goals have."""
        return int(self._trees.sizes[0]), int(self._trees.sizes[1])

    @property
    def edges(self) -> int:
        """How many edges were looked at."""
        return int(self._state[EDGES])

    @property
    def gap(self) -> float:
        """How near (rad and m) the trees came to each other; at first infinite."""
        return float(self._trees.gap[0])

    @property
    def words(self) -> str:
        """How far it came, in words."""
        apart = f", {self.gap:.3g} apart where they are nearest" if math.isfinite(self.gap) else ""
        return (
            f"the trees from start and goal have {self.tree_sizes[0]} and {self.tree_sizes[1]}"
            f" configurations{apart}, after {self.edges} edges"
        )

    def load_kernel(self) -> None:
        """Load the kernel of the search, or compile it: a time limit is for its work."""
        self._state[PHASE], self._state[COUNT] = SHORTEN, 0
        self._search_on(self._task.space.table, self._task.rules)

    def begin(self, stop: NDArray[np.int64], turns: Turns) -> None:
        """From now on stop when told to by ``stop``, and take turns."""
        self._task = self._task._replace(stop=stop, turns=turns)
        self._state[LOOKS] = LOOKS_IN_A_TURN

    def find(
        self, start: NDArray[np.float64], goals: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], int] | None:
        """Return a path ``(n, nq)`` and the row of its goal; None when stopped, or out of room.

        ``start`` is ``(nq,)``, ``goals`` ``(m, nq)``; they must be free. The straight ways to the
        goals are tried first. Joints that turn without an end arrive up to full turns.
        """
        self._plant(start, goals)
        while True:
            answer = self._search(self._task.space.table, self._task.rules)
            if answer == DONE:
                return self._joined()
            if answer == NEEDS_SAMPLES:
                if self._rng is None:
                    self._rng = np.random.default_rng(self._task.seed)
                self._samples = self._task.space.samples(self._rng, _SAMPLES)
                self._state[SAMPLE] = 0
            elif answer != NEEDS_ROOM or not self._grow():
                return None

    def shortened(self, path: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return a path that is shorter where shortcuts were found before it was stopped."""
        table = self._task.space.unwound()
        kept = max(self._task.rules.tolerance, _KEPT_BY_SHORTCUTS)
        rules = self._task.rules._replace(tolerance=kept)
        self._state[PHASE], self._state[COUNT] = SHORTEN, len(path)
        self._path = new_corners(path, len(path) + _ROOM_FOR_CORNERS, self._task.least_saving)
        while self._search(table, rules) == NEEDS_ROOM:
            self._path = more_corners(self._path)
        return self._task.space.settled(self._path.rows[: self._state[COUNT]])

    def _plant(self, start: NDArray[np.float64], goals: NDArray[np.float64]) -> None:
        trees = self._trees = _room(max(_ROOM, 2 * len(goals)), len(start))
        for tree, roots in enumerate((start[np.newaxis], goals)):
            trees.nodes[tree, : len(roots)] = roots
            trees.parents[tree, : len(roots)] = -1
            trees.sizes[tree] = len(roots)
        state = self._state
        state[PHASE], state[TREE], state[NEAR], state[TARGET] = CONNECT, 1, 0, 0
        state[ROOTS] = len(goals)

    def _search(self, table: SpaceTable, rules: EdgeRules) -> int:
        """Go on until something is missing or all is done, and take turns meanwhile."""
        turns, state = self._task.turns, self._state
        if turns is None:
            return self._search_on(table, rules)
        while True:
            before = int(state[EDGES])
            answer = self._search_on(table, rules)
            if answer == PAUSED and state[EDGES] == before:
                answer = turns.beside(lambda: self._search_on(table, rules))
            if answer != PAUSED:
                return answer
            turns.pause()
            state[LOOKS] = LOOKS_IN_A_TURN

    def _search_on(self, table: SpaceTable, rules: EdgeRules) -> int:
        answer: int = search(
            self._task.plan.checked,
            rules,
            self._task.stop,
            SearchTables(
                table,
                self._longest_step,
                self._trees,
                self._path,
                self._samples,
                self._state,
                *self._own_scratch,
            ),
            self.scratch,
        )
        return answer

    def _grow(self) -> bool:
        """Double the room of the trees; tell whether they may have more."""
        old = self._trees
        count, nq = old.nodes.shape[1:]
        if count >= _MOST_NODES:
            return False
        new = _room(2 * count, nq)
        for kept, more in zip(old[:2], new[:2], strict=True):
            more[:, :count] = kept
        self._trees = new._replace(sizes=old.sizes, gap=old.gap)
        return True

    def _joined(self) -> tuple[NDArray[np.float64], int]:
        """Return the path through the nodes in which the trees met, with all turns counted."""
        met = {int(self._state[TREE]): int(self._state[NEAR])}
        met[1 - int(self._state[TREE])] = int(self._state[TARGET])
        first, second = (self._way_to_root(tree, met[tree]) for tree in (0, 1))
        there = self._trees.nodes[1, second]
        turns = self._task.space.turns(self._trees.nodes[0, first[0]], there[0])
        here = self._trees.nodes[0, first[::-1]]
        path = np.concatenate([here, there[1:] + turns])
        return self._task.space.settled(path), second[-1]

    def _way_to_root(self, tree: int, node: int) -> list[int]:
        way = [node]
        while self._trees.parents[tree, way[-1]] >= 0:
            way.append(int(self._trees.parents[tree, way[-1]]))
        return way


def _room(count: int, nq: int) -> Trees:
    return Trees(
        np.empty((2, count, nq)),
        np.empty((2, count), np.int64),
        np.zeros(2, np.int64),
        np.full(1, np.inf),
    )
