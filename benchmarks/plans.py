"""How long planning takes: a Panda in its cell, or the problems of MotionBenchMaker.

``python -m benchmarks.plans`` plans between random configurations over the table and in the shelf
of ``config/scenes/panda_cell.yaml``. MotionBenchMaker's 700 problems of a Panda (Chamzas and
others, *MotionBenchMaker: A Tool to Generate and Benchmark Motion Planning Datasets*, 2022) are in
the sources of the package ``vamp-planner``, which is not needed otherwise::

    python -m benchmarks.plans --all

downloads these sources and plans for all 700; ``--count 3`` for the first 3 of each set only. With
``--problems FILE`` nothing is downloaded: the file has the sources, or the problems alone. Times
are of the processor, for one call of `plan_path` each, shortcuts and proofs included. ``--ompl``
adds OMPL's RRT-Connect with our proofs, and the same with MuJoCo's checks of samples, which
``make peers`` installs; of paths of the latter it is counted how many collide. ``--savings`` plans
with several values of ``least_saving`` instead, to see what shorter paths cost.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cache, partial
import os
from pathlib import Path
import subprocess
import sys
import tarfile
import tempfile
import time
from typing import Any, IO, NamedTuple

import numpy as np
import yaml

from benchmarks.machine import machine
from benchmarks.ompl_mujoco import SampledPlanner
from scene_graph_ros.geometry import (
    Box,
    Cylinder,
    GeometryInstance,
    ProximityProperties,
    SceneGraph,
    Shape,
    Sphere,
)
from scene_graph_ros.geometry.spatial.poses import poses_from_quaternions
from scene_graph_ros.planning import (
    EdgeStatus,
    load_robot_diagram,
    OmplPlanner,
    plan_path,
    RobotDiagram,
    SceneGraphCollisionChecker,
)
from scene_graph_ros.planning.paths.search.path_search import LEAST_SAVING
from scene_graph_ros.robots import RobotModel, SemanticModel
from scene_graph_ros.scene_files import load_srdf, load_urdf, register_robot

__all__ = ["Problem", "download", "main", "moveit_problems", "panda", "shelf_problems"]

_CELL = "config/scenes/panda_cell.yaml"
_PANDA = "package://example-robot-data/robots/panda_description"
_SOURCES, _VERSION = "vamp-planner", "0.6.4"
_ARCHIVE = "resources/panda/problems.tar.bz2"
_REGIONS = (
    ((-0.37, 0.66, 0.36), (0.27, 0.98, 0.76)),
    ((-0.37, 0.66, 0.81), (0.27, 0.98, 1.23)),
    ((0.3, -0.5, 0.46), (0.9, 0.5, 0.8)),
)
"""Corners (W, metres) of where the Panda's fingers are: two compartments, and over the table."""
_FINGERS = 0.1
"""Metres from the hand's origin."""
_OPENING = 0.02
"""Metres, of each finger."""
_DRAWN = 20000


class Problem(NamedTuple):
    """A path to find."""

    kind: str
    checker: SceneGraphCollisionChecker
    start: np.ndarray
    goal: np.ndarray


def shelf_problems(count: int, seed: int = 0) -> Iterator[Problem]:
    """Yield problems from each region to the next, between random free configurations."""
    robots = load_robot_diagram(_CELL)
    checker, tree = SceneGraphCollisionChecker(robots), robots.tree
    rng = np.random.default_rng(seed)
    found: list[list[np.ndarray]] = [[] for _ in _REGIONS]
    while min(map(len, found)) < count:
        q = rng.uniform(tree.lower, tree.upper, (_DRAWN, tree.num_positions))
        q[:, tree.position_index("panda_finger_joint1")] = _OPENING
        X_WH = tree.link_poses(q, ["panda_hand"])[:, 0]
        p_WF = X_WH[:, :3, 3] + _FINGERS * X_WH[:, :3, 2]
        for ends, (lower, upper) in zip(found, _REGIONS, strict=True):
            near = q[((p_WF > lower) & (p_WF < upper)).all(axis=1)]
            ends.extend(near[checker.check_configs_collision_free(near)])
    for k in range(count):
        i = k % len(_REGIONS)
        yield Problem("shelf", checker, found[i][k], found[(i + 1) % len(_REGIONS)][k])


