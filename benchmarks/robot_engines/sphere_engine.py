"""Sphere models: spheres that cover the links in place of these, as fast planners have them.

VAMP (Thomason, Kingston and Kavraki, 2024) and cuRobo (Sundaralingam et al., 2023) check robots
that are made of spheres. They are built for one robot, or for a GPU; this is the same idea with
our lanes, on one thread: eight configurations in step, a ball around each link before its spheres.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from benchmarks.robot_engines.robot_world import RobotWorld
from benchmarks.robot_engines.sphere_covers import covers_of
from scene_graph_ros.geometry import Box, Capsule, Cylinder, HalfSpace, Sphere
from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, kernel
from scene_graph_ros.geometry.compiled.lanes import (
    all_of,
    any_of,
    every,
    LANES,
    larger,
    load_lanes,
    magnitude,
    root,
    select,
    smaller,
    store_lanes,
)
from scene_graph_ros.robots.kinematic_tree import KinematicTree

__all__ = ["SphereEngine"]

_BOX, _CYLINDER, _CAPSULE, _HALF_SPACE, _SPHERES = range(5)
_OF_OBSTACLES = 32
"""Spheres around each thing that does not move and has no closed form."""


class _Tables(NamedTuple):
    """What the kernel reads."""

    centers: np.ndarray
    """``(s, 3)``: of all spheres, in a frame of a link that their joint moves, or the world."""
    radii: np.ndarray
    starts: np.ndarray
    """``(t + 1,)``: where the spheres of each thing begin; the first is around all others."""
    joints: np.ndarray
    """``(t,)``: of each thing, from 1 on; 0 where none moves it."""
    kinds: np.ndarray
    measures: np.ndarray
    """``(t, 3)``."""
    X: np.ndarray
    """``(t, 12)``: of primitives, their pose in the world, row by row."""
    pairs: np.ndarray


class SphereEngine:
    """About ``count`` spheres in all around what moves; what does not is as it is.

    Around what has no closed form, such as meshes, 32 spheres each.
    """

    def __init__(self, world: RobotWorld, count: int) -> None:
        self.name = f"{count} spheres"
        self._world = world
        moving = [k for k, thing in enumerate(world.things) if thing.joint]
        odd = [
            k
            for k, thing in enumerate(world.things)
            if not thing.joint
            and not isinstance(thing.shape, (Box, Capsule, Cylinder, HalfSpace, Sphere))
        ]
        shapes = [world.things[k].shape for k in moving]
        covers = dict(zip(moving, covers_of(shapes, count), strict=True))
        for k in odd:
            covers[k] = covers_of([world.things[k].shape], _OF_OBSTACLES)[0]
        # Kinematics tell where links are: spheres are in the frame of one that their joint moves.
        tree = world.tree
        links = _links_of_joints(tree)
        self._links = [tree.link_names[link] for link in links]
        to_link = [np.eye(4), *(np.linalg.inv(tree.X_JL[link]) for link in links)]
        centers: list[np.ndarray] = []
        radii: list[float] = []
        starts, kinds, measures = [0], [], []
        for k, thing in enumerate(world.things):
            kind, numbers = _primitive(thing.shape)
            if isinstance(thing.shape, Sphere):
                covers[k] = np.zeros((1, 3)), np.array([thing.shape.radius])
            if k in covers:
                kind, numbers = _SPHERES, (0.0, 0.0, 0.0)
                points, own = covers[k]
                X = to_link[thing.joint] @ thing.X
                points = points @ X[:3, :3].T + X[:3, 3]
                middle = 0.5 * ((points - own[:, None]).min(0) + (points + own[:, None]).max(0))
                around = (np.linalg.norm(points - middle, axis=1) + own).max()
                centers += [middle, *points]
                radii += [around, *own]
            starts.append(len(radii))
            kinds.append(kind)
            measures.append(numbers)
        self.count = sum(len(covers[k][1]) for k in moving)
        self._tables = _Tables(
            np.array(centers),
            np.array(radii),
            np.array(starts),
            np.array([thing.joint for thing in world.things]),
            np.array(kinds),
            np.array(measures),
            np.array([thing.X[:3].reshape(12) for thing in world.things]),
            self._sorted_pairs(),
        )

    def _sorted_pairs(self) -> np.ndarray:
        """Return pairs with what moves first."""
        things = self._world.things
        return np.array(
            [(a, b) if things[a].joint else (b, a) for a, b in self._world.pairs.tolist()]
        )

    def collide(self, q: np.ndarray) -> np.ndarray:
        """See RobotEngine."""
        count = len(q)
        blocks = -(-count // LANES)
        rows = np.minimum(np.arange(blocks * LANES), count - 1)
        X_WL = self._world.tree.link_poses(q[rows], self._links)
        poses = X_WL[:, :, :3].reshape(blocks, LANES, len(self._links), 12).transpose(0, 2, 3, 1)
        least = np.empty(blocks * LANES)
        _check(self._tables, np.ascontiguousarray(poses), least)
        result: np.ndarray = least[:count] < 0.0
        return result

    def edges_collide(self, edges: np.ndarray, step: float) -> np.ndarray:
        """See RobotEngine; all samples of all edges at once: nothing is called for each."""
        ways = edges[:, 1] - edges[:, 0]
        steps = np.maximum(np.ceil(np.linalg.norm(ways, axis=1) / step), 1.0).astype(int)
        ends = np.cumsum(steps + 1)
        starts = ends - steps - 1
        row = np.repeat(np.arange(len(edges)), steps + 1)
        t = (np.arange(ends[-1]) - starts[row]) / steps[row]
        hits = self.collide(edges[row, 0] + t[:, np.newaxis] * ways[row])
        result: np.ndarray = np.logical_or.reduceat(hits, starts)
        return result


def _links_of_joints(tree: KinematicTree) -> list[int]:
    """Return a link that each joint moves, by the joints' order."""
    found: dict[int, int] = {}
    for link, joint in enumerate(tree.joint_of_link):
        found.setdefault(int(joint), link)
    return [found[joint] for joint in range(1, len(tree.joints) + 1)]


