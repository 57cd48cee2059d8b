"""Talos walks: from footsteps to its centre of mass, and to its legs.

    .venv/bin/python examples/walk.py --output walking.png

The zero-moment point rests under the foot that carries, and goes over to the other foot while both
do. `ZmpPlanner` finds the best motion of the centre of mass after it, as if the robot was a linear
inverted pendulum. Inverse kinematics then has the feet step and the whole robot's centre of mass,
by the masses in its URDF, follow the plan; what the zero-moment point of all its links is then, is
computed from their momentum, and is to stay under the feet.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
import sys
import time
from typing import Any

import numpy as np

from scene_graph_ros.planning import ZmpPlanner
from scene_graph_ros.planning.trajectories import PiecewisePolynomial
from scene_graph_ros.robots import KinematicTree, tree_inertias, TreeInertias
from scene_graph_ros.scene_files import load_urdf

ROBOT = "package://example-robot-data/robots/talos_data/robots/talos_full_v2.urdf"
LEGS = {
    side: (f"{side}_sole_link", [f"leg_{side}_{k}_joint" for k in range(1, 7)])
    for side in ("left", "right")
}
BENT = (0.0, 0.0, -0.45, 0.9, -0.45, 0.0)
"""Where a leg's joints start, rad: its knee is bent."""
FOOT = np.array([0.20, 0.12])
"""Length and width of a sole, m."""
BEND = 0.06
"""How much lower the centre of mass is than with straight legs, m."""
STEP, RISE = 0.22, 0.05
"""Length of a step, and how high a foot is lifted, m."""
CARRY, SHIFT, REST = 0.7, 0.25, 1.0
"""Seconds that one foot carries, that both do between, and before and after the walk."""
GRAVITY = 9.81
RATE = 50
"""Moments a second at which the robot is placed."""
MOST_ROUNDS, NEAR = 60, 1e-6
"""Of the inverse kinematics, and the error that ends it, m and rad."""


@dataclass(frozen=True)
class Walk:
    """When what happens: ``zmp`` and, of each foot, where it is."""

    zmp: PiecewisePolynomial
    feet: dict[str, PiecewisePolynomial]
    placed: list[np.ndarray]
    """Middles ``(2,)`` of all footprints."""


def walk_of(steps: int, left: np.ndarray, right: np.ndarray) -> Walk:
    """Return a straight walk from where the feet stand to where they stand beside each other."""
    places = {"left": left.copy(), "right": right.copy()}
    times, zmp = [0.0, REST], [0.5 * (left + right)] * 2
    events: dict[str, list[tuple[float, float, np.ndarray]]] = {"left": [], "right": []}
    placed = [left, right]
    for k in range(steps):
        moving, standing = ("left", "right") if k % 2 else ("right", "left")
        length = STEP * (0.5 if k in (0, steps - 1) else 1.0)
        times += [times[-1] + SHIFT, times[-1] + SHIFT + CARRY]
        zmp += [places[standing]] * 2
        target = places[moving] + np.array([length, 0.0])
        events[moving].append((times[-2], times[-1], target))
        places[moving] = target
        placed.append(target)
    end = 0.5 * (places["left"] + places["right"])
    zmp += [end, end]
    times += [times[-1] + SHIFT, times[-1] + SHIFT + REST]
    feet = {
        side: swings(start, events[side], times[-1])
        for side, start in (("left", left), ("right", right))
    }
    return Walk(PiecewisePolynomial.first_order_hold(times, zmp), feet, placed)


def swings(
    start: np.ndarray, events: Sequence[tuple[float, float, np.ndarray]], end: float
) -> PiecewisePolynomial:
    """Return where a foot is ``(3,)``: quintics from rest to rest, up to the middle and down."""
    knots, place = [(0.0, [*start, 0.0])], start
    for begin, done, target in events:
        knots += [
            (begin, [*place, 0.0]),
            (0.5 * (begin + done), [*(0.5 * (place + target)), RISE]),
            (done, [*target, 0.0]),
        ]
        place = target
    knots.append((end, [*place, 0.0]))
    times, points = (np.array([knot[i] for knot in knots]) for i in (0, 1))
    speeds = np.zeros_like(points)
    middles = np.flatnonzero(points[:, 2] > 0.0)
    for m in middles:  # The middle is passed, not rested at.
        speeds[m, :2] = 1.5 * (points[m + 1] - points[m - 1])[:2] / (times[m + 1] - times[m - 1])
    return PiecewisePolynomial.quintic_hermite(times, points, speeds, np.zeros_like(points))