def moveit_problems(
    archive: Path, count: int | None = None, *, sets: Sequence[str] | None = None
) -> Iterator[Problem]:
    """Yield the first ``count`` problems of each set in an archive, or of some ``sets``.

    That is ``problems.tar.bz2``, or sources with it in them: ``<set>/scene<number>.yaml`` and
    ``<set>/request<number>.yaml``, as MoveIt writes planning scenes and requests.
    """
    with tarfile.open(archive) as outer:
        inner = [name for name in outer.getnames() if name.endswith(_ARCHIVE)]
        if inner:
            with tarfile.open(fileobj=_opened(outer, inner[0])) as problems:
                yield from _problems(problems, count, sets)
        else:
            yield from _problems(outer, count, sets)


def _opened(archive: tarfile.TarFile, name: str) -> IO[bytes]:
    file = archive.extractfile(name)
    if file is None:
        raise ValueError(f"{name} is no file")
    return file


def _problems(
    archive: tarfile.TarFile, count: int | None, sets: Sequence[str] | None
) -> Iterator[Problem]:
    names = sorted(name for name in archive.getnames() if name.endswith(".yaml"))
    kinds: dict[str, list[str]] = {}
    for name in names:
        folder, _, file = name.rpartition("/")
        if file.startswith("scene"):
            kinds.setdefault(folder, []).append(file.removeprefix("scene"))
    for folder, numbers in kinds.items():
        kind = folder.rpartition("/")[2].removesuffix("_panda")
        if sets is not None and kind not in sets:
            continue
        for number in numbers[:count]:
            scene, request = (
                yaml.load(_opened(archive, f"{folder}/{what}{number}"), yaml.CSafeLoader)
                for what in ("scene", "request")
            )
            robots = _moveit_scene(scene)
            start, goal = _ends(robots, request)
            yield Problem(kind, SceneGraphCollisionChecker(robots), start, goal)


@cache
def panda() -> tuple[RobotModel, SemanticModel]:
    """Return the Panda of the package example-robot-data."""
    model = load_urdf(f"{_PANDA}/urdf/panda.urdf")
    return model, load_srdf(f"{_PANDA}/srdf/panda.srdf", model)


def download(folder: str) -> Path:
    """Have pip put the sources that the problems are in into a folder."""
    command = [sys.executable, "-m", "pip", "download", "--quiet", "--no-deps"]
    command += ["--no-binary", _SOURCES, "--dest", folder, f"{_SOURCES}=={_VERSION}"]
    subprocess.run(command, check=True)
    (file,) = Path(folder).glob("*.tar.gz")
    return file


def _moveit_scene(scene: dict[str, Any]) -> RobotDiagram:
    """Return a Panda among the collision objects of a planning scene."""
    model, semantics = panda()
    scene_graph = SceneGraph()
    source = scene_graph.register_source("panda")
    frames = register_robot(model, scene_graph, source, semantics=semantics, visual=False)
    for thing in scene["world"]["collision_objects"]:
        X_WT = _pose(thing["pose"]) if "pose" in thing else np.eye(4)
        shapes = zip(thing["primitives"], thing["primitive_poses"], strict=True)
        for k, (primitive, pose) in enumerate(shapes):
            name = f"{thing['id']}_{k}"
            instance = GeometryInstance(X_WT @ _pose(pose), _shape(primitive), name)
            instance.set_proximity_properties(ProximityProperties())
            scene_graph.register_anchored_geometry(source, instance)
    # The data set has wider limits of joint 4 and of the fingers.
    limits = {"panda_joint4": 0.0175, "panda_finger_joint1": 0.065, "panda_finger_joint2": 0.065}
    tree = model.kinematic_tree(semantics)
    joints = (replace(j, upper=limits.get(j.name, j.upper)) for j in tree.joints)
    tree = replace(tree, joints=tuple(joints))
    return RobotDiagram(scene_graph, scene_graph.create_default_context(), tree, frames)


