"""Which of a model's robots a checker is for."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.model.snapshot import Snapshot
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.located import suggestion
from scene_graph_ros.planning.diagrams.robot_diagram import RobotDiagram
from scene_graph_ros.planning.errors import CollisionCheckerError

__all__ = ["RobotInstances", "robot_instances"]


class RobotInstances(NamedTuple):
    """Some robots of a model; the others move with their own positions, as surroundings."""

    links: frozenset[int] | None
    """The links (rows of the tree) of these robots; None: all are."""
    others: NDArray[np.int64]
    """``(k,)``: the positions (entries of q) of the other robots."""

    def has(self, link: int) -> bool:
        """Tell whether a link is one of these robots'; -1 is none."""
        return link >= 0 and (self.links is None or link in self.links)


def robot_instances(
    model: RobotDiagram, snapshot: Snapshot, names: Iterable[str] | None
) -> RobotInstances:
    """Return the robots of these names, which are their sources'; None stands for all.

    Raises CollisionCheckerError for names of no robot, and where there is none.
    """
    if names is None:
        return RobotInstances(None, np.empty(0, dtype=np.int64))
    inspector, tree = snapshot.inspector, model.tree
    owners = {link: inspector.get_owning_source_name(f) for link, f in model.frames.items()}
    known = sorted(set(owners.values()))
    given: Any = [names] if isinstance(names, str) else names
    if not isinstance(given, Iterable):
        raise CollisionCheckerError(f"robot_model_instances must be names, not {quoted(given)}")
    given = list(given)
    for name in given:
        if name not in known:
            near = suggestion(str(name), known)
            raise CollisionCheckerError(
                f"robot_model_instances: there is no robot {quoted(name)}{near}"
            )
    if not given:
        raise CollisionCheckerError(
            f"robot_model_instances must be names, one at least, of {', '.join(map(repr, known))}"
        )
    if set(given) == set(known):
        return RobotInstances(None, np.empty(0, dtype=np.int64))
    # Where there are several robots, names of joints and links begin with the robot's.
    prefixes = {link.split("/", 1)[0] for link, owner in owners.items() if owner in given}

    def is_own(name: str) -> bool:
        return name.split("/", 1)[0] in prefixes

    links = frozenset(row for row, link in enumerate(tree.link_names) if is_own(link))
    others = [k for k, name in enumerate(tree.position_names) if not is_own(name)]
    return RobotInstances(links, np.array(others, dtype=np.int64))
