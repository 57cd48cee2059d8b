"""A user's module about a robot: planning."""

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.planning import (
    EdgeMeasure,
    load_robot_diagram,
    Plan,
    plan_path,
    SceneGraphCollisionChecker,
)


def plan(path: str, goal: list[float]) -> Plan:
    """Plan from a random configuration."""
    diagram = load_robot_diagram(path)
    checker = SceneGraphCollisionChecker(diagram)
    start: NDArray[np.float64] = diagram.tree.sample(np.random.default_rng(0), 1)[0]
    return plan_path(checker, start, goal, timeout=5.0)


def complaint(checker: SceneGraphCollisionChecker, q: list[float]) -> str:
    """Name a pair that collides."""
    pair = checker.find_colliding_pair(q)
    return "" if pair is None else f"{pair.name_A} {pair.id_A.get_value()} {pair.name_B}"


def name_of(measure: EdgeMeasure) -> str:
    """Name what an edge collides with."""
    return "" if measure.pair is None else measure.pair.name_B
