"""A solid of many triangles is found once, and read as it was."""

import numpy as np
import pytest

from scene_graph_ros.geometry.meshes.solids import solid
from scene_graph_ros.geometry.meshes.solids.kept_solid import LEAST_KEPT

ROWS = 60


def bodies(turn):
    """Return two overlapping tori of 60 by 60 quadrilaterals, and a triangle beside them."""
    u, v = np.meshgrid(*[2.0 * np.pi * np.arange(ROWS) / ROWS] * 2, indexing="ij")
    ring = 1.0 + 0.3 * np.cos(v)
    torus = np.stack([ring * np.cos(u), ring * np.sin(u), 0.3 * np.sin(v)], axis=-1).reshape(-1, 3)
    i, j = np.meshgrid(np.arange(ROWS), np.arange(ROWS), indexing="ij")
    at = [((i + a) % ROWS * ROWS + (j + b) % ROWS).ravel() for a, b in ((0, 0), (1, 0), (1, 1))]
    last = (i * ROWS + (j + 1) % ROWS).ravel()
    faces = np.concatenate([np.stack(at, axis=1), np.stack([at[0], at[2], last], axis=1)])
    c, s = np.cos(turn), np.sin(turn)
    other = torus @ np.array([(c, 0.0, s), (0.0, 1.0, 0.0), (-s, 0.0, c)])
    stray = np.array([(9.0, 0.0, 0.0), (9.5, 0.0, 0.0), (9.0, 1.0, 0.0)])
    vertices = np.concatenate([torus, other, stray])
    count = len(torus)
    return vertices, np.concatenate(
        [faces, faces + count, [[2 * count, 2 * count + 1, 2 * count + 2]]]
    )


@pytest.mark.parametrize("turn", [1.0])
def test_a_second_read_takes_it_from_the_disk(monkeypatch, turn):
    """Every array and the report are as they were found; another tolerance is found anew."""
    vertices, triangles = bodies(turn)
    assert len(triangles) > LEAST_KEPT
    first = solid.solid_of(vertices, triangles, 1e-6)
    assert first.report.sheets == 1
    found = solid._of_any_parts
    calls = []
    monkeypatch.setattr(solid, "_of_any_parts", lambda *a: calls.append(1) or found(*a))
    again = solid.solid_of(vertices, triangles, 1e-6)
    assert not calls
    for one, other in zip(first, again, strict=True):
        if isinstance(one, np.ndarray):
            assert one.dtype == other.dtype
            np.testing.assert_array_equal(one, other)
        else:
            assert one == other
    solid.solid_of(vertices, triangles, 1e-7)
    assert calls == [1]
