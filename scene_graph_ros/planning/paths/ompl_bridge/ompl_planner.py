"""A search for a path by one of OMPL's planners, in place of one by two trees of ours."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
import inspect
import math
import time
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.reals import as_float
from scene_graph_ros.planning.errors import PlanningError
from scene_graph_ros.planning.paths.ompl_bridge.ompl_library import get_ompl
from scene_graph_ros.planning.paths.ompl_bridge.ompl_space import OmplSpace
from scene_graph_ros.planning.paths.search.path_search import PathSearch, SearchTask

__all__ = ["OmplPlanner", "OmplSearch"]

_SEEDS = 2**31
"""OMPL's seeds are from 1 to this."""

_SHARE = 0.8
"""Of the time: then OMPL is told to end. Some of its planners notice late; shortcuts and proofs
need the rest."""


@one_line()
@dataclass(frozen=True)
class OmplPlanner:
    """A planner of OMPL's for `plan_path`: a class of ``ompl.geometric``, by its name.

    It ends with the first path. With ``edges``, one that finds shorter and shorter paths, such as
    ``"BITstar"``, ends when so many edges were looked at. ``parameters`` are for the planner's
    functions ``set...``: ``{"range": 0.5}`` calls ``setRange(0.5)``. Raises PlanningError for
    values that make no sense; a name or parameter that OMPL does not know is noticed by
    `plan_path`.
    """

    name: str
    edges: int | None = None
    parameters: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if not isinstance(self.name, str):
            raise PlanningError(f"name must be that of an OMPL planner, not {quoted(self.name)}")
        count = 1.0 if self.edges is None else as_float(self.edges)
        if count is None or count < 1.0 or not count.is_integer():
            raise PlanningError(f"edges must be an integer from 1 on, not {quoted(self.edges)}")
        if not isinstance(self.parameters, Mapping):
            raise PlanningError(f"parameters must be a mapping, not {quoted(self.parameters)}")

    def check_name(self) -> None:
        """Raise PlanningError for a name that OMPL does not know, and MissingOmplError."""
        known = _planners()
        if self.name not in known:
            raise PlanningError(
                f"OMPL has no planner {quoted(self.name)} for paths; it has {', '.join(known)}"
            )

    def new(self, information: Any) -> Any:
        """Return the ``ompl.base.Planner`` for a ``SpaceInformation``, its parameters set.

        Raises MissingOmplError and PlanningError.
        """
        self.check_name()
        planner = _planners()[self.name](information)
        setters = _setters(planner)
        for name, value in self.parameters.items():
            if name not in setters:
                raise PlanningError(
                    f"{self.name} has no parameter {quoted(name)}; it has {', '.join(setters)}"
                )
            try:
                setters[name](value)
            except TypeError as error:
                raise PlanningError(
                    f"parameter {name!r} of {self.name} can't be {quoted(value)}"
                ) from error
        return planner


def _planners() -> dict[str, Any]:
    """Return OMPL's geometric planners by name."""
    library = get_ompl()
    return {
        name: each
        for name, each in sorted(vars(library.geometric).items())
        if inspect.isclass(each) and issubclass(each, library.base.Planner)
    }


def _setters(planner: Any) -> dict[str, Any]:
    """Return the setters of a planner's parameters, by snake_case names."""
    found = {}
    for name in dir(planner):
        if name.startswith("set") and name[3:4].isupper():
            words = "".join(f"_{c.lower()}" if c.isupper() else c for c in name[3:])
            found[words.lstrip("_")] = getattr(planner, name)
    for name in ("name", "problem_definition"):
        found.pop(name, None)
    return found


def _set_seed(seed: int) -> None:
    """Seed the random numbers of all that OMPL makes from now on.

    OMPL says that this comes too late for generators made before, which nothing uses any more.
    """
    util = get_ompl().util
    level = util.getLogLevel()
    util.setLogLevel(util.LOG_NONE)
    util.RNG.setSeed(seed % _SEEDS + 1)
    util.setLogLevel(level)


class OmplSearch(PathSearch):
    """A search from one start to one of several goals.

    OMPL's random numbers are the process's, so it is the same for the same seed where no other
    one of OMPL's planners is at work.
    """

    def __init__(self, task: SearchTask, *, planner: OmplPlanner, timeout: float | None) -> None:
        super().__init__(task)
        self._asked = planner
        self._end = math.inf if timeout is None else time.monotonic() + _SHARE * timeout
        self._condition: Any = None
        self._bridge: OmplSpace | None = None

    @property
    def edges(self) -> int:
        """How many edges were looked at."""
        return super().edges + (self._bridge.edges if self._bridge else 0)

    @property
    def words(self) -> str:
        """How far it came, in words."""
        return f"OMPL's {self._asked.name} looked at {self.edges} edges"

    def find(
        self, start: NDArray[np.float64], goals: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], int] | None:
        """Return a path ``(n, nq)`` and the row of its goal; None where OMPL found none."""
        base = get_ompl().base
        _set_seed(self._task.seed)
        bridge = OmplSpace.of_search(self._task, self._end_in_time)
        self._bridge = bridge
        problem = base.ProblemDefinition(bridge.information)
        problem.addStartState(bridge.state(start))
        targets = base.GoalStates(bridge.information)
        for goal in goals:
            targets.addState(bridge.state(goal))
        problem.setGoal(targets)
        shortest = base.PathLengthOptimizationObjective(bridge.information)
        # What costs less than this is good enough: each path, or none.
        shortest.setCostThreshold(base.Cost(math.inf if self._asked.edges is None else 0.0))
        problem.setOptimizationObjective(shortest)
        planner = self._asked.new(bridge.information)
        planner.setProblemDefinition(problem)
        planner.setup()
        self._condition = self._new_condition()
        planner.solve(self._condition)
        if not problem.hasExactSolution():
            if time.monotonic() >= self._end:
                self._task.stop[0] = 1  # so that everybody knows why
            return None
        found = bridge.path(problem.getSolutionPath())
        return self._between(start, goals, found)

    def _new_condition(self) -> Any:
        """Return the termination condition of the planner: the time, or `_end_in_time`.

        It asks nothing of Python, as some planners ask it in threads that they wait for.
        """
        base = get_ompl().base
        if math.isinf(self._end):
            return base.plannerNonTerminatingCondition()
        left = max(self._end - time.monotonic(), 0.0)
        return base.plannerOrTerminationCondition(
            base.timedPlannerTerminationCondition(left), base.plannerNonTerminatingCondition()
        )

    def _end_in_time(self) -> None:
        """End the planner when it is told to stop, or has looked at its edges."""
        most = self._asked.edges
        is_full = most is not None and self.edges >= most
        if self._condition is not None and (is_full or self._task.stop[0] != 0):
            self._condition.terminate()

    def _between(
        self, start: NDArray[np.float64], goals: NDArray[np.float64], path: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], int]:
        """Return a path with the ends that were asked for, but for full turns of the last one."""
        space = self._task.space
        row = int(np.argmin(space.distances(path[-1], goals)))
        result = [start]
        for q in (*path[1:-1], goals[row]):
            result.append(q + space.turns(result[-1], q))
        return space.settled(np.array(result)), row
