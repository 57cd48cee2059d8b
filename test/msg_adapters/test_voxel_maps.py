"""Maps of nav_msgs and octomap_msgs, to and from voxel grids."""

import contextlib
from types import SimpleNamespace

from nav_msgs.msg import OccupancyGrid
import numpy as np
import pytest
from rclpy.serialization import deserialize_message, serialize_message
from workspace_messages import message_class

from msg_adapters.errors import MessageError
from msg_adapters.voxel_maps import (
    occupancy_grid_to_msg,
    octomap_data,
    voxels_from_occupancy_grid,
    voxels_from_octomap,
)
from scene_graph_ros.geometry.shapes.voxel_grid import VoxelGrid

# Written by OctoMap 1.10 (writeBinaryData, writeData) of a tree of 0.5 m in which (0.1, 0.1, 0.1)
# and (1.1, -0.6, 0.1) are occupied, (-0.1, 0.1, 0.6) is free, and nothing else is known.
BINARY = bytes.fromhex(
    "00fc3000300030003000300030003000300030003000300030003000c00002000c000c000c000c00"
    "0c000c000c000c000c000c000c000c000c000c000004030003000300030003000300030003000300"
    "030003000300030003000200"
)
FULL = bytes.fromhex(
    "83e8583fe083e8583f0483e8583f0483e8583f0483e8583f0483e8583f0483e8583f0483e8583f04"
    "83e8583f0483e8583f0483e8583f0483e8583f0483e8583f0483e8583f0483e8583f0883e8583f01"
    "83e8583f001f99cfbe021f99cfbe021f99cfbe021f99cfbe021f99cfbe021f99cfbe021f99cfbe02"
    "1f99cfbe021f99cfbe021f99cfbe021f99cfbe021f99cfbe021f99cfbe021f99cfbe021f99cfbe20"
    "1f99cfbe0083e8583f0183e8583f0183e8583f0183e8583f0183e8583f0183e8583f0183e8583f01"
    "83e8583f0183e8583f0183e8583f0183e8583f0183e8583f0183e8583f0183e8583f0183e8583f01"
    "83e8583f00"
)
HIT, MISS = FULL[:4], bytes.fromhex("1f99cfbe")


def octomap(data, *, binary=True, resolution=0.5, kind="OcTree"):
    """Return the fields of a message."""
    signed = np.array(np.frombuffer(data, np.int8) if isinstance(data, bytes) else data, np.int8)
    return SimpleNamespace(data=signed, binary=binary, resolution=resolution, id=kind)


def full(extra=b""):
    """Return the same tree as log-odds, node by node, with so many bytes more for each."""
    nodes = [FULL[k : k + 5] for k in range(0, len(FULL), 5)]
    return b"".join(node[:4] + extra + node[4:] for node in nodes)


def states_at(placed, points):
    """Return the states at points ``(n, 3)`` of the map, m."""
    at = np.floor((np.array(points) - placed.X_MG[:3, 3]) / placed.grid.voxel).astype(int)
    return placed.grid.occupancy[tuple(at.T)].tolist()


POINTS = [(0.1, 0.1, 0.1), (1.1, -0.6, 0.1), (-0.1, 0.1, 0.6), (0.6, 0.1, 0.1)]


def test_an_octree_of_octomap_is_the_voxels_that_it_knows():
    """Around all that is known; what is not known is unknown."""
    placed = voxels_from_octomap(octomap(BINARY))
    assert placed.grid.voxel == 0.5
    assert placed.X_MG[:3, 3].tolist() == [-0.5, -1.0, 0.0]
    assert placed.grid.occupancy.shape == (4, 3, 2)
    assert states_at(placed, POINTS) == [1, 1, 0, 2]
    assert (placed.grid.occupancy != 2).sum() == 3


@pytest.mark.parametrize("kind", ["OcTree", "ColorOcTree"])
def test_a_full_octree_is_the_same(kind):
    """Log-odds of at least 0 are occupied; colours are skipped."""
    data = full(b"\x01\x02\x03" if kind == "ColorOcTree" else b"")
    placed = voxels_from_octomap(octomap(data, binary=False, kind=kind))
    expected = voxels_from_octomap(octomap(BINARY))
    assert placed.grid == expected.grid
    assert (placed.X_MG == expected.X_MG).all()


