"""Judges motions of robots by ordinary queries of their scene, apart from any filter."""

from __future__ import annotations

import numpy as np
from robot_scenes import move

__all__ = ["Judge", "braking_positions", "step_positions"]

REACH = 0.06
"""Metres: pairs that are farther apart are not looked at."""


class Judge:
    """Distances of all pairs with a robot in them, in a scene whose obstacles may be moved."""

    def __init__(self, model, moving="around"):
        """Take a RobotDiagram; what is on frames of the source ``moving`` may move."""
        self.model, inspector = model, model.context.snapshot.inspector
        self.robot = {
            int(each)
            for frame in model.frames.values()
            for each in inspector.get_geometries(frame)
        }
        sources = {inspector.get_name(each): each for each in inspector.get_all_source_ids()}
        self.around = sources.get(moving)

    def set_obstacles(self, X_WFs):
        """Put the obstacles' frames, in the order of their ids, at poses ``(f, 4, 4)``."""
        self.model.context.set_frame_poses(self.around, X_WFs)

    def distances(self, q):
        """Return the distance (m) of each near pair of ids' values with a robot in it, at q."""
        table = move(self.model, q).compute_signed_distance_pairwise_closest_points(REACH)
        return {
            (int(row.id_A), int(row.id_B)): row.distance
            for row in table
            if int(row.id_A) in self.robot or int(row.id_B) in self.robot
        }

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