def _primitive(shape: object) -> tuple[int, tuple[float, float, float]]:
    match shape:
        case Box():
            return _BOX, (0.5 * shape.width, 0.5 * shape.depth, 0.5 * shape.height)
        case Cylinder():
            return _CYLINDER, (shape.radius, 0.5 * shape.length, 0.0)
        case Capsule():
            return _CAPSULE, (shape.radius, 0.5 * shape.length, 0.0)
        case HalfSpace():
            return _HALF_SPACE, (0.0, 0.0, 0.0)
    return _SPHERES, (0.0, 0.0, 0.0)


@inlined_kernel
def _between(x, y, z, r, kind, size, X):
    """Return what is negative where a ball of radius r at ``(x, y, z)`` meets a primitive."""
    dx, dy, dz = x - X[3], y - X[7], z - X[11]
    u = X[0] * dx + X[4] * dy + X[8] * dz
    v = X[1] * dx + X[5] * dy + X[9] * dz
    w = X[2] * dx + X[6] * dy + X[10] * dz
    zero = every(0.0)
    if kind == _BOX:
        u = larger(magnitude(u) - size[0], zero)
        v = larger(magnitude(v) - size[1], zero)
        w = larger(magnitude(w) - size[2], zero)
        return u * u + v * v + w * w - r * r
    if kind == _CYLINDER:
        around = larger(root(u * u + v * v) - size[0], zero)
        w = larger(magnitude(w) - size[1], zero)
        return around * around + w * w - r * r
    if kind == _CAPSULE:
        w = larger(magnitude(w) - size[1], zero)
        return u * u + v * v + w * w - (r + size[0]) * (r + size[0])
    return w - r


@inlined_kernel
def _place(tables, poses, block, at):
    """Write where the spheres are at eight poses, of ``(b, j, 12, 8)``: x, y and z of each."""
    flat = poses.reshape(-1)
    for thing in range(len(tables.joints)):
        joint = tables.joints[thing]
        for s in range(tables.starts[thing], tables.starts[thing + 1]):
            cx, cy, cz = tables.centers[s, 0], tables.centers[s, 1], tables.centers[s, 2]
            for row in range(3):
                place = (3 * s + row) * LANES
                if joint == 0:
                    store_lanes(at, place, every(tables.centers[s, row]))
                    continue
                X = ((block * poses.shape[1] + joint - 1) * 12 + 4 * row) * LANES
                store_lanes(
                    at,
                    place,
                    load_lanes(flat, X) * cx
                    + load_lanes(flat, X + LANES) * cy
                    + load_lanes(flat, X + 2 * LANES) * cz
                    + load_lanes(flat, X + 3 * LANES),
                )


@inlined_kernel
def _from_thing(tables, at, s, thing):
    """Return what is negative where sphere s meets a thing, or the ball around its spheres."""
    p = 3 * s * LANES
    x, y, z = load_lanes(at, p), load_lanes(at, p + LANES), load_lanes(at, p + 2 * LANES)
    kind = tables.kinds[thing]
    if kind < _SPHERES:
        return _between(x, y, z, tables.radii[s], kind, tables.measures[thing], tables.X[thing])
    return _from_sphere(tables, at, s, tables.starts[thing])


@inlined_kernel
def _from_sphere(tables, at, s, t):
    """Return what is negative where spheres s and t meet."""
    p, o = 3 * s * LANES, 3 * t * LANES
    dx = load_lanes(at, p) - load_lanes(at, o)
    dy = load_lanes(at, p + LANES) - load_lanes(at, o + LANES)
    dz = load_lanes(at, p + 2 * LANES) - load_lanes(at, o + 2 * LANES)
    both = tables.radii[s] + tables.radii[t]
    return dx * dx + dy * dy + dz * dz - both * both


@inlined_kernel
def _with_pair(tables, at, a, b, worst):
    """Return the least of ``worst`` and of what spheres of thing a say of thing b."""
    starts = tables.starts
    for s in range(starts[a], starts[a + 1]):
        gap = _from_thing(tables, at, s, b)
        is_open = any_of(select(worst >= 0.0, gap, every(1.0)) < 0.0)
        if s == starts[a]:
            # The ball around all: where it is clear of a thing, all in it are.
            if not is_open:
                return worst
        elif is_open and tables.kinds[b] < _SPHERES:
            worst = smaller(worst, gap)
        elif is_open:
            for t in range(starts[b] + 1, starts[b + 1]):
                worst = smaller(worst, _from_sphere(tables, at, s, t))
    return worst


@kernel
def _check(tables, poses, least):
    """Write what is negative where any pair meets, of each of the poses ``(b, j, 12, 8)``."""
    at = np.empty(len(tables.radii) * 3 * LANES)
    for block in range(len(poses)):
        _place(tables, poses, block, at)
        worst = every(1.0)
        for pair in range(len(tables.pairs)):
            worst = _with_pair(tables, at, tables.pairs[pair, 0], tables.pairs[pair, 1], worst)
            if all_of(worst < 0.0):
                break
        store_lanes(least, block * LANES, worst)
