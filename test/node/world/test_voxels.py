"""Messages of maps: whose they are, where they are, and those that change nothing."""

import sys
from types import SimpleNamespace

from nav_msgs.msg import OccupancyGrid
import numpy as np
import pytest
from rclpy.serialization import serialize_message
from workspace_messages import message_class

from msg_adapters.errors import TooLargeError, UnavailableError
from msg_adapters.voxel_maps import octomap_data
from scene_graph_ros.geometry import GeometryInstance, VoxelGrid
from scene_graph_ros.node.effects.declarations import EFFECT_NAMES
from scene_graph_ros.node.world import voxel_limits
from scene_graph_ros.node.world.faults import Fault
from scene_graph_ros.node.world.inputs import message_type
from scene_graph_ros.node.world.intake import Intake, UNSTAMPED
from scene_graph_ros.node.world.scenes import SceneLoader
from scene_graph_ros.node.world.source_channel import apply_kept
from scene_graph_ros.node.world.time_limits import TimeLimits
from scene_graph_ros.node.world.voxel_channel import VoxelChannel
from scene_graph_ros.node.world.world import World

SCENE = """
version: 1
sources: [{name: mapper, voxels: {free: 20, occupied: 60}}]
geometries:
  - {name: map, source: mapper, roles: {proximity: {}}, pose: {xyz: [-1, 0, 0]},
     shape: {type: voxel_grid, voxel: 0.5, counts: [4, 3, 2], runs: [[2, 24]]}}
"""
OCTOMAP = SCENE.replace("free: 20, occupied: 60", "type: octomap_msgs/msg/Octomap")
NOW = 10**12
LIMITS = TimeLimits(now=NOW, max_age=5 * 10**9, max_lead=10**9)
MOST = 1000


def flat(cells, frame="world", *, at=(-1.0, 0.0, 0.0), resolution=0.5, **fields):
    """Return a map whose cells ``(rows, cols)`` begin at a point."""
    cells = np.asarray(cells)
    message = OccupancyGrid(data=cells.reshape(-1).tolist())
    message.header.frame_id = frame
    message.info.height, message.info.width = cells.shape
    message.info.resolution = resolution
    position = message.info.origin.position
    position.x, position.y, position.z = at
    message.info.origin.orientation.w = 1.0
    for name, value in fields.items():
        setattr(message, name, value)
    return message


class Mapping:
    """A world with a voxel grid, and the channel that fills it."""

    def __init__(self, text=SCENE):
        self.world, self.warnings = World(), []
        loader = SceneLoader("", message_type, EFFECT_NAMES)
        request = SimpleNamespace(resource="", text=text, prefix="")
        self.world.edit(lambda edit: loader.load_request(edit, request))
        self.record = self.world.records["mapper"]
        self.intake = Intake("mapper", self.warnings.append)
        self.channel = VoxelChannel(self.record, self.intake, MOST, "world")

    def send(self, *messages, stamp=NOW, is_static=False):
        """Have messages arrive before one update; tell whether they changed the grid."""
        for message in messages:
            message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp, 10**9)
            self.channel.store(serialize_message(message), 1, is_static=is_static)
        with self.world.lock:
            grids, record = self.world.grids, self.world.records.get("mapper")
            got = apply_kept(self.channel, record, lambda: grids.get("mapper"), LIMITS)
            if got is not None:
                self.world.commit((), got, (), {"mapper"})
        return got is not None

    def voxels(self):
        """Return the states in the newest snapshot."""
        snapshot = self.world.snapshot
        return snapshot.query.snapshot.voxel_set(snapshot.names.geometry_id("map")).occupancy

    def faults(self):
        """Return the faults so far."""
        return dict(self.intake.statistics.faults)


CELLS = [[0, 100, -1, 20], [60, 59, 21, 0], [0, 0, 0, 0]]
STATES = np.array([[0, 1, 2, 0], [1, 2, 2, 0], [0, 0, 0, 0]]).T


