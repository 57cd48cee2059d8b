"""Random robots among random shapes: what is certified is free, and both ways agree."""

import numpy as np
import pytest
from robot_scenes import diagram

from scene_graph_ros.planning import (
    BinarySearchOptions,
    CspaceFreePolytope,
    SceneGraphCollisionChecker,
)


def numbers(values):
    """Return numbers with spaces between them."""
    return " ".join(f"{v:g}" for v in values)


def shape(generator):
    """Return a box, ball, cylinder or capsule of some size, as URDF has it."""
    kind = generator.integers(4)
    if kind == 0:
        return f'<box size="{numbers(generator.uniform(0.05, 0.3, 3))}"/>'
    radius, length = generator.uniform(0.05, 0.2, 2)
    size = f'radius="{radius:g}"' + (f' length="{length:g}"' if kind > 1 else "")
    return f"<{('sphere', 'cylinder', 'capsule')[kind - 1]} {size}/>"


def robot(generator, joints):
    """Return a chain whose joints turn about, or slide along, axes in any direction."""
    text = '<robot name="robot"><link name="l0"/>'
    for k in range(1, joints + 1):
        kind = "prismatic" if generator.uniform() < 0.25 else "revolute"
        axis = generator.normal(size=3)
        places = [numbers(generator.uniform(-r, r, 3)) for r in (0.2, 1.0, 0.5, 1.0)]
        text += (
            f'<link name="l{k}"><collision><origin xyz="{places[0]}" rpy="{places[1]}"/>'
            f"<geometry>{shape(generator)}</geometry></collision></link>"
            f'<joint name="j{k}" type="{kind}"><parent link="l{k - 1}"/><child link="l{k}"/>'
            f'<origin xyz="{places[2]}" rpy="{places[3]}"/>'
            f'<axis xyz="{numbers(axis / np.linalg.norm(axis))}"/>'
            '<limit lower="-2" upper="2" effort="1" velocity="1"/></joint>'
        )
    return text + "</robot>"


def surroundings(generator):
    """Return a box, a ball and a tilted floor."""
    x, y, size = generator.uniform(-1, 1, 3), generator.uniform(-1, 1, 3), 0.3
    return f"""
geometries:
  - {{name: box, source: around, pose: {{xyz: {x.tolist()}, rpy: {y.tolist()}}},
     shape: {{type: box, size: [{size}, 0.2, 0.4]}}}}
  - {{name: ball, source: around, pose: {{xyz: {(-x).tolist()}}},
     shape: {{type: sphere, radius: 0.2}}}}
  - {{name: floor, source: around, pose: {{xyz: [0, 0, -0.8], rpy: [0.1, 0.2, 0]}},
     shape: {{type: half_space}}}}
"""


@pytest.mark.parametrize("seed", range(5))
def test_what_is_certified_is_free(tmp_path, seed):
    """A sampler finds no collision, no pair is nearer than is claimed, distances agree."""
    generator = np.random.default_rng(seed)
    joints = 2 + seed % 2
    checker = SceneGraphCollisionChecker(
        diagram(tmp_path, robot(generator, joints), surroundings(generator))
    )
    tries = generator.uniform(-1.0, 1.0, (100, joints))
    q = tries[np.argmax(checker.check_configs_collision_free(tries))]
    search = CspaceFreePolytope(checker, 0.7 * q)
    s = search.rational_forward_kinematics.compute_s_value(q)
    C = np.vstack([np.eye(joints), -np.eye(joints), generator.normal(size=(1, joints))])
    d = C @ s + np.append(np.ones(2 * joints), 0.7)
    options = BinarySearchOptions(scale_min=1e-3, max_iter=5)
    found = search.binary_search(C, d, s, options=options)
    assert found.verify()
    region = found.region
    points = generator.uniform(region.lower, region.upper, (20_000, joints))
    inside = search.rational_forward_kinematics.compute_q_value(points[region.contains(points)])
    assert len(inside) > 100
    assert checker.check_configs_collision_free(inside).all()
    for each in inside[:100]:
        assert checker.calc_robot_clearance(each, found.distance).size == 0
    polytope = found.certified_polytope
    boxes = search.certify_by_distances(polytope.A, polytope.b, max_boxes=100_000)
    assert boxes.status != "collision"
    assert not boxes.is_success or boxes.verify()
