"""Support points of a core in eight directions are those of one direction at a time."""

from cores_of_kinds import CORES
import numpy as np
import pytest

from scene_graph_ros.geometry.compiled.kernel import kernel
from scene_graph_ros.geometry.compiled.lanes import LANES, load_lanes, store_lanes
from scene_graph_ros.geometry.narrowphase.cores import kinds
from scene_graph_ros.geometry.narrowphase.cores.questions import lane_support, support
from scene_graph_ros.geometry.narrowphase.cores.registry import FILES

KINDS = {"POINT", "SEGMENT", "BOX", "CYLINDER", "ELLIPSOID", "HULL", "TRIANGLE"}
NO_KINDS = {"CURVED", "IDENTITY", "ORIGIN"}
WAYS = {"CORNERS_ACROSS_SIDE", "CORNERS_NOWHERE", "CORNERS_OF_ELLIPSOID", "CORNERS_UNKNOWN"}


@kernel
def in_lanes(core, hulls, room):
    """Write support points of directions in rows 0 to 2 into rows 3 to 5."""
    d = load_lanes(room, 0), load_lanes(room, LANES), load_lanes(room, 2 * LANES)
    x = lane_support(core, hulls, d)
    store_lanes(room, 3 * LANES, x[0])
    store_lanes(room, 4 * LANES, x[1])
    store_lanes(room, 5 * LANES, x[2])


@kernel
def one_by_one(core, hulls, room):
    """Do the same with ``support``."""
    for j in range(room.shape[1]):
        x, _ = support(core, hulls, (room[0, j], room[1, j], room[2, j]))
        room[3, j], room[4, j], room[5, j] = x


def test_every_kind_of_core_is_tried():
    """A kind that is added to ``kinds`` is to be added here, and has a file that answers."""
    assert {name for name in kinds.__all__ if name.isupper()} == KINDS | NO_KINDS | WAYS
    numbers = {getattr(kinds, name) for name in KINDS}
    assert {core[0] for core, _ in CORES.values()} == numbers == set(FILES)


@pytest.mark.parametrize("name", CORES)
def test_supports_are_those_of_one_direction(name):
    """For random directions, and along the axes, where a cylinder has a whole end."""
    core, hulls = CORES[name]
    room = np.zeros((6, LANES))
    rng = np.random.default_rng(2)
    axes = np.concatenate([np.eye(3), -np.eye(3)]).T
    for directions in [rng.normal(size=(3, LANES)) for _ in range(20)] + [axes]:
        room[:3] = 0.3
        room[:3, : directions.shape[1]] = directions
        expected = room.copy()
        in_lanes(core, hulls, room)
        one_by_one(core, hulls, expected)
        np.testing.assert_allclose(room[3:], expected[3:], rtol=0.0, atol=1e-16)