class Body:
    """Talos with an upright trunk: its legs reach for given feet under a given centre of mass."""

    def __init__(self) -> None:
        model = load_urdf(ROBOT)
        self.tree: KinematicTree = model.kinematic_tree(floating_base="base")
        self.inertias: TreeInertias = tree_inertias(model, self.tree)
        self.rows = {side: self._rows(joints) for side, (_, joints) in LEGS.items()}
        self.base = [self.tree.position_index(f"base.{axis}") for axis in "xyz"]
        self.q = self.tree.zero_configuration()
        for k in self.rows.values():
            self.q[k] = BENT

    def _rows(self, joints: Sequence[str]) -> list[int]:
        return [self.tree.position_index(name) for name in joints]

    def stand(self) -> tuple[np.ndarray, np.ndarray, float]:
        """Return where both feet are, and how high the centre of mass is above the ground."""
        soles = self.tree.link_poses(self.q, [sole for sole, _ in LEGS.values()])
        self.q[self.base[2]] -= soles[0, 2, 3]
        height = float(self.inertias.centre_of_mass(self.q)[2]) - BEND
        return soles[0, :2, 3], soles[1, :2, 3], height

    def reach(self, com: np.ndarray, feet: dict[str, np.ndarray]) -> float:
        """Place the robot; return what error is left, m and rad."""
        worst = np.inf
        for _ in range(MOST_ROUNDS):
            off = com - self.inertias.centre_of_mass(self.q)
            self.q[self.base] += off
            errors = [self._step(side, place) for side, place in feet.items()]
            worst = max(float(abs(off).max()), *errors)
            if worst < NEAR:
                break
        return worst

    def _step(self, side: str, place: np.ndarray) -> float:
        """Take a Newton step of one leg towards a level sole; return the error before."""
        sole, rows = LEGS[side][0], self.rows[side]
        X = self.tree.link_poses(self.q, [sole])[0]
        # The rotation that is left, small: half the difference of R and its transpose.
        skew = 0.5 * (X[:3, :3].T - X[:3, :3])
        error = np.array([skew[2, 1], skew[0, 2], skew[1, 0], *(place - X[:3, 3])])
        columns = [k - 1 for k in rows]  # A quaternion has one number more than its velocity.
        J = self.tree.jacobians(self.q, sole)[:, columns]
        self.q[rows] += np.linalg.solve(J.T @ J + 1e-9 * np.eye(6), J.T @ error)
        return float(abs(error).max())


def walked(body: Body, planner: ZmpPlanner, walk: Walk, height: float) -> tuple[Any, Any, float]:
    """Return times, configurations, and the largest error of the inverse kinematics."""
    times = np.arange(0.0, walk.zmp.end_time, 1.0 / RATE)
    com = np.column_stack([planner.get_nominal_com().value(times), np.full(len(times), height)])
    configurations, worst = [], 0.0
    for k, t in enumerate(times):
        worst = max(
            worst, body.reach(com[k], {side: foot.value(t) for side, foot in walk.feet.items()})
        )
        configurations.append(body.q.copy())
    return times, np.array(configurations), worst


def zmp_of_all_links(body: Body, times: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Return where the ground pushes ``(m - 4, 2)``, by differences of all links' momentum.

    The angular momentum is that of point masses at the links' centres of mass.
    """
    inertias, h = body.inertias, times[1] - times[0]
    X = body.tree.link_poses(q)
    p = X[..., :3, 3] + np.einsum("nlij,lj->nli", X[..., :3, :3], inertias.p_LI)
    m = inertias.link_masses
    velocity = (p[2:] - p[:-2]) / (2.0 * h)
    linear = np.einsum("l,nli->ni", m, velocity)
    angular = np.einsum("l,nli->ni", m, np.cross(p[1:-1], velocity))
    force = (linear[2:] - linear[:-2]) / (2.0 * h)
    torque = (angular[2:] - angular[:-2]) / (2.0 * h)
    centre = np.einsum("l,nli->ni", m, p[2:-2])
    up = force[:, 2] + inertias.total_mass * GRAVITY
    # Torque about the origin: of the ground's push, and of the weight.
    x = (GRAVITY * centre[:, 0] - torque[:, 1]) / up
    y = (GRAVITY * centre[:, 1] + torque[:, 0]) / up
    return np.column_stack([x, y])


def main(arguments: Sequence[str] | None = None) -> int:
    """Plan, walk, tell and draw."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--steps", type=int, default=6, help="how many")
    parser.add_argument("--output", type=Path, default=Path("walking.png"), help="the picture")
    parser.add_argument("--no-picture", action="store_true", help="only tell")
    options = parser.parse_args(arguments)
    body = Body()
    left, right, height = body.stand()
    walk = walk_of(options.steps, left, right)
    planner = ZmpPlanner()
    start = np.concatenate([walk.zmp.value(0.0), np.zeros(2)])
    begin = time.perf_counter()
    planner.plan(walk.zmp, start, height, GRAVITY, np.eye(2), 1e-3 * np.eye(2))
    seconds = time.perf_counter() - begin
    print(
        f"{options.steps} steps in {walk.zmp.duration:.1f} s, planned in {1e3 * seconds:.1f} ms;"
        f" {body.inertias.total_mass:.1f} kg, centre of mass {height:.3f} m above the ground"
    )
    times, q, worst = walked(body, planner, walk, height)
    com = planner.get_nominal_com()
    pendulum = com.value(times) - height / GRAVITY * com.derivative(2).value(times)
    wanted = walk.zmp.value(times)
    whole = zmp_of_all_links(body, times, q)
    print(f"inverse kinematics: {len(times)} configurations, error at most {worst:.0e} m and rad")
    for name, found, meant in (
        ("the pendulum's", pendulum, wanted),
        ("all links'", whole, wanted[2:-2]),
    ):
        off = np.linalg.norm(found - meant, axis=1)
        print(f"{name} zero-moment point: {1e3 * off.max():.1f} mm from the desired at most")
    if not options.no_picture:
        from common.walk_picture import draw

        draw(options.output, body, walk, (times, q), (com.value(times), pendulum, whole))
        print(f"Picture: {options.output}")
    return 0 if worst < 10.0 * NEAR else 1


if __name__ == "__main__":
    sys.exit(main())
