"""The scenes: mixed shapes, hulls, a pile, a warehouse, robots, a robot in a fixed world."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import combinations

import numpy as np

from benchmarks.speed.engines.ours import Ours
from benchmarks.speed.scenes import (
    Body,
    Compliance,
    draw_hull,
    draw_points,
    draw_primitive,
    random_rotations,
    Scene,
    small_rotations,
    volume,
    WORLD,
)
from scene_graph_ros.geometry import (
    Box,
    Capsule,
    Cylinder,
    HalfSpace,
    Role,
    SceneGraph,
    Sphere,
)
from scene_graph_ros.scene_files import Kinematics, load_srdf, load_urdf, register_robot

__all__ = ["COMPLIANT_SIZES", "OTHER_SCENES", "SETS", "compliant", "mixed"]

FILL = 0.05
"""Part of the volume that the shapes of the random scenes take."""
KINDS = 6
SETS = 8
"""Sets of poses of a scene; they are gone through forth and back, so nothing ever jumps."""
STEP = 0.01
"""Metres. Standard deviation of a step along each axis: 1 m/s at 100 Hz."""
TURN = 0.05
"""Radians. The same for turns."""
COMPLIANCE = Compliance(0.05, 1e6)
"""A mesh of some 5 cm, half to a sixth of the shapes' size; soft rubber."""
COMPLIANT_SIZES = (100, 1000)
ROBOTS = {
    "panda_description/urdf/panda.urdf": "panda_description/srdf/panda.srdf",
    "ur_description/urdf/ur5_gripper.urdf": "ur_description/srdf/ur5_gripper.srdf",
    "talos_data/robots/talos_reduced.urdf": "talos_data/srdf/talos.srdf",
    "baxter_description/urdf/baxter.urdf": "baxter_description/srdf/baxter_manipulation.srdf",
    "anymal_b_simple_description/robots/anymal-kinova.urdf": (
        "anymal_b_simple_description/srdf/anymal-kinova.srdf"
    ),
    "icub_description/robots/icub.urdf": "icub_description/srdf/icub.srdf",
}
"""URDF and SRDF of the package example-robot-data."""


def _free(shapes: list[object]) -> list[Body]:
    return [Body(k, shape, np.eye(4)) for k, shape in enumerate(shapes)]


