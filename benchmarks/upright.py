"""Paths and motions of a hand that stays upright, by how exactly: solved, and in which time.

``python -m benchmarks.upright`` prints the table: a Panda and a UR5 among the demo's obstacles,
between random poses of the hand that point down. Times are of the processor, each of one call;
tilts are those of samples. ``--quick`` takes a fifth of the problems.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
import os
from pathlib import Path
import tempfile
import time
from typing import NamedTuple

for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

import numpy as np  # noqa: E402
import yaml  # noqa: E402

from benchmarks.machine import machine  # noqa: E402
from scene_graph_ros.planning import (  # noqa: E402
    AngleBetweenVectorsConstraint,
    inverse_kinematics,
    load_robot_diagram,
    plan_path,
    plan_trajectory,
    PoseTarget,
    SceneGraphCollisionChecker,
)
from scene_graph_ros.planning.trajectories import MotionLimits  # noqa: E402

__all__ = ["main"]

_SCENE = Path(__file__).parents[1] / "config" / "scenes" / "panda_cell.yaml"
_UR5 = "package://example-robot-data/robots/ur_description"
_TILTS = (0.3, 0.05, 0.005, 5e-4)
_PROBLEMS, _TIMEOUT = 20, 20.0
_ACCELERATION, _JERK = 15.0, 500.0


class _Arm(NamedTuple):
    checker: SceneGraphCollisionChecker
    hand: str
    group: str | None
    home: np.ndarray
    limits: MotionLimits


def _panda() -> _Arm:
    checker = SceneGraphCollisionChecker(load_robot_diagram(_SCENE))
    home = np.array([0.0, -0.4, 0.0, -2.0, 0.0, 1.6, 0.8, 0.02])
    names = tuple(f"panda_joint{i}" for i in range(1, 8))
    limits = MotionLimits([2.175] * 4 + [2.61] * 3, [_ACCELERATION] * 7, names, [_JERK] * 7)
    return _Arm(checker, "panda_hand", "arm", home, limits)


def _ur5() -> _Arm:
    """Return a UR5 in place of the Panda."""
    scene = yaml.safe_load(_SCENE.read_text())
    (robot,) = scene["robots"]
    robot["urdf"], robot["srdf"] = f"{_UR5}/urdf/ur5_robot.urdf", f"{_UR5}/srdf/ur5.srdf"
    del robot["group_state"], scene["cameras"]
    for each in scene["geometries"]:
        if "file" in each["shape"]:
            each["shape"]["file"] = str(_SCENE.parent / each["shape"]["file"])
    between = [["panda/base_link"], ["cell/world/pedestal"]]
    scene["collision_filters"] = [{"action": "exclude", "between": between}]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "cell.yaml"
        path.write_text(yaml.safe_dump(scene))
        checker = SceneGraphCollisionChecker(load_robot_diagram(path))
    limits = MotionLimits.of_tree(checker.plan.tree, accelerations=_ACCELERATION, jerks=_JERK)
    home = np.array([0.0, -1.2, 1.5, -1.9, -1.57, 0.0])
    return _Arm(checker, "tool0", None, home, limits)


def _ends(arm: _Arm, count: int) -> list[np.ndarray]:
    """Return free configurations whose hand points down, at random places about the arm."""
    rng, found = np.random.default_rng(0), []
    while len(found) < count:
        X, yaw, turn = np.eye(4), rng.uniform(-np.pi, np.pi), rng.uniform(-2.5, 2.5)
        c, s, far = np.cos(yaw), np.sin(yaw), rng.uniform(0.35, 0.7)
        X[:3, :3] = [[c, s, 0.0], [s, -c, 0.0], [0.0, 0.0, -1.0]]
        X[:3, 3] = far * np.cos(turn), far * np.sin(turn), rng.uniform(0.5, 1.3)
        target = PoseTarget(arm.hand, X)
        answer = inverse_kinematics(arm.checker, target, near=arm.home, group=arm.group, tries=32)
        found += list(answer.configurations)
    return found


def _row(name: str, arm: _Arm, tilt: float, count: int) -> str:
    """Return a line of the table."""
    ends = _ends(arm, 2 * count)
    down = AngleBetweenVectorsConstraint(arm.hand, [0, 0, -1], [0, 0, 1], tilt)
    how = {"group": arm.group, "constraints": [down], "timeout": _TIMEOUT}
    plan_trajectory(arm.checker, ends[0], ends[0], arm.limits, **how)
    paths, motions, edges, ratios, worst = [], [], [], [], 0.0
    for start, goal in zip(ends[::2], ends[1::2], strict=True):
        begin = time.process_time()
        plan = plan_path(arm.checker, start, goal, **how)
        paths.append(time.process_time() - begin if plan.is_success else np.inf)
        begin = time.process_time()
        motion = plan_trajectory(arm.checker, start, goal, arm.limits, **how)
        motions.append(time.process_time() - begin if motion.is_success else np.inf)
        free = plan_trajectory(
            arm.checker, start, goal, arm.limits, group=arm.group, timeout=_TIMEOUT
        )
        if plan.is_success and motion.is_success and free.is_success:
            edges.append(len(plan.configurations) - 1)
            ratios.append(motion.duration / free.duration)
            q = motion.trajectory.value(np.linspace(0.0, motion.duration, 1000))
            z = arm.checker.plan.tree.link_poses(q, [arm.hand])[:, 0, :3, 2]
            off = np.arctan2(np.hypot(z[:, 0], z[:, 1]), -z[:, 2]).max()
            worst = max(worst, float(off) / tilt)
    numbers = (1e3 * np.median(paths), 1e3 * max(paths), 1e3 * np.median(motions))
    solved = f"{np.isfinite(paths).sum()}, {np.isfinite(motions).sum()} of {count}"
    return (
        f"| {name}, {tilt:g} | {solved} | {numbers[0]:.0f} | {numbers[1]:.0f} |"
        f" {np.median(edges):.0f} | {numbers[2]:.0f} | {np.median(ratios):.2f} | {worst:.3f} |"
    )


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="a fifth of the problems")
    count = _PROBLEMS // 5 if parser.parse_args(arguments).quick else _PROBLEMS
    print(machine(os.getloadavg()[0]))
    print(
        "| arm, tilt rad | paths, motions | path, ms | most | edges | motion, ms | by free motions"
        " | largest tilt |\n| --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: |"
    )
    for name, arm in (("Panda", _panda()), ("UR5", _ur5())):
        for tilt in _TILTS:
            print(_row(name, arm, tilt, count), flush=True)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