def test_voxels_go_out_as_octomap_writes_them_and_come_back():
    """The same bytes as of that library; of random grids the same voxels, pruned or not."""
    placed = voxels_from_octomap(octomap(BINARY))
    data = octomap_data(*placed)
    assert np.array(data, np.int8).tobytes() == BINARY
    rng = np.random.default_rng(5)
    for part in (0.02, 0.5):
        states = rng.choice([0, 1, 2], (9, 12, 17), p=[1 - 2 * part, part, part])
        states[:, :8, :8] = 0
        X_MG = np.eye(4)
        X_MG[:3, 3] = np.array([-3, 5, -8]) * 0.05
        grid = VoxelGrid(states, 0.05)
        back = voxels_from_octomap(octomap(octomap_data(grid, X_MG), resolution=0.05))
        first = np.round((back.X_MG - X_MG)[:3, 3] / 0.05).astype(int)
        whole = np.full(states.shape, 2)
        inside = tuple(
            slice(a, a + n) for a, n in zip(first, back.grid.occupancy.shape, strict=True)
        )
        whole[inside] = back.grid.occupancy
        assert (whole == states).all()
    assert octomap_data(VoxelGrid(np.full((2, 2, 2), 2), 0.1), np.eye(4)) == []
    assert voxels_from_octomap(octomap(b"")).grid.occupancy.size == 0


def test_full_octrees_are_written_node_by_node_as_octomap_does():
    """The same nodes and bits, with the limits of log-odds; inner ones have the largest below."""
    placed = voxels_from_octomap(octomap(BINARY))
    limits = {HIT: np.float32(3.5).tobytes(), MISS: np.float32(-2.0).tobytes()}
    expected = b"".join(
        limits[FULL[k : k + 4]] + FULL[k + 4 : k + 5] for k in range(0, len(FULL), 5)
    )
    data = octomap_data(*placed, binary=False)
    assert np.array(data, np.int8).tobytes() == expected
    rng = np.random.default_rng(8)
    for part in (0.02, 0.4):
        states = rng.choice([0, 1, 2], (17, 9, 12), p=[1 - 2 * part, part, part])
        states[4:12, :, 3:11] = rng.integers(0, 2)
        grid, X_MG = VoxelGrid(states, 0.05), np.eye(4)
        X_MG[:3, 3] = np.array([-5, 3, -6]) * 0.05
        binary, whole = (octomap_data(grid, X_MG, binary=binary) for binary in (True, False))
        back = voxels_from_octomap(octomap(whole, binary=False, resolution=0.05))
        assert back.grid == voxels_from_octomap(octomap(binary, resolution=0.05)).grid
    assert octomap_data(VoxelGrid(np.full((2, 2, 2), 2), 0.1), np.eye(4), binary=False) == []


def test_messages_of_octomap_msgs_are_read_as_they_arrive():
    """And what is written fits their field."""
    kind = message_class("octomap_msgs", "Octomap")
    data = np.frombuffer(BINARY, np.int8).tolist()
    sent = kind(id="OcTree", binary=True, resolution=0.5, data=data)
    placed = voxels_from_octomap(deserialize_message(serialize_message(sent), kind))
    assert placed.grid == voxels_from_octomap(octomap(BINARY)).grid
    assert list(kind(data=octomap_data(*placed)).data) == data


def test_a_leaf_that_is_large_is_as_many_voxels():
    """Within a region; all of them would be too many, which is said."""
    everything = octomap(b"UU", resolution=0.1)
    with pytest.raises(MessageError, match=r"spans 65536 x 65536 x 65536 voxels.*Give a region"):
        voxels_from_octomap(everything)
    placed = voxels_from_octomap(everything, region=([0, 0, -0.25], [0.5, 1.0, 0.25]))
    assert placed.grid.occupancy.shape == (5, 10, 6)
    assert (placed.grid.occupancy == 0).all()
    assert placed.X_MG[:3, 3] == pytest.approx([0.0, 0.0, -0.3])