def _pose(pose: dict[str, Any]) -> np.ndarray:
    """Return a pose whose quaternion is x, y, z, w, as in messages."""
    return poses_from_quaternions(np.array([pose["position"]]), np.array([pose["orientation"]]))[0]


def _shape(primitive: dict[str, Any]) -> Shape:
    """Return a shape of ``shape_msgs/SolidPrimitive``: of a cylinder the height comes first."""
    match primitive["type"], primitive["dimensions"]:
        case "box", [x, y, z]:
            return Box(x, y, z)
        case "cylinder", [height, radius]:
            return Cylinder(radius, height)
        case "sphere", [radius]:
            return Sphere(radius)
    raise ValueError(f"unknown primitive: {primitive}")


def _ends(robots: RobotDiagram, request: dict[str, Any]) -> tuple[np.ndarray, np.ndarray]:
    """Return start and goal; the fingers stay as they are at the start."""
    tree, state = robots.tree, request["start_state"]["joint_state"]
    start = np.zeros(tree.num_positions)
    for name, position in zip(state["name"], state["position"], strict=True):
        if name in tree.position_names:
            start[tree.position_index(name)] = position
    goal = start.copy()
    for constraint in request["goal_constraints"][0]["joint_constraints"]:
        goal[tree.position_index(constraint["joint_name"])] = constraint["position"]
    return start, goal


class _Run(NamedTuple):
    kind: str
    seconds: float
    length: float
    clearance: float
    reason: str | None
    collides: bool = False


_Way = Callable[[Problem, float], _Run]


def _proven(
    problem: Problem,
    timeout: float,
    planner: str | OmplPlanner = "rrt_connect",
    least_saving: float = LEAST_SAVING,
) -> _Run:
    begin = time.process_time()
    plan = plan_path(
        problem.checker,
        problem.start,
        problem.goal,
        group="arm",
        timeout=timeout,
        planner=planner,
        least_saving=least_saving,
    )
    seconds = time.process_time() - begin
    return _Run(problem.kind, seconds, plan.length, plan.least_clearance, plan.reason)


def _sampled(problem: Problem, timeout: float, *, shortened: bool) -> _Run:
    """Plan by samples, whose model is made before time is counted; then look at the path."""
    planner = SampledPlanner(problem.checker, "arm")
    begin = time.process_time()
    found = planner.plan(problem.start, problem.goal, timeout, shortened=shortened)
    seconds, path = time.process_time() - begin, found.configurations
    if len(path) < 2:
        return _Run(problem.kind, seconds, 0.0, 0.0, "OMPL with MuJoCo found nothing in time")
    measures = problem.checker.measure_edges(np.stack([path[:-1], path[1:]], axis=1))
    length = float(np.linalg.norm(np.diff(path, axis=0), axis=1).sum())
    least = min(each.least_clearance for each in measures)
    hits = any(each.status is EdgeStatus.COLLIDES for each in measures)
    return _Run(problem.kind, seconds, length, least, None, hits)


_OURS: dict[str, _Way] = {"": _proven}
_WITH_OMPL: dict[str, _Way] = {
    **_OURS,
    "OMPL, our proofs": partial(_proven, planner=OmplPlanner("RRTConnect")),
    "OMPL, MuJoCo's samples, not shortened": partial(_sampled, shortened=False),
    "OMPL, MuJoCo's samples": partial(_sampled, shortened=True),
}
_SAVINGS: dict[str, _Way] = {
    f"least_saving={saving:g}": partial(_proven, least_saving=saving)
    for saving in (1.0, 0.1, 0.03, 0.01, 0.005, 0.002, 0.001, 0.0005, 0.0001)
}


