"""No proven edge of a body that floats, or slides and turns on a plane, collides on its way.

Where they are in between is said by SciPy's interpolation of rotations, not by the tree's.
"""

import math

import numpy as np
import pytest
from robot_scenes import diagram, DRONE
from scipy.spatial.transform import Rotation, Slerp

from scene_graph_ros.planning import EdgeStatus, SceneGraphCollisionChecker

PUCK = """<robot name="puck"><link name="world"/><link name="body">
  <collision><geometry><box size="0.6 0.02 0.05"/></geometry></collision></link>
  <joint name="floor" type="planar"><parent link="world"/><child link="body"/>
  <axis xyz="0 0 1"/></joint></robot>"""
SAMPLES = 400


def thin_things(rng):
    """Return poles of 2 mm and plates of 0.2 mm about the origin."""
    text = "geometries:\n"
    for k in range(10):
        xyz = ", ".join(f"{each:.4f}" for each in rng.uniform(-0.6, 0.6, 3) * (1.0, 1.0, 0.3))
        rpy = ", ".join(f"{each:.4f}" for each in rng.uniform(-math.pi, math.pi, 3))
        shape = (
            "{type: cylinder, radius: 0.001, length: 0.6}",
            "{type: box, size: [0.2, 0.1, 0.0002]}",
        )[k % 2]
        pose = f"{{xyz: [{xyz}], rpy: [{rpy}]}}"
        text += f"  - {{name: thin_{k}, source: around, pose: {pose}, shape: {shape}}}\n"
    return text


def floating(rng, count):
    """Return quaternions of any length, and places."""
    return np.hstack([3.0 * rng.normal(size=(count, 4)), rng.uniform(-0.7, 0.7, (count, 3))])


def planar(rng, count):
    """Return places, and turns of up to two."""
    return np.hstack([rng.uniform(-0.7, 0.7, (count, 2)), rng.uniform(-12.0, 12.0, (count, 1))])


def turned(q1, q2, t):
    """Return configurations of a floating body at shares t of its way."""
    both = Rotation.from_quat([q1[:4], q2[:4]], scalar_first=True)
    turns = Slerp([0.0, 1.0], both)(t).as_quat(scalar_first=True)
    return np.hstack([turns, q1[4:] + t[:, np.newaxis] * (q2 - q1)[4:]])


def straight(q1, q2, t):
    """Return configurations at shares t of a straight way."""
    return q1 + t[:, np.newaxis] * (q2 - q1)


@pytest.mark.parametrize(
    ("urdf", "configurations", "between"),
    [(DRONE, floating, turned), (PUCK, planar, straight)],
    ids=["floating", "planar"],
)
def test_no_proven_edge_collides(tmp_path, urdf, configurations, between):
    """Neither one that is free, nor up to where one is that is not; and what collides is shown."""
    rng = np.random.default_rng(6)
    checker = SceneGraphCollisionChecker(diagram(tmp_path, urdf, thin_things(rng)))
    q = configurations(rng, 600)
    q = q[checker.check_configs_collision_free(q)]
    edges = np.stack([q[:-1], q[1:]], axis=1)[:120]
    # Every other one is short.
    edges[::2, 1] = [between(q1, q2, np.array([0.1]))[0] for q1, q2 in edges[::2]]
    counts = dict.fromkeys(EdgeStatus, 0)
    for (q1, q2), measure in zip(edges, checker.measure_edges(edges), strict=True):
        counts[measure.status] += 1
        if measure.status is EdgeStatus.COLLIDES:
            assert not checker.check_config_collision_free(measure.configuration)
        if measure.alpha <= 0.0:
            continue
        t = np.linspace(0.0, measure.alpha, SAMPLES)
        # At its end an edge that is not free is nearer than the tolerance, or than rounding.
        t = t if measure.completely_free else t[:-1]
        assert checker.check_configs_collision_free(between(q1, q2, t)).all()
    assert counts[EdgeStatus.FREE] >= 20 and counts[EdgeStatus.COLLIDES] >= 20
    assert counts[EdgeStatus.UNDECIDED] <= 2
    print(counts)