@pytest.mark.parametrize(
    ("message", "told"),
    [
        (octomap(BINARY[:-1]), "data ends within a node"),
        (octomap(BINARY + b"\0"), "data goes on behind its last node"),
        (octomap(17 * b"\x03\x00"), "data has nodes below depth 16"),
        (octomap(full()[:-2], binary=False), "data ends within a node"),
        (octomap(40 * (HIT + b"\x01"), binary=False), "data has nodes below depth 16"),
        (octomap(BINARY, resolution=0.0), "resolution must be positive, not 0.0"),
        (octomap(BINARY, resolution=float("nan")), "resolution must be positive, not nan"),
        (octomap(BINARY, kind="Other"), r"id must be one of \['ColorOcTree', 'OcTree'\]"),
    ],
)
def test_what_is_no_octree_is_refused(message, told):
    """By what is wrong with it."""
    with pytest.raises(MessageError, match=told):
        voxels_from_octomap(message)


def test_any_bytes_are_an_octree_or_refused():
    """None hangs, and none takes more than it may."""
    rng = np.random.default_rng(6)
    for binary in (True, False):
        for _ in range(200):
            data = rng.integers(0, 256, rng.integers(0, 400)).astype(np.uint8).tobytes()
            message = octomap(data, binary=binary)
            with contextlib.suppress(MessageError):
                placed = voxels_from_octomap(message, region=([0] * 3, [5] * 3))
                assert max(placed.grid.occupancy.shape) <= 10


def test_a_grid_that_is_turned_or_between_voxels_is_no_octree():
    """Nor one that is too far away."""
    grid, X = VoxelGrid([[[1]]], 0.1), np.eye(4)
    for row, told in (((0, 3, 0.05), "whole voxels from its"), ((0, 3, 1e6), "are outside")):
        moved = X.copy()
        moved[row[0], row[1]] = row[2]
        with pytest.raises(MessageError, match=told):
            octomap_data(grid, moved)
    X[:2, :2] = [[0, -1], [1, 0]]
    with pytest.raises(MessageError, match="parallel to the map's axes"):
        octomap_data(grid, X)


def flat(data, width, height, resolution=0.05):
    """Return an OccupancyGrid at (1, 2, 0)."""
    msg = OccupancyGrid()
    msg.info.width, msg.info.height, msg.info.resolution = width, height, resolution
    msg.info.origin.position.x, msg.info.origin.position.y = 1.0, 2.0
    msg.info.origin.orientation.w = 1.0
    msg.data = data
    return msg


def test_a_flat_map_is_walls_as_high_as_its_layers():
    """X along columns, y along rows; per cents are states, and go back as these."""
    msg = flat([0, 100, -1, 25, 50, 65], 3, 2)
    placed = voxels_from_occupancy_grid(msg, layers=4)
    assert placed.grid.occupancy.shape == (3, 2, 4)
    assert placed.grid.occupancy[:, :, 3].T.tolist() == [[0, 1, 2], [0, 2, 1]]
    assert placed.X_MG[:3, 3].tolist() == [1.0, 2.0, 0.0]
    back = occupancy_grid_to_msg(*placed)
    assert list(back.data) == [0, 100, -1, 0, -1, 100]
    assert back.info.resolution == pytest.approx(0.05)
    assert (back.info.width, back.info.height) == (3, 2)
    assert back.info.origin == msg.info.origin


@pytest.mark.parametrize(
    ("message", "layers", "told"),
    [
        (flat([0, 0], 3, 2), 1, "data has 2 cells, not the 6 of 2 rows of 3"),
        (flat([0, 0, 101], 3, 1), 1, r"data\[2\] must be from -1 to 100, not 101"),
        (flat([0], 1, 1), 2**30, "are not from 0 to"),
        (flat([0], 1, 1, resolution=0.0), 1, "OccupancyGrid: VoxelGrid: voxel must be an edge"),
    ],
)
def test_a_flat_map_that_is_none_is_refused(message, layers, told):
    """By what is wrong with it."""
    with pytest.raises(MessageError, match=told):
        voxels_from_occupancy_grid(message, layers=layers)
