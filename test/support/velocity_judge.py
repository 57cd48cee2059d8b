"""Judges motions of robots by ordinary queries of their scene, apart from any filter."""

from __future__ import annotations

import numpy as np
from robot_scenes import move

__all__ = ["Judge", "braking_positions", "step_positions"]

REACH = 0.06
"""Metres: pairs that are farther apart are not looked at."""


class Judge:
    """Distances of all pairs with a link in them that joints move; obstacles may be moved, too."""

    def __init__(self, model, moving="around"):
        """Take a RobotDiagram; what is on frames of the source ``moving`` may move."""
        self.model, inspector = model, model.context.snapshot.inspector
        names = list(model.frames)
        one, other = model.tree.sample(np.random.default_rng(0), 2)
        poses = (model.tree.link_poses(q, names) for q in (one, other))
        moved = np.abs(np.subtract(*poses)).max(axis=(1, 2)) > 0.0
        self.links = {
            int(each)
            for name, is_moved in zip(names, moved, strict=True)
            for each in inspector.get_geometries(model.frames[name])
            if is_moved
        }
        sources = {inspector.get_name(each): each for each in inspector.get_all_source_ids()}
        self.around = sources.get(moving)

    def set_obstacles(self, X_WFs):
        """Put the obstacles' frames, in the order of their ids, at poses ``(f, 4, 4)``."""
        self.model.context.set_frame_poses(self.around, X_WFs)

    def distances(self, q):
        """Return the distance (m) of each near pair of ids' values with a moved link, at q."""
        table = move(self.model, q).compute_signed_distance_pairwise_closest_points(REACH)
        rows = zip(table.id_A.tolist(), table.id_B.tolist(), table.distance.tolist(), strict=True)
        return {(A, B): d for A, B, d in rows if A in self.links or B in self.links}

    def losses(self, before, q, keep):
        """Return by how much pairs are nearer than ``keep`` and than ``before``, at q."""
        return {
            pair: min(keep, before.get(pair, np.inf)) - distance
            for pair, distance in self.distances(q).items()
            if distance < min(keep, before.get(pair, np.inf))
        }


def step_positions(q, present, velocity, dt, samples):
    """Return positions during a step, ``(2 samples, nq)``, both at once and evenly."""
    t = (dt * np.arange(1, samples + 1) / samples)[:, np.newaxis]
    at_once = q + t * velocity
    evenly = q + t * present + t * t / (2.0 * dt) * (velocity - present)
    return np.stack([at_once, evenly], axis=1).reshape(-1, len(q))


def braking_positions(q, velocity, brake_time, samples):
    """Return times (s) and positions ``(samples, nq)`` of a robot that brakes evenly from q."""
    t = brake_time * np.arange(1, samples + 1) / samples
    ways = t - t * t / (2.0 * brake_time)
    return t, q + ways[:, np.newaxis] * velocity