def _row(kind: str, runs: Sequence[_Run]) -> str:
    solved = [run for run in runs if run.reason is None]
    times = 1e3 * np.array([run.seconds for run in runs])
    words = f"{kind:20} {len(solved):4}/{len(runs):<4}"
    words += f" {np.median(times):9.2f} {np.percentile(times, 95):9.2f}"
    if solved:
        lengths, kept = zip(*((run.length, run.clearance) for run in solved), strict=True)
        words += f" {np.median(lengths):9.2f} {1e3 * np.median(kept):9.3f} {1e3 * min(kept):9.3f}"
        words += f" {sum(run.collides for run in solved):7}"
    return words


def main(arguments: Sequence[str] | None = None) -> None:
    """Print a table: a row for each set, and why there are no paths where there are none."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--problems", type=Path, help="archive with MotionBenchMaker's problems")
    parser.add_argument("--all", action="store_true", help="download MotionBenchMaker's problems")
    parser.add_argument(
        "--count", type=int, help="problems of each set, if not all; 20 in the cell"
    )
    parser.add_argument("--ompl", action="store_true", help="beside OMPL's planner")
    parser.add_argument(
        "--savings", action="store_true", help="ours with several values of least_saving"
    )
    parser.add_argument("--timeout", type=float, default=10.0, help="seconds for each")
    parser.add_argument("--picture", type=Path, help="a file for the shares solved by time")
    options = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory() as folder:
        archive = download(folder) if options.all else options.problems
        if archive is None:
            problems = shelf_problems(options.count or 20)
        else:
            problems = moveit_problems(archive, options.count)
        ways = _SAVINGS if options.savings else _WITH_OMPL if options.ompl else _OURS
        runs = _print_table(problems, options.timeout, ways)
    if options.picture is not None:
        _draw(runs, options.picture)


def _draw(runs: Mapping[str, Sequence[_Run]], output: Path) -> None:
    """Write the share of problems that are solved by time, and without a collision."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axis = pyplot.subplots(figsize=(9, 4.5), layout="constrained")
    for colour, (name, mine) in enumerate(runs.items()):
        solved = sorted((run.seconds, run.collides) for run in mine if run.reason is None)
        times = [1e3 * seconds for seconds, _ in solved]
        share = np.arange(1, len(solved) + 1) / len(mine)
        sound = np.cumsum([not collides for _, collides in solved]) / len(mine)
        label = name or "scene_graph_ros"
        axis.step(times, share, where="post", color=f"C{colour}", label=label)
        if sound[-1:] < share[-1:]:
            axis.step(
                times, sound, "--", where="post", color=f"C{colour}", label=f"{label}: free paths"
            )
    axis.set_xscale("log")
    axis.set_xlabel("processor time, ms")
    axis.set_ylabel("share solved")
    axis.set_ylim(0.0, 1.02)
    axis.grid(alpha=0.3)
    axis.legend(loc="lower right", fontsize="small")
    figure.savefig(output, dpi=110)


def _print_table(
    problems: Iterable[Problem], timeout: float, ways: Mapping[str, _Way]
) -> dict[str, list[_Run]]:
    """Print the rows; return all runs of each way."""
    load = os.getloadavg()[0]
    runs: dict[str, dict[str, list[_Run]]] = {name: {} for name in ways}
    is_first = True
    for problem in problems:
        if is_first:  # Kernels are loaded by a first call, which is not measured.
            for way in ways.values():
                way(problem._replace(goal=problem.start), timeout)
            is_first = False
        for name, way in ways.items():
            runs[name].setdefault(problem.kind, []).append(way(problem, timeout))
    print(
        f"{'':20} {'solved':>9} {'median ms':>9} {'95 % ms':>9} {'length':>9} {'kept mm':>9}"
        f" {'least':>9} {'collide':>7}"
    )
    for name, kinds in runs.items():
        if name:
            print(f"{name}:")
        for kind, mine in kinds.items():
            print(_row(kind, mine))
        everything = [run for mine in kinds.values() for run in mine]
        if len(kinds) > 1:
            print(_row("all", everything))
        for run in everything:
            if run.reason is not None:
                print(f"{run.kind}: {run.reason}")
    print(machine(load), end="")
    return {name: [run for mine in kinds.values() for run in mine] for name, kinds in runs.items()}


if __name__ == "__main__":
    main()
