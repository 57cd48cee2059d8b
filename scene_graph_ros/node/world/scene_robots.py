"""The robots of a version of the scene, and their models for planning."""

from __future__ import annotations

from collections.abc import Mapping
import threading
from typing import Any, TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from scene_graph_ros.geometry import SceneGraph
    from scene_graph_ros.geometry.model.context import Context
    from scene_graph_ros.geometry.model.snapshot import Snapshot
    from scene_graph_ros.node.world.planning_robots import PlanningRobots

__all__ = ["SceneRobots"]


class SceneRobots:
    """All robots, each a source by whose name it goes."""

    def __init__(
        self,
        robots: Mapping[str, Any],
        scene_graph: SceneGraph,
        context: Context,
        paddings: Mapping[tuple[Any, Any], float],
    ) -> None:
        """Take robots, their scene, and the paddings (m) of single pairs: see `PaddedSide`."""
        self.robots, self.scene_graph, self.context = robots, scene_graph, context
        self._paddings = paddings
        self._lock = threading.Lock()
        self._planning: PlanningRobots | None = None

    def planning(
        self, snapshot: Snapshot, bases: Mapping[str, NDArray[np.float64]]
    ) -> PlanningRobots:
        """Return the robots as planning sees them, made once for the model of ``snapshot``.

        Where a robot stands elsewhere, by its base ``(4, 4)``, all but that is used again. Imports
        planning.
        Raises UnknownIdError where there is no robot.
        """
        from scene_graph_ros.node.world.planning_robots import PlanningRobots

        with self._lock:
            known = self._planning
            about = self.robots, self.scene_graph, self.context
            if known is None or not known.is_of(snapshot):
                known = PlanningRobots(*about, snapshot, self._paddings, bases)
            elif not known.fits(snapshot, bases):
                known = known.standing(*about, snapshot, bases)
            self._planning = known
            return known
