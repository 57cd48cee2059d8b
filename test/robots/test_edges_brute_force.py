"""No edge that is proven free collides: thousands of configurations on each, in a hard scene.

A small share here; `make search` tries many times more edges.
"""

import math

import numpy as np
import pytest
from robot_scenes import diagram
from searching import times

from scene_graph_ros.planning import EdgeStatus, SceneGraphCollisionChecker

# A rod of 1 m and 1 mm, on a hinge that turns without an end, on a rail.
ROD = """<robot name="rod"><link name="base"/><link name="cart"/><link name="rod">
  <collision><origin xyz="0.5 0 0"/><geometry><box size="1 0.001 0.001"/></geometry></collision>
  </link><joint name="rail" type="prismatic"><parent link="base"/><child link="cart"/>
  <axis xyz="1 0 0"/><limit lower="-0.6" upper="0.6"/></joint>
  <joint name="hinge" type="continuous"><parent link="cart"/><child link="rod"/>
  <axis xyz="0 0 1"/></joint></robot>"""


def geometry(name, xyz, shape):
    """Return a line of a scene file."""
    place = ", ".join(f"{each:.6f}" for each in xyz)
    pose = f"{{xyz: [{place}]}}"
    return f"  - {{name: {name}, source: around, pose: {pose}, shape: {shape}}}\n"


def rod(folder):
    """A rod among posts, each a millimetre thick."""
    rng, text = np.random.default_rng(1), "geometries:\n"
    for k in range(8):
        angle, far = rng.uniform(-math.pi, math.pi), rng.uniform(0.4, 1.4)
        place = (far * math.cos(angle), far * math.sin(angle), 0.0)
        text += geometry(f"post_{k}", place, "{type: cylinder, radius: 0.0005, length: 0.2}")
    return SceneGraphCollisionChecker(diagram(folder, ROD, text))


def edges_of(checker, count, rng):
    """Return edges of random lengths, every tenth of none, that begin where nothing collides.

    Joints without limits turn by up to four pi.
    """
    tree = checker.plan.tree
    lower, upper = np.maximum(tree.lower, -2.0 * math.pi), np.minimum(tree.upper, 2.0 * math.pi)
    middle, half = 0.5 * (lower + upper), 0.5 * (upper - lower)
    found = np.empty((0, tree.num_positions))
    for _ in range(20):
        q = middle + half * rng.uniform(-1.0, 1.0, (4 * count, tree.num_positions))
        found = np.concatenate([found, q[checker.check_configs_collision_free(q)]])
        if len(found) >= count:
            break
    starts = found[:count]
    assert len(starts) == count
    ways = half * rng.uniform(-1.0, 1.0, starts.shape)
    ways *= 10.0 ** rng.uniform(-3.0, 0.0, count)[:, np.newaxis]
    ways[::10] = 0.0
    return np.stack([starts, starts + ways], axis=1)


@pytest.mark.search
def test_no_proven_edge_collides_anywhere(tmp_path):
    """Neither one that is free, nor up to where one is that is not; and what collides is shown."""
    checker, rng = rod(tmp_path), np.random.default_rng(5)
    samples = 500 if times(1) == 1 else 10_000
    counts = dict.fromkeys(EdgeStatus, 0)
    for _ in range(times(1)):
        edges = edges_of(checker, 60, rng)
        for edge, measure in zip(edges, checker.measure_edges(edges), strict=True):
            counts[measure.status] += 1
            if measure.status is EdgeStatus.COLLIDES:
                assert not checker.check_config_collision_free(measure.configuration)
            if measure.alpha <= 0.0:
                continue
            t = np.linspace(0.0, measure.alpha, samples)[:, np.newaxis]
            t = t if measure.completely_free else t[:-1]
            along = (1.0 - t) * edge[0] + t * edge[1]
            free = checker.check_configs_collision_free(along)
            assert free.all(), (edge.tolist(), float(t[np.argmin(free), 0]))
    print({status.name: count for status, count in counts.items()}, samples)
    assert counts[EdgeStatus.FREE] > 0 and counts[EdgeStatus.COLLIDES] > 0
    # What is neither is nearer to a collision than a micrometre.
    assert counts[EdgeStatus.UNDECIDED] <= 0.03 * sum(counts.values())
