"""No edge that is proven free collides: thousands of configurations on each, in hard scenes.

A small share here; `make search` tries many times more edges, and EFFORT=500 a hundred thousand,
with 10 000 configurations on each.
"""

import math

from edge_scenes import EDGE_SCENES
import numpy as np
import pytest
from searching import times

from scene_graph_ros.planning import EdgeStatus

COUNTS = {"rod": 60, "blades": 60, "chain": 4, "panda": 58, "baxter": 16, "talos": 2}
"""Edges of each scene, of 200 in all."""

_BATCH = 100


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
@pytest.mark.parametrize("scene", COUNTS)
def test_no_proven_edge_collides_anywhere(tmp_path, scene):
    """Neither one that is free, nor up to where one is that is not; and what collides is shown."""
    checker, rng = EDGE_SCENES[scene](tmp_path), np.random.default_rng(5)
    samples = 500 if times(1) == 1 else 10_000
    counts, left = dict.fromkeys(EdgeStatus, 0), times(COUNTS[scene])
    while left > 0:
        edges = edges_of(checker, min(left, _BATCH), rng)
        left -= len(edges)
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
    print(scene, {status.name: count for status, count in counts.items()}, samples)
    assert counts[EdgeStatus.FREE] > 0
    # What is neither is nearer to a collision than a micrometre.
    assert counts[EdgeStatus.UNDECIDED] <= 0.03 * sum(counts.values())


def test_scenes_have_thin_things_in_the_way(tmp_path):
    """Sixty joints; and edges of each scene on which hardly anything collides, but something."""
    for scene in COUNTS:
        folder = tmp_path / scene
        folder.mkdir()
        checker = EDGE_SCENES[scene](folder)
        assert checker.plan.tree.num_positions >= (60 if scene == "chain" else 2)
        edges = edges_of(checker, 100, np.random.default_rng(8))
        statuses = [measure.status for measure in checker.measure_edges(edges)]
        assert {EdgeStatus.FREE, EdgeStatus.COLLIDES} <= set(statuses)
        assert (edges[::10, 0] == edges[::10, 1]).all()
