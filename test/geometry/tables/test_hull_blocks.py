"""Hulls in one array: everything that the compressed rows hold is found in the blocks again."""

import numpy as np
import pytest

from scene_graph_ros.geometry import Convex
from scene_graph_ros.geometry.meshes.vertex_cells import cell_of
from scene_graph_ros.geometry.tables.hull_blocks import (
    corners_of_face,
    edge_range,
    EDGE_STRIDE,
    face_place,
    list_of_neighbors,
    normal_of_face,
    offset_of_face,
    vertex,
    vertex_number,
    vertex_place,
)
from scene_graph_ros.geometry.tables.shape_table import build_shape_table
from scene_graph_ros.geometry.tables.vertex_scan import GROUP

SEGMENT = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
SQUARE = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]])


PLACE, NUMBER, VERTEX, LIST = (
    getattr(f, "py_func", f) for f in (vertex_place, vertex_number, vertex, list_of_neighbors)
)
FACE_PLACE, NORMAL, OFFSET, CORNERS = (
    getattr(f, "py_func", f) for f in (face_place, normal_of_face, offset_of_face, corners_of_face)
)


def numbers(start, places):
    """Return the numbers of the vertices at places of a block."""
    return np.array([NUMBER(int(start), int(place)) for place in places])


def points(count):
    """Return points on a ball, all of them vertices of their hull."""
    p = np.random.default_rng(count).normal(size=(count, 3))
    return p / np.linalg.norm(p, axis=1)[:, None]


@pytest.fixture(name="hulls")
def _hulls():
    sets = [points(12), SEGMENT, points(50), SQUARE, SEGMENT[:1], points(260)]
    return build_shape_table([Convex(vertices=p) for p in sets], [False] * len(sets)).hulls


def test_vertices_and_neighbors_are_those_of_the_rows(hulls):
    """Each vertex is where its number says, and its list leads to the same neighbors."""
    blocks = hulls.blocks
    for k, start in enumerate(hulls.block_start):
        first, last = hulls.vertex_start[k : k + 2]
        assert blocks[start] == last - first
        for v in range(first, last):
            place = PLACE(int(start), int(v - first))
            assert np.array_equal(VERTEX(blocks, place), hulls.vertices[v])
            listed = LIST(blocks, place)
            found = blocks[listed + 1 : listed + 1 + int(blocks[listed])]
            rows = hulls.neighbors[hulls.neighbor_start[v] : hulls.neighbor_start[v + 1]]
            assert sorted(numbers(start, found) + first) == sorted(rows)


def test_faces_are_those_of_the_rows(hulls):
    """Planes and corners are the same, as many as the hull has faces, also where it has none."""
    blocks = hulls.blocks
    for k, start in enumerate(hulls.block_start):
        rows = range(*hulls.face_start[k : k + 2])
        assert int(blocks[start + 1]) == len(rows)
        for number, f in enumerate(rows):
            at = FACE_PLACE(blocks, int(start), number)
            assert np.array_equal(NORMAL(blocks, at), hulls.face_normals[f])
            assert OFFSET(blocks, at) == hulls.face_offsets[f]
            listed = CORNERS(blocks, at)
            places = blocks[listed + 1 : listed + 1 + int(blocks[listed])]
            corners = hulls.face_vertices[slice(*hulls.face_vertex_start[f : f + 2])]
            assert np.array_equal(numbers(start, places) + hulls.vertex_start[k], corners)


def test_edges_join_two_corners_and_two_faces(hulls):
    """Small solid hulls have V + F - 2 edges (Euler); both ends are corners of both faces."""
    read = getattr(edge_range, "py_func", edge_range)
    for k, start in enumerate(hulls.block_start):
        vertices, faces = hulls.blocks[start : start + 2].astype(int)
        first, last = read(hulls.blocks, int(start))
        edges = hulls.blocks[first:last].reshape(-1, EDGE_STRIDE).astype(int)
        assert len(edges) == (vertices + faces - 2 if k == 0 else 0)
        for a, f, g, b in edges:
            assert f != g
            for face in (f, g):
                at = hulls.face_vertex_start[hulls.face_start[k] + face :][:2]
                corners = hulls.face_vertices[slice(*at)] - hulls.vertex_start[k]
                assert set(numbers(start, [a, b])) <= set(corners)


def test_cells_list_the_vertices_that_lie_furthest_along_their_directions(hulls):
    """Some 10 of 260 to a cell, each with its place and its coordinates."""
    start, rows = int(hulls.block_start[5]), hulls.vertices[slice(*hulls.vertex_start[5:7])]
    cells_at, side = hulls.blocks[start + 4 : start + 6].astype(int)
    cell = getattr(cell_of, "py_func", cell_of)
    listed = []
    for d in np.random.default_rng(0).normal(size=(200, 3)):
        at, groups = hulls.blocks[cells_at + 2 * cell(tuple(d), side) :][:2].astype(int)
        entries = hulls.blocks[at : at + 4 * GROUP * groups].reshape(groups, 4, GROUP)
        found = numbers(start, entries[:, 3].ravel())
        assert np.argmax(rows @ d) in found
        assert np.array_equal(entries[:, :3].swapaxes(1, 2).reshape(-1, 3), rows[found])
        assert (np.diff(found) >= 0).all()
        listed.append(len(set(found)))
    assert np.mean(listed) < 12.0


def test_small_hulls_have_no_cells(hulls):
    """They are scanned."""
    assert hulls.blocks[hulls.block_start[2] + 5] == 0
