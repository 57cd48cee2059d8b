"""Overlapping pairs of cores, and their depth along any direction by plain numpy."""

from convex_bodies import plain_core, pose, support
import numpy as np
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

from scene_graph_ros.geometry.narrowphase.convex_distance import new_workspace
from scene_graph_ros.geometry.narrowphase.lifted_contact import lifted_contact
from scene_graph_ros.geometry.narrowphase.mechanism import Mechanism
from scene_graph_ros.geometry.narrowphase.pair import Pair
from scene_graph_ros.geometry.tables.shape_table import build_shape_table

__all__ = ["DIRECTIONS", "OverlappingPair", "is_found", "overlapping"]


def is_found(decided_by):
    """Tell whether ``lifted_contact`` found and proved a contact."""
    return decided_by not in (Mechanism.OPEN, Mechanism.SEPARATED)


class OverlappingPair:
    """Two cores at a pose, and how deep they are along any direction, by plain numpy."""

    def __init__(self, shape_A, shape_B, X_AB):
        self.shapes, self.X_AB = (shape_A, shape_B), X_AB
        table = build_shape_table(list(self.shapes), [False, False])
        self.cores = plain_core(table, 0), plain_core(table, 1)
        self.hulls = table.hulls.blocks
        self.R = tuple(float(x) for x in X_AB[:3, :3].ravel())
        self.p = tuple(float(x) for x in X_AB[:3, 3])
        self.pair = Pair(*self.cores, self.R, self.p, self.hulls)
        self.work = new_workspace()

    def depth(self, n):
        """Return how far the cores are from being apart along unit vectors n (..., 3)."""
        n = np.asarray(n)
        radius = sum(core[2] for core in self.cores)
        outer = support(self.shapes[0], -n) + support(self.shapes[1], n @ self.X_AB[:3, :3])
        return outer + n @ self.X_AB[:3, 3] - radius

    def least_depth(self):
        """Return the least depth of many directions and of what is around the best."""
        n = np.vstack([DIRECTIONS, np.eye(3), -np.eye(3)])
        depth = self.depth(n)
        best = depth.min()
        for k in np.argsort(depth)[:5]:
            found = minimize(
                lambda x: self.depth(x / np.linalg.norm(x)),
                n[k],
                method="Nelder-Mead",
                options={"xatol": 1e-9, "fatol": 1e-12},
            )
            best = min(best, found.fun)
        return best

    def lift(self):
        """Return what ``lifted_contact`` does."""
        return lifted_contact(self.pair, np.inf, self.work)


def _directions(count):
    n = np.random.default_rng(1).normal(size=(count, 3))
    return n / np.linalg.norm(n, axis=1)[:, None]


DIRECTIONS = _directions(4000)


def overlapping(shape_A, shape_B, seed):
    """Return a pair whose centres are some centimetres apart, less if the cores are apart then."""
    rng = np.random.default_rng(seed)
    X_AB = pose(Rotation.random(random_state=rng), rng.uniform(-0.08, 0.08, 3))
    pair = OverlappingPair(shape_A, shape_B, X_AB)
    while pair.depth(DIRECTIONS).min() < 0.01:
        X_AB[:3, 3] *= 0.5
        pair = OverlappingPair(shape_A, shape_B, X_AB)
    return pair
