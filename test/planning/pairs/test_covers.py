"""Balls and boxes around bodies, by which most pairs are decided, have all of the body inside."""

from fractions import Fraction

import numpy as np
import pytest
from robot_scenes import diagram, SLIDE
from robots import ROBOTS, URDF_ONLY

from scene_graph_ros.geometry import Box, Capsule, Cylinder, Ellipsoid, HalfSpace, Sphere
from scene_graph_ros.planning import (
    load_robot_diagram,
    RobotDiagramBuilder,
    SceneGraphCollisionChecker,
)

ALL_KINDS = """
geometries:
  - {name: half_space, source: around, pose: {xyz: [0, 0, -5]}, shape: {type: half_space}}
  - {name: sphere, source: around, pose: {xyz: [1, 0, 0]}, shape: {type: sphere, radius: 0.2}}
  - {name: box, source: around, pose: {xyz: [2, 0, 0]}, shape: {type: box, size: [0.3, 1, 2]}}
  - {name: cylinder, source: around, pose: {xyz: [3, 0, 0]},
     shape: {type: cylinder, radius: 0.3, length: 0.7}}
  - {name: capsule, source: around, pose: {xyz: [4, 0, 0]},
     shape: {type: capsule, radius: 0.3, length: 0.7}}
  - {name: ellipsoid, source: around, pose: {xyz: [5, 0, 0]},
     shape: {type: ellipsoid, semi_axes: [0.1, 0.5, 0.3]}}
"""


def extremes(shape, hull, ways):
    """Return the points of a shape that are farthest along ways ``(n, 3)``, in its frame."""
    if hull is not None:
        return hull.vertices
    ups = np.where(ways[:, 2:] < 0.0, -0.5, 0.5) * [0.0, 0.0, 1.0]
    if isinstance(shape, Sphere):
        return shape.radius * ways
    if isinstance(shape, Box):
        return 0.5 * np.sign(ways) * shape.size
    if isinstance(shape, Capsule):
        return shape.radius * ways + shape.length * ups
    if isinstance(shape, Ellipsoid):
        axes = np.array([shape.a, shape.b, shape.c])
        return axes**2 * ways / np.linalg.norm(axes * ways, axis=1)[:, np.newaxis]
    assert isinstance(shape, Cylinder)
    flat = ways * [1.0, 1.0, 0.0]
    rim = shape.radius * flat / np.linalg.norm(flat, axis=1)[:, np.newaxis]
    return rim + shape.length * ups


def supports(points, is_hull, ways):
    """Return how far a shape reaches along ways ``(n, 3)``, given what ``extremes`` returns."""
    return (ways @ points.T).max(axis=1) if is_hull else (ways * points).sum(axis=1)


@pytest.mark.parametrize("of_panda", [True, False], ids=["panda", "all kinds"])
def test_covers_contain_their_bodies(tmp_path, of_panda):
    """To rounding; and are not larger than by what a box or its ball has to be.

    Of two convex bodies one contains the other where it reaches farther in all directions: so it
    does with what is taken to be inside. That is as large as it may be where 2006 directions tell.
    """
    robots = (
        load_robot_diagram("config/scenes/panda_cell.yaml")
        if of_panda
        else diagram(tmp_path, SLIDE, ALL_KINDS)
    )
    plan = SceneGraphCollisionChecker(robots).plan
    inspector, bodies = robots.context.inspector(), plan.bodies
    ways = np.random.default_rng(3).normal(size=(2000, 3))
    ways = np.vstack([ways, np.eye(3) + 1e-12, -np.eye(3) - 1e-12])
    ways /= np.linalg.norm(ways, axis=1)[:, np.newaxis]
    kinds = set()
    for b, geometry in enumerate(plan.geometry_ids):
        shape = inspector.get_shape(geometry)
        kinds.add(type(shape))
        if isinstance(shape, HalfSpace):
            assert bodies.radii[b] == np.inf and bodies.upper[b, 2] == 0.0
            assert (bodies.inner[b, [0, 4]] == -np.inf).all()
            continue
        hull = inspector.get_convex_hull(geometry)
        points = extremes(shape, hull, ways)
        lower, upper, ball = bodies.lower[b], bodies.upper[b], bodies.centers[b]
        rounding = 1e-15 * np.abs(points).max()
        assert (points >= lower - rounding).all() and (points <= upper + rounding).all()
        far = np.linalg.norm(points - ball, axis=1)
        assert (far <= bodies.radii[b] + rounding).all()
        np.testing.assert_allclose(points.min(axis=0), lower, atol=0.02)
        np.testing.assert_allclose(points.max(axis=0), upper, atol=0.02)
        assert bodies.radii[b] <= 1.001 * far.max()
        beyond = supports(points, hull is not None, ways) - ways @ ball
        radius, half, rest = bodies.inner[b, 0], bodies.inner[b, 1:4], bodies.inner[b, 4]
        assert (beyond >= radius - rounding).all()
        assert (beyond >= np.abs(ways) @ half + rest - rounding).all()
        if not plan.held.table.exact[bodies.rows[b]]:
            assert radius >= 0.7 * beyond.min() > 0.0
    assert len(kinds) >= (5 if of_panda else 6)


@pytest.mark.parametrize("name", ["panda", "ur5", "baxter", "talos"])
def test_vertices_of_links_are_in_their_covers_exactly(name):
    """In rational arithmetic, without a tolerance: a convex hull is where its vertices are."""
    urdf = f"package://example-robot-data/robots/{(URDF_ONLY | ROBOTS)[name][0]}"
    builder = RobotDiagramBuilder()
    builder.add_robot(name, urdf)
    robots = builder.build()
    plan, inspector = SceneGraphCollisionChecker(robots).plan, robots.context.inspector()
    bodies, count = plan.bodies, 0
    for b, geometry in enumerate(plan.geometry_ids):
        hull = inspector.get_convex_hull(geometry)
        if hull is None:
            continue
        lower, upper = bodies.lower[b], bodies.upper[b]
        assert (hull.vertices >= lower).all() and (hull.vertices <= upper).all()
        center = [Fraction(x) for x in bodies.centers[b].tolist()]
        square = Fraction(float(bodies.radii[b])) ** 2
        for vertex in hull.vertices.tolist():
            away = (Fraction(x) - c for x, c in zip(vertex, center, strict=True))
            assert sum(x * x for x in away) <= square
            count += 1
    assert count > 200