def test_a_flat_map_fills_the_grid_at_all_heights():
    """Columns along x, rows along y; of two messages between updates the newest counts."""
    mapping = Mapping()
    assert mapping.world.snapshot.with_grids == {"mapper"}
    assert mapping.world.snapshot.has_elements
    assert mapping.send(flat(np.zeros((3, 4), int)), flat(CELLS))
    assert (mapping.voxels() == STATES[:, :, np.newaxis]).all()
    assert mapping.faults() == {}
    assert mapping.intake.statistics.superseded == 1
    assert mapping.world.snapshot.source_stamp("mapper") == NOW
    assert mapping.channel.newest == {
        "free voxels": 14, "occupied voxels": 4, "unknown voxels": 6,
    }  # fmt: skip


def test_a_map_elsewhere_and_of_other_cells_is_put_where_it_is():
    """What the map does not have is unknown; a voxel has the worst of the cells that it meets."""
    mapping = Mapping()
    mapping.send(flat([[0, 100, 0]], at=(-0.5, 0.5, 7.0)))
    expected = np.full((4, 3, 2), 2)
    expected[1:, 1] = np.array([0, 1, 0])[:, np.newaxis]
    assert (mapping.voxels() == expected).all()
    fine = np.zeros((12, 16), int)
    fine[5, 9] = 100
    mapping.send(flat(fine, resolution=0.125))
    expected = np.zeros((4, 3, 2))
    expected[2, 1] = 1
    assert (mapping.voxels() == expected).all()


def octomap(states, at=(0.0, 0.0, 0.0), *, voxel=0.5, binary=True, **fields):
    """Return a map of states ``(nx, ny, nz)`` from a point on."""
    kind = message_class("octomap_msgs", "Octomap")
    X = np.eye(4)
    X[:3, 3] = at
    data = octomap_data(VoxelGrid(states, voxel), X, binary=binary)
    message = kind(id="OcTree", binary=binary, resolution=voxel, data=data)
    message.header.frame_id = "world"
    for name, value in fields.items():
        setattr(message, name, value)
    return message


@pytest.mark.parametrize("binary", [True, False])
def test_an_octree_fills_the_grid_where_both_are(binary):
    """What is beyond the grid is not read into it."""
    message_class("octomap_msgs", "Octomap")
    mapping = Mapping(OCTOMAP)
    states = np.random.default_rng(3).integers(0, 3, (9, 8, 7))
    assert mapping.send(octomap(states, (-1.5, -0.5, -1.0), binary=binary)), mapping.warnings
    assert (mapping.voxels() == states[1:5, 1:4, 2:4]).all()
    assert mapping.send(octomap(np.ones((2, 2, 2), int), (40.0, 0.0, 0.0), binary=binary))
    assert (mapping.voxels() == 2).all()


@pytest.mark.parametrize(
    ("fault", "said", "message", "late"),
    [
        ("malformed", "data has 2 cells, not the 4", flat([[0, 0]], info=flat(CELLS[:1]).info), 0),
        ("malformed", r"from -1 to 100, not 101", flat([[101]]), 0),
        ("malformed", "voxel must be an edge", flat([[0]], resolution=0.0), 0),
        ("malformed", "voxel must be an edge", flat([[0]], resolution=float("nan")), 0),
        ("malformed", "OccupancyGrid origin", flat([[0]], at=(float("inf"), 0.0, 0.0)), 0),
        ("too_large", "1001 cells, more than max_voxels_per_map", flat([[0] * 1001]), 0),
        ("too_large", "bytes, at most", flat([[0] * 300_000]), 0),
        ("unknown_frame", "no frame_id", flat(CELLS, ""), 0),
        ("unknown_frame", "'nowhere', and the grid in 'world'", flat(CELLS, "nowhere"), 0),
        ("stale", "max_pose_age", flat(CELLS), 6 * 10**9),
        ("future", "max_pose_lead", flat(CELLS), -2 * 10**9),
        ("out_of_order", "go back", flat(CELLS), 1),
    ],
)
def test_faults_are_counted_and_named_and_change_nothing(fault, said, message, late):
    """The voxels before hold."""
    mapping = Mapping()
    mapping.send(flat(CELLS))
    before = mapping.voxels()
    assert not mapping.send(message, stamp=NOW - late)
    assert mapping.faults() == {Fault(fault): 1}
    assert said in mapping.warnings[-1]
    assert mapping.voxels() is before


