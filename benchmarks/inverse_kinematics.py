"""Poses of a Panda's hand per second, beside Pinocchio, and what more tries are worth.

``python -m benchmarks.inverse_kinematics`` prints the table. Each answer is compared with its pose
by the poses of links, so that a speed-up that misses shows. All is processor time of one process.
Pinocchio has no solver: its row is the loop of damped least squares of its documentation, from ten
starts; where it is not installed it is left out, and that is said. ``--write`` writes
docs/inverse_kinematics.csv and .png: for each number of tries the poses that are left, and the
time, of three arms, of a Panda in its cell, and at limits. ``--quick`` takes a tenth of the poses.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
import csv
from functools import partial
import importlib
import os
from pathlib import Path
import time
from typing import Any, NamedTuple

for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

import numpy as np  # noqa: E402

from benchmarks.machine import machine  # noqa: E402
from scene_graph_ros.planning import (  # noqa: E402
    inverse_kinematics,
    inverse_kinematics_of_poses,
    load_robot_diagram,
    PoseTarget,
    SceneGraphCollisionChecker,
)
from scene_graph_ros.robots import KinematicTree  # noqa: E402
from scene_graph_ros.scene_files import load_kinematic_tree, resolve_resource  # noqa: E402

__all__ = ["main"]

_ROBOTS = "package://example-robot-data/robots"
_PANDA = f"{_ROBOTS}/panda_description/urdf/panda.urdf"
_OTHERS = {
    "UR5": (f"{_ROBOTS}/ur_description/urdf/ur5_robot.urdf", "tool0"),
    "Tiago": (f"{_ROBOTS}/tiago_description/robots/tiago.urdf", "arm_tool_link"),
}
_HAND = "panda_hand"
_NEAR = np.array([0.0, -0.4, 0.0, -2.0, 0.0, 1.6, 0.8, 0.02])
_COUNT = 16_000
_SLOW = 200
"""Poses for what answers one by one."""
_TRIES = (1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 128)
_TOLERANCE = 1e-9
_DOCS = Path(__file__).parents[1] / "docs"


class _Row(NamedTuple):
    name: str
    microseconds: float
    reached: float
    """The share of poses that are reached to 1e-9 m and rad."""
    free: float
    """The share of them without collisions."""


def _random(tree: KinematicTree, rng: np.random.Generator, count: int) -> np.ndarray:
    lower, upper = np.maximum(tree.lower, -np.pi), np.minimum(tree.upper, np.pi)
    return rng.uniform(lower, upper, (count, tree.num_positions))


def _timed(ask: Callable[[], Any]) -> tuple[float, Any]:
    """Return the least processor time of three runs, s, and an answer."""
    times = []
    for _ in range(3):
        begin = time.process_time()
        answer = ask()
        times.append(time.process_time() - begin)
    return min(times), answer


class _Panda:
    """Poses of the hand, and what becomes of answers."""

    def __init__(self, count: int) -> None:
        self.checker = SceneGraphCollisionChecker(
            load_robot_diagram("config/scenes/panda_cell.yaml")
        )
        self.tree = self.checker.plan.tree
        rng = np.random.default_rng(0)
        q = _random(self.tree, rng, 4 * count)
        self.q = q[self.checker.check_configs_collision_free(q)][:count]
        self.X_WTs = self.tree.link_poses(self.q, [_HAND])[:, 0]

    def row(self, name: str, seconds: float, q: np.ndarray) -> _Row:
        """Judge configurations of the first poses."""
        X, X_WTs = self.tree.link_poses(q, [_HAND])[:, 0], self.X_WTs[: len(q)]
        turns = np.linalg.norm(X[:, :3, :3] - X_WTs[:, :3, :3], axis=(1, 2)) / np.sqrt(2.0)
        ways = np.linalg.norm(X[:, :3, 3] - X_WTs[:, :3, 3], axis=1)
        reached = (turns <= 1.01 * _TOLERANCE) & (ways <= 1.01 * _TOLERANCE)
        free = self.checker.check_configs_collision_free(q[reached])
        return _Row(name, 1e6 * seconds / len(q), reached.mean(), free.mean() if len(free) else 0)


def _ours(panda: _Panda) -> list[_Row]:
    rows, X_WTs = [], panda.X_WTs
    asked: dict[str, tuple[Any, dict[str, Any]]] = {
        "ours, any configuration": (panda.tree, {}),
        "ours, the nearest to one": (panda.tree, {"near": _NEAR}),
        "ours, free of collisions": (panda.checker, {}),
        "ours, free and the nearest": (panda.checker, {"near": _NEAR}),
    }
    for name, (robots, options) in asked.items():
        inverse_kinematics_of_poses(robots, _HAND, X_WTs[:8], **options)
        seconds, found = _timed(
            partial(inverse_kinematics_of_poses, robots, _HAND, X_WTs, **options)
        )
        rows.append(panda.row(name, seconds, found.configurations))
    few = X_WTs[:_SLOW]
    ask = lambda: [inverse_kinematics_of_poses(panda.checker, _HAND, [X]) for X in few]  # noqa: E731
    seconds, found = _timed(ask)
    q = np.concatenate([each.configurations for each in found])
    rows.append(panda.row("ours, free, pose by pose", seconds, q))
    seconds, found = _timed(
        lambda: [inverse_kinematics(panda.checker, PoseTarget(_HAND, X), near=_NEAR) for X in few]
    )
    q = np.array([each.nearest for each in found])
    rows.append(panda.row("ours, `inverse_kinematics`", seconds, q))
    return rows


def _pinocchio(panda: _Panda) -> list[_Row]:
    """Damped least squares, as Pinocchio's documentation has them, of ten random starts."""
    pinocchio = importlib.import_module("pinocchio")

    model = pinocchio.buildModelFromUrdf(str(resolve_resource(_PANDA)))
    model = pinocchio.buildReducedModel(model, [8, 9], pinocchio.neutral(model))
    data, hand = model.createData(), model.getFrameId(_HAND)
    lower, upper = model.lowerPositionLimit, model.upperPositionLimit
    X_WB = panda.tree.link_poses(_NEAR, ["panda_link0"])[0]
    rng = np.random.default_rng(1)

    def solve(X_WT: np.ndarray) -> np.ndarray:
        goal = pinocchio.SE3(np.linalg.inv(X_WB) @ X_WT)
        q = _NEAR[:7].copy()
        for _ in range(10):
            for _ in range(100):
                pinocchio.framesForwardKinematics(model, data, q)
                iMd = data.oMf[hand].actInv(goal)
                error = pinocchio.log(iMd).vector
                if np.linalg.norm(error) < 0.5 * _TOLERANCE:
                    return q
                J = pinocchio.computeFrameJacobian(model, data, q, hand)
                J = -pinocchio.Jlog6(iMd.inverse()) @ J
                v = -J.T @ np.linalg.solve(J @ J.T + 1e-8 * np.eye(6), error)
                v *= min(1.0, 0.8 / np.abs(v).max())
                q = np.clip(q + v, lower, upper)
            q = rng.uniform(lower, upper)
        return q

    few = panda.X_WTs[: _SLOW // 4]
    seconds, q = _timed(lambda: [solve(X) for X in few])
    return [panda.row("Pinocchio, in a Python loop", seconds, _with_fingers(np.array(q)))]


def _with_fingers(q: np.ndarray) -> np.ndarray:
    return np.concatenate([q, np.full((len(q), 1), _NEAR[7])], axis=1)


def _peers(panda: _Panda) -> list[_Row]:
    try:
        return _pinocchio(panda)
    except ImportError:
        print("Pinocchio is not installed, and left out")
        return []


def _table(rows: Sequence[_Row]) -> str:
    lines = [
        "| | µs a pose | poses a second | reached | of them free |",
        "| --- | ---: | ---: | ---: | ---: |",
    ]
    for row in rows:
        rate, reached = float(f"{1e6 / row.microseconds:.2g}"), 100.0 * row.reached
        lines.append(
            f"| {row.name} | {row.microseconds:.3g} | {rate:.0f} |"
            f" {reached:.2f} % | {100.0 * row.free:.1f} % |"
        )
    return "\n".join(lines)


def _curves(panda: _Panda, count: int) -> list[tuple[str, int, float, float]]:
    """Return rows: name, tries, the share of poses that are left, and microseconds a pose."""
    rng = np.random.default_rng(3)
    trees = {
        name: (load_kinematic_tree(resolve_resource(path)), link)
        for name, (path, link) in _OTHERS.items()
    }
    tree = panda.tree
    corners = np.where(rng.random((count, tree.num_positions)) < 0.5, tree.lower, tree.upper)
    asked: dict[str, tuple[Any, str, np.ndarray]] = {
        "Panda": (tree, _HAND, panda.q[:count]),
        "Panda, free of collisions": (panda.checker, _HAND, panda.q[:count]),
        "Panda, each joint at a limit": (tree, _HAND, corners),
    }
    for name, (other, link) in trees.items():
        asked[name] = (other, link, _random(other, rng, count))
    result = []
    for name, (robots, link, q) in asked.items():
        own = robots if isinstance(robots, KinematicTree) else robots.plan.tree
        X_WTs = own.link_poses(q, [link])[:, 0]
        for tries in _TRIES:
            seconds, found = _timed(
                partial(inverse_kinematics_of_poses, robots, link, X_WTs, tries=tries)
            )
            left = 1.0 - float(found.is_success.mean())
            result.append((name, tries, left, 1e6 * seconds / count))
    return result


def _write(curves: Sequence[tuple[str, int, float, float]], count: int, folder: Path) -> None:
    from matplotlib import pyplot

    with (folder / "inverse_kinematics.csv").open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(("arm", "tries", "share_left", "microseconds"))
        writer.writerows((n, t, f"{left:.6g}", f"{us:.3g}") for n, t, left, us in curves)
    figure, (by_tries, by_time) = pyplot.subplots(1, 2, figsize=(11, 4.4), sharey=True)
    least = 0.5 / count
    for name in dict.fromkeys(row[0] for row in curves):
        rows = [row for row in curves if row[0] == name]
        left = [max(row[2], least) for row in rows]
        by_tries.plot([row[1] for row in rows], left, "o-", ms=4, label=name)
        by_time.plot([row[3] for row in rows], left, "o-", ms=4, label=name)
    for axis, words in ((by_tries, "tries a pose, at most"), (by_time, "µs a pose, on average")):
        axis.set(xscale="log", yscale="log", xlabel=words)
        axis.axhline(least, color="0.7", lw=0.8)
        axis.grid(alpha=0.3)
    by_tries.set_ylabel("poses that are not reached to 1e-9")
    by_tries.text(1.0, 1.1 * least, f"none of {count}", color="0.4", fontsize=8)
    by_time.legend(fontsize=8)
    figure.tight_layout()
    figure.savefig(folder / "inverse_kinematics.png", dpi=110)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="a tenth of the poses")
    parser.add_argument("--write", action="store_true", help="write the picture and its numbers")
    options = parser.parse_args(arguments)
    load, count = os.getloadavg()[0], _COUNT // 10 if options.quick else _COUNT
    panda = _Panda(count)
    print(machine(load))
    print(_table([*_ours(panda), *_peers(panda)]))
    if options.write:
        few = count // 4
        _write(_curves(panda, few), few, _DOCS)


if __name__ == "__main__":
    main()
