"""The bytes that pages read."""

from __future__ import annotations

import struct

from browser_page import (
    CONTACTS,
    MESH,
    POSES,
    read_blocks,
    SCENE,
    SURFACES,
    TEXTURE,
    TIME,
    VERTICES,
)
import numpy as np
from pictured_files import png
import pytest

from scene_graph_ros.views.browser.blocks import (
    contacts_block,
    mesh_block,
    poses_block,
    scene_block,
    surfaces_block,
    texture_block,
    time_block,
    vertices_block,
)


def test_a_covered_mesh_and_its_picture():
    """Numbers of pictures, places on them and normals by triangle; pixels row by row."""
    places = np.arange(12.0).reshape(2, 3, 2)
    texels = np.arange(24, dtype=np.uint8).reshape(2, 3, 4)
    message = texture_block(8, png(texels)) + mesh_block(
        5,
        np.zeros((3, 3)),
        np.array([(0, 1, 2), (2, 1, 0)]),
        np.full((2, 3), 7, np.uint8),
        textures=[0, 8],
        coordinates=places,
        normals=np.arange(18.0).reshape(2, 3, 3),
    )
    (kind, texture), (_, mesh) = read_blocks(message)
    assert kind == TEXTURE
    assert texture[0] == 8
    assert texture[1].tolist() == texels.tolist()
    assert mesh[4].tolist() == [0, 8]
    assert mesh[5].tolist() == places.reshape(2, 6).tolist()
    assert mesh[6].tolist() == np.arange(18.0).reshape(2, 9).tolist()


def test_a_time_is_three_doubles_behind_kind_and_length():
    """Written out by hand: 8 bytes of head, 24 of numbers."""
    expected = struct.pack("<IIddd", 1, 24, 2.5, 7.0, 3.0)
    assert time_block(2_500_000_000, 7, 3) == expected


def test_blocks_of_any_length_stand_behind_each_other():
    """Each begins at a multiple of 8 bytes, so that doubles can be read where they are."""
    X_WG = np.tile(np.eye(4), (1, 1, 1))
    X_WG[0, :3, 3] = (1e6 + 0.1, -2.0, 3.0)
    X_WG[0, :3, :3] = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]  # a quarter turn about z
    triangles = np.array([(0, 1, 2)])
    message = b"".join(
        (
            scene_block({"a": "é"}),
            mesh_block(5, np.arange(9.0).reshape(3, 3), triangles),
            mesh_block(6, np.zeros((3, 3)), triangles, np.array([(255, 128, 0)], np.uint8)),
            poses_block(np.array([2.0**40 + 1]), X_WG),
            contacts_block(
                np.ones((1, 3)),
                np.array([(2**40, 3)]),
                np.array([(0.0, 0.0, 1.0)]),
                np.array([0.25]),
            ),
            vertices_block(9, np.array([(1e6, 0.0, 0.0), (1e6 + 0.5, 1.0, 2.0)])),
            time_block(0, 1, 1),
        )
    )
    blocks = read_blocks(message)
    assert [kind for kind, _ in blocks] == [SCENE, MESH, MESH, POSES, CONTACTS, VERTICES, TIME]
    scene, mesh, painted, poses, contacts, vertices, _ = (content for _, content in blocks)
    assert scene == {"a": "é"}
    assert mesh[0] == 5
    assert mesh[1].tolist() == [[0, 1, 2], [3, 4, 5], [6, 7, 8]]
    assert mesh[2].tolist() == [[0, 1, 2]]
    assert len(mesh[3]) == 0
    assert painted[3].tolist() == [[255, 128, 0, 255]]
    ((position, rotation),) = [poses[2.0**40 + 1]]
    assert position.tolist() == [1e6 + 0.1, -2.0, 3.0]
    # Of a turn by a about z: (0, 0, sin(a/2), cos(a/2)).
    assert rotation.tolist() == pytest.approx([0, 0, 0.5**0.5, 0.5**0.5], abs=1e-7)
    assert [each.tolist() for each in contacts] == [[[1, 1, 1]], [[2**40, 3]], [[0, 0, 1]], [0.25]]
    assert vertices[0] == 9
    assert vertices[1].tolist() == [[1e6, 0, 0], [1e6 + 0.5, 1, 2]]


def test_surfaces_have_a_pressure_at_each_corner():
    """Positions are told from the first corner."""
    corners = np.array([(1e6, 0, 0), (1e6 + 1, 0, 0), (1e6, 1, 0)])
    ((kind, content),) = read_blocks(surfaces_block(corners, np.array([0.0, 0.5, 3.0]), 2e4))
    assert kind == SURFACES
    scale, positions, pressures = content
    assert scale == 2e4
    assert positions.tolist() == corners.tolist()
    assert pressures.tolist() == [0, 0.5, 3]


def test_nothing_is_a_block_too():
    """No contacts, a mesh without triangles, no vertices."""
    empty = np.empty((0, 3))
    message = contacts_block(empty, np.empty((0, 2)), empty, np.empty(0)) + mesh_block(
        1, empty, np.empty((0, 3), dtype=np.int64)
    )
    message += vertices_block(2, empty)
    contacts, mesh, vertices = (content for _, content in read_blocks(message))
    assert [len(each) for each in contacts] == [0, 0, 0, 0]
    assert (len(mesh[1]), len(mesh[2]), len(vertices[1])) == (0, 0, 0)


def test_a_number_that_json_has_not_is_refused():
    """Browsers would not read it."""
    with pytest.raises(ValueError, match="not JSON compliant"):
        scene_block({"size": float("nan")})