@pytest.mark.parametrize(
    ("fault", "said", "states", "fields"),
    [
        ("malformed", "ends within a node", [[[1]]], {"data": [3]}),
        ("malformed", "must be one of ['ColorOcTree', 'OcTree']", [[[1]]], {"id": "Cubes"}),
        ("malformed", "resolution must be positive", [[[1]]], {"resolution": -1.0}),
        ("too_large", "more than 1000", [[[1]]], {"data": [85, 85], "resolution": 0.01}),
    ],
)
def test_octrees_that_are_none_change_nothing(fault, said, states, fields):
    """Nor those that are too fine for the grid."""
    message_class("octomap_msgs", "Octomap")
    mapping = Mapping(OCTOMAP)
    before = mapping.voxels()
    assert not mapping.send(octomap(states, **fields))
    assert mapping.faults() == {Fault(fault): 1}
    assert said in mapping.warnings[-1]
    assert mapping.voxels() is before


def test_a_map_that_is_published_once_never_gets_too_old():
    """As a latched one arrives, long after its stamp."""
    mapping = Mapping()
    assert mapping.send(flat(CELLS), stamp=NOW - 100 * 10**9, is_static=True)
    assert (mapping.voxels() == STATES[:, :, np.newaxis]).all()


def test_of_several_grids_the_file_names_one():
    """Else nobody knows which, and that is said."""
    more = SCENE + SCENE[SCENE.index("  - {name: map") :].replace("name: map", "name: more")
    mapping = Mapping(more)
    assert not mapping.send(flat(CELLS))
    assert mapping.faults() == {Fault.UNKNOWN_GEOMETRY: 1}
    assert "2 voxel grids" in mapping.warnings[0]
    named = Mapping(more.replace("free: 20", "geometry: map, free: 20"))
    assert named.send(flat(CELLS))
    assert (named.voxels() == STATES[:, :, np.newaxis]).all()


def test_a_grid_on_a_frame_takes_maps_in_that_frame():
    """By its name or path; one in the world's is refused, as nobody knows where the frame was."""
    moving = SCENE.replace("geometries:", "frames: [{name: base, source: mapper}]\ngeometries:")
    mapping = Mapping(
        moving.replace("source: mapper, roles", "source: mapper, frame: base, roles")
    )
    for name in ("base", "mapper/base"):
        assert mapping.send(flat(CELLS, name)), mapping.warnings
    assert not mapping.send(flat(CELLS))
    assert mapping.faults() == {Fault.UNKNOWN_FRAME: 1}
    assert "the grid in 'mapper/base'" in mapping.warnings[-1]


def test_an_edit_carries_the_voxels_over():
    """The same set, so that nothing is built again; its stamp is forgotten with all others."""
    mapping = Mapping()
    mapping.send(flat(CELLS))
    before = mapping.voxels()
    mapping.world.edit(lambda edit: edit.add_source("new", token=1))
    assert mapping.voxels() is before
    assert not mapping.send(flat(CELLS), stamp=NOW - 1)
    mapping.world.forget_stamps()
    assert mapping.world.snapshot.source_stamp("mapper") == UNSTAMPED
    assert mapping.send(flat(CELLS), stamp=NOW - 1)


def test_messages_that_are_not_installed_are_named(monkeypatch):
    """By their package; a file that asks for them is read all the same."""
    monkeypatch.setitem(sys.modules, "octomap_msgs.msg", None)
    with pytest.raises(UnavailableError, match="octomap_msgs is not installed"):
        Mapping(OCTOMAP)


def test_grids_of_many_requests_have_a_limit_together(monkeypatch):
    """The edit that would have too many is refused as a whole."""
    mapping = Mapping()
    monkeypatch.setattr(voxel_limits, "MOST_IN_SCENE", 40)
    before = mapping.world.snapshot.scene_version

    def add(edit, size):
        grid = GeometryInstance(np.eye(4), VoxelGrid(np.zeros((size, 1, 1), int), 0.1), "more")
        edit.scene_graph.register_anchored_geometry(edit.records["mapper"].id, grid)

    with pytest.raises(TooLargeError, match="2 voxel grids would have 41 voxels together"):
        mapping.world.edit(lambda edit: add(edit, 17))
    assert mapping.world.snapshot.scene_version == before
    mapping.world.edit(lambda edit: add(edit, 16))
