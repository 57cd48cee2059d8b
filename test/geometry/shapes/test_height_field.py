"""Height fields as shapes: what they take, and what they refuse."""

import pickle

import numpy as np
import pytest

from scene_graph_ros.geometry import HeightField
from scene_graph_ros.geometry.errors import InvalidShapeError
from scene_graph_ros.geometry.shapes.field_surface import (
    drawn_places,
    field_triangles,
    field_vertices,
)

HEIGHTS = np.array([[1 / 3, 0.0, -0.25], [0.0, 1e-9, 2.0]])
SIZE = (1.0, 0.5)


@pytest.mark.parametrize(
    "heights",
    [HEIGHTS, HEIGHTS.tolist(), HEIGHTS.astype(">f8"), np.asfortranarray(HEIGHTS)],
)
def test_numbers_of_any_form_are_heights(heights):
    """Layout, byte order and type do not matter; they are copied."""
    field = HeightField(heights, SIZE, -1)
    assert (field.heights == HEIGHTS).all()
    assert (field.size, field.floor, field.num_elements) == (SIZE, -1.0, 4)
    assert field.x().tolist() == [-0.5, 0.0, 0.5]
    assert field.y().tolist() == [-0.25, 0.25]
    assert repr(field) == "HeightField(2x3, size=(1, 0.5), floor=-1)"
    with pytest.raises(ValueError, match="read-only"):
        field.heights[0, 0] = 1.0


def test_equal_numbers_are_equal_fields():
    """So is a copy that was pickled."""
    field = HeightField(HEIGHTS, SIZE, -1.0)
    assert field == pickle.loads(pickle.dumps(field)) == HeightField(HEIGHTS.copy(), SIZE, -1.0)
    assert hash(field) == hash(HeightField(HEIGHTS, SIZE, -1.0))
    assert field != HeightField(HEIGHTS, SIZE, -2.0)
    assert field != HeightField(HEIGHTS + 1.0, SIZE, -1.0)
    assert field != HeightField(HEIGHTS, (1.0, 0.6), -1.0)
    assert field != HEIGHTS.tolist()


@pytest.mark.parametrize(
    ("heights", "size", "floor", "told"),
    [
        (HEIGHTS[0], SIZE, -1.0, r"heights must be \(rows, cols\), at least two of each"),
        (HEIGHTS[:1], SIZE, -1.0, r"at least two of each, not \(1, 3\)"),
        (np.where(HEIGHTS == 2.0, np.nan, HEIGHTS), SIZE, -1.0, r"heights\[1, 2\] .* not nan"),
        (np.where(HEIGHTS == 2.0, np.inf, HEIGHTS), SIZE, -1.0, r"heights\[1, 2\] .* not inf"),
        (np.where(HEIGHTS == 2.0, 3e9, HEIGHTS), SIZE, -1.0, r"within 1e\+09 m of the floor"),
        (HEIGHTS, SIZE, -0.25, r"heights\[0, 2\] must lie above the floor at -0.25 m"),
        (HEIGHTS, SIZE, np.nan, "floor must be a number"),
        (HEIGHTS, SIZE, "low", "floor must be a number"),
        (HEIGHTS, (1.0,), -1.0, "size must be two numbers"),
        (HEIGHTS, 1.0, -1.0, "size must be two numbers"),
        (HEIGHTS, (1.0, 0.0), -1.0, "size along y"),
        (HEIGHTS, (np.inf, 1.0), -1.0, "size along x"),
        (HEIGHTS, (1.9e-9, 1.0), -1.0, "size along x .* each of its 2 cells"),
        (np.array([["a", "b"], ["c", "d"]]), SIZE, -1.0, "heights must be numbers"),
    ],
)
def test_what_is_no_field_is_refused(heights, size, floor, told):
    """With the name of the value, and the index of a height."""
    with pytest.raises(InvalidShapeError, match=told):
        HeightField(heights, size, floor)


@pytest.mark.parametrize("most", [None, 3])
def test_its_surface_is_closed(most):
    """Each edge is there once each way, and the volume is that of its prisms."""
    rng = np.random.default_rng(0)
    heights = rng.uniform(0.0, 1.0, (4, 6)) if most is None else np.ones((4, 6))
    field = HeightField(heights, SIZE, -1.0)
    places = drawn_places(field, most)
    corners, triangles = field_vertices(field, field.heights, places), field_triangles(places)
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    known = set(map(tuple, edges.tolist()))
    assert len(known) == len(edges)
    assert known == {(b, a) for a, b in known}
    a, b, c = corners[triangles].transpose(1, 0, 2)
    volume = np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6.0
    tops = np.stack([heights[:-1, :-1], heights[:-1, 1:], heights[1:, 1:], heights[1:, :-1]])
    means = (2.0 * tops[0] + tops[1] + 2.0 * tops[2] + tops[3]) / 6.0
    assert volume == pytest.approx((means.mean() + 1.0) * 0.5, rel=1e-12)