def _scatter(rng: np.random.Generator, n: int, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Draw (n, 4, 4) poses with origins in a box."""
    poses = np.tile(np.eye(4), (n, 1, 1))
    poses[:, :3, :3] = random_rotations(rng, n)
    poses[:, :3, 3] = rng.uniform(low, high, (n, 3))
    return poses


def _wander(rng: np.random.Generator, poses: np.ndarray) -> np.ndarray:
    """Return (SETS, n, 4, 4) poses: from ``poses`` on, each a step further, as things move."""
    sets = [poses]
    for _ in range(SETS - 1):
        after = sets[-1].copy()
        after[:, :3, :3] = after[:, :3, :3] @ small_rotations(rng, TURN, len(poses))
        after[:, :3, 3] += rng.normal(scale=STEP, size=(len(poses), 3))
        sets.append(after)
    return np.array(sets)


def _pull_apart(rng: np.random.Generator, scene: Scene, side: float) -> np.ndarray:
    """Return such poses again, drawn anew for what collides until nothing does."""
    ours = Ours(scene)
    sets = scene.X_WF.copy()
    while (found := np.unique(np.concatenate([ours.colliding_frames(X) for X in sets]))).size:
        start = sets[0].copy()
        start[found, :3, 3] = rng.uniform(0.0, side, (len(found), 3))
        moved = _wander(rng, start[found])
        sets[:, found] = moved
    return sets


def _scattered(
    key: str, title: str, shapes: list[object], rng: np.random.Generator
) -> tuple[Scene, float]:
    """Scatter shapes in a cube that they fill to FILL; return also its side (m)."""
    n = len(shapes)
    side = (sum(map(volume, shapes)) / FILL) ** (1.0 / 3.0)
    corner = np.full(3, side)
    poses = _wander(rng, _scatter(rng, n, 0.0 * corner, corner))
    points = draw_points(rng, 0.0 * corner, corner)
    return Scene(key, title, _free(shapes), poses, points), side


def _random_scene(key: str, title: str, shapes: list[object], rng: np.random.Generator) -> Scene:
    """Scatter shapes in a cube that they fill to FILL, and again so that nothing collides."""
    scene, side = _scattered(key, title, shapes, rng)
    return replace(scene, apart_X_WF=_pull_apart(rng, scene, side))


def mixed(n: int, seed: int) -> Scene:
    """Return ``n`` shapes of 10 to 30 cm, evenly from six kinds."""
    rng = np.random.default_rng(seed)
    shapes = [draw_primitive(rng, k % KINDS) for k in range(n)]
    title = "mixed shapes (sphere, box, capsule, cylinder, ellipsoid, hull of 12), 5 % fill"
    return _random_scene("mixed", title, shapes, rng)


def compliant(n: int, seed: int) -> Scene:
    """Return ``n`` such shapes that all give way, so that they touch in contact surfaces."""
    rng = np.random.default_rng(seed)
    shapes = [draw_primitive(rng, k % KINDS) for k in range(n)]
    title = f"mixed compliant shapes, 5 % fill, resolution_hint {COMPLIANCE.resolution_hint:g} m"
    scene, _ = _scattered("compliant", title, shapes, rng)
    return replace(scene, compliance=COMPLIANCE)


def hulls(seed: int, n: int = 1000) -> Scene:
    """Return convex hulls of 50 to 500 vertices."""
    rng = np.random.default_rng(seed)
    shapes: list[object] = []
    for _ in range(n):
        a, b, c = rng.uniform(0.05, 0.15, 3)
        shapes.append(draw_hull(rng, int(rng.integers(50, 501)), a, b, c))
    title = f"{n} convex hulls of 50 to 500 vertices, 5 % fill"
    return _random_scene("hulls", title, shapes, rng)


def pile(seed: int, n: int = 1000) -> Scene:
    """Return a heap on a floor: every body touches most of its neighbours, a few mm deep."""
    rng = np.random.default_rng(seed)
    bodies = []
    for k in range(n):
        a, b, c = rng.uniform(0.1, 0.12, 3)
        shape = (Sphere(a / 2), Box(a, b, c), Capsule(a / 2, b / 3), Cylinder(a / 2, b))[k % 4]
        bodies.append(Body(k, shape, np.eye(4)))
    bodies.append(Body(WORLD, HalfSpace(), np.eye(4)))
    wide = int(np.ceil(n ** (1.0 / 3.0)))
    place = np.stack(np.unravel_index(np.arange(n), (wide, wide, wide)), axis=1).astype(float)
    place[:, :2] += 0.5 * (place[:, 2:] % 2.0)  # each layer rests in the gaps of the one below
    centres = 0.1 * place * [1.0, 1.0, 0.75] + [0.0, 0.0, 0.05]
    low, high = centres.min(axis=0), centres.max(axis=0)
    poses = _scatter(rng, n, low, high)
    poses[:, :3, 3] = centres
    sets = np.array([poses] * SETS)
    sets[..., :3, 3] += rng.uniform(-0.5 * STEP, 0.5 * STEP, (SETS, n, 3))
    return Scene("pile", f"a pile of {n} bodies on a floor", bodies, sets,
                 draw_points(rng, low, high))  # fmt: skip


def warehouse(seed: int, n: int = 10_000) -> Scene:
    """Return crates of 5 cm to 2 m, far from each other in a hall of 200 m by 200 m by 8 m."""
    rng = np.random.default_rng(seed)
    shapes: list[object] = []
    for k in range(n):
        a, b, c = 0.05 * 40.0 ** (rng.uniform() ** 3) * rng.uniform(0.5, 1.0, 3)
        shapes.append(Cylinder(a / 2, c) if k % 4 == 0 else Box(a, b, c))
    low, high = np.zeros(3), np.array([200.0, 200.0, 8.0])
    poses = _wander(rng, _scatter(rng, n, low, high))
    title = f"a sparse warehouse: {n} crates of 5 cm to 2 m in a hall, all of them moved"
    return Scene("warehouse", title, _free(shapes), poses, draw_points(rng, low, high))


def _load_robot(
    urdf: str, first_frame: int, rng: np.random.Generator
) -> tuple[list[Body], set[tuple[int, int]], np.ndarray]:
    """Return a robot's collision bodies, the pairs of frames that its SRDF disables, its poses.

    The poses (SETS, f, 4, 4) are those of its links while its joints move by some 0.1 rad.
    """
    folder = "package://example-robot-data/robots"
    model = load_urdf(f"{folder}/{urdf}")
    graph = SceneGraph()
    source = graph.register_source("robot")
    semantics = load_srdf(f"{folder}/{ROBOTS[urdf]}", model)
    frames = register_robot(model, graph, source, semantics=semantics, visual=False)
    row = {frame: first_frame + k for k, frame in enumerate(frames.values())}
    inspector = graph.model_inspector()
    bodies, one_of = [], {}
    for geometry_id in inspector.get_all_geometry_ids(Role.PROXIMITY):
        frame = row[inspector.get_frame_id(geometry_id)]
        X_FG = np.asarray(inspector.get_pose_in_frame(geometry_id))
        bodies.append(Body(frame, inspector.get_shape(geometry_id), X_FG))
        one_of[frame] = geometry_id
    excluded = {
        (f, g)
        for f, g in combinations(sorted(one_of), 2)
        if inspector.collision_filtered(one_of[f], one_of[g])
    }
    kinematics = Kinematics(model, links=tuple(frames))
    joints = list(kinematics.positions)
    start, end = rng.uniform(-0.5, 0.5, (2, len(joints)))
    ways = np.linspace(start, start + 0.2 * (end - start), SETS)
    X_WL = [kinematics.link_poses(joints, positions)[1] for positions in ways]
    return bodies, excluded, np.array(X_WL)


def robots(seed: int) -> Scene:
    """Return real robots with their collision meshes, close to each other in a row."""
    rng = np.random.default_rng(seed)
    bodies: list[Body] = []
    excluded: set[tuple[int, int]] = set()
    poses = np.empty((SETS, 0, 4, 4))
    for k, urdf in enumerate(ROBOTS):
        more, pairs, X_WL = _load_robot(urdf, poses.shape[1], rng)
        X_WL[..., 0, 3] += 0.7 * k
        bodies, excluded = bodies + more, excluded | pairs
        poses = np.concatenate([poses, X_WL], axis=1)
    points = draw_points(rng, np.array([-1.0, -1.0, 0.0]), np.array([4.0, 1.0, 2.0]))
    title = f"{len(ROBOTS)} real robots with their meshes and SRDF filters: {len(bodies)} bodies"
    return Scene("robots", title, bodies, poses, points, None, frozenset(excluded))


def fixed_world(seed: int, n: int = 10_000) -> Scene:
    """Return one moving robot among anchored shapes."""
    rng = np.random.default_rng(seed)
    bodies, excluded, X_WL = _load_robot(next(iter(ROBOTS)), 0, rng)
    side = 10.0
    low, high = np.array([-side, -side, 0.0]), np.array([side, side, 3.0])
    for k, X_WG in enumerate(_scatter(rng, n, low, high)):
        bodies.append(Body(WORLD, draw_primitive(rng, k % KINDS), X_WG))
    title = f"one moving robot (Panda) among {n} anchored shapes"
    return Scene("fixed world", title, bodies, X_WL, draw_points(rng, low, high), None,
                 frozenset(excluded))  # fmt: skip


OTHER_SCENES: dict[str, Callable[[int], Scene]] = {
    "hulls": hulls,
    "robots": robots,
    "pile": pile,
    "warehouse": warehouse,
    "fixed-world": fixed_world,
}
