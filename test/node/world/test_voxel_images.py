"""Images of depth that fill a voxel grid: seen through, hit, unknown, and what there is no more.

The world is that of ``looking_arm``: a camera at (1, 0, 0) of an arm that turns about z.
"""

from cloud_messages import cloud_message
from looking_arm import Looking, NOW, SCENE, SECOND
import numpy as np
import pytest
from rclpy.serialization import serialize_message

from scene_graph_ros.geometry import GeometryInstance, PointCloud, Voxel
from scene_graph_ros.geometry.perception import CameraIntrinsics
from scene_graph_ros.node.world.depth_channel import DepthChannel
from scene_graph_ros.node.world.faults import Fault
from scene_graph_ros.node.world.intake import Intake
from scene_graph_ros.node.world.point_channel import PointChannel
from scene_graph_ros.node.world.sensor_worker import ToldWorker
from scene_graph_ros.node.world.source_channel import apply_kept
from scene_graph_ros.node.world.source_stamps import seen_until
from scene_graph_ros.node.world.time_limits import TimeLimits
from scene_graph_ros.sensing import DepthRules, DepthView, voxels_after

FREE, OCCUPIED, UNKNOWN = (int(state) for state in Voxel)
EDGE, COUNTS, LOWER = 0.1, (50, 50, 12), np.array([-2.5, -2.5, -0.6])
WHOLE = int(np.prod(COUNTS))
GRID = f"""  - {{name: seen, source: camera, pose: {{xyz: {LOWER.tolist()}}},
     shape: {{type: voxel_grid, voxel: {EDGE}, counts: {list(COUNTS)}, runs: [[2, {WHOLE}]]}},
     roles: {{proximity: {{}}}}}}
"""
CLOUD = SCENE[SCENE.index("  - {name: seen") :]
VOXELS = SCENE.replace(CLOUD, GRID).replace("eye/depth,", "eye/depth, into: voxel_grid,")
LENS = {"height": 60, "width": 60, "k": [50.0, 0.0, 29.5, 0.0, 50.0, 29.5, 0.0, 0.0, 1.0]}


class LookingIntoGrid(Looking):
    """Looks with a lens of 60 x 60 pixels."""

    def __init__(self, folder, text=VOXELS):
        super().__init__(folder, text)
        self.images = DepthChannel(self.world.records["camera"], self.intake, 60 * 60)
        self.send_info(**LENS)
        self.update()

    def see(self, depth, **fields):
        """Have an image arrive; tell whether an update filled voxels of it."""
        rows = np.full((60, 60), depth, "<f4") if np.ndim(depth) == 0 else depth.astype("<f4")
        fields = {"height": 60, "width": 60, "step": 240, "data": rows.tobytes(), **fields}
        return self.send(**fields)

    @property
    def snapshot(self):
        """The newest snapshot of the geometry."""
        return self.world.snapshot.query.snapshot

    def voxels(self):
        """Return the states in the newest snapshot."""
        return self.snapshot.voxel_set(self.world.snapshot.names.geometry_id("seen")).occupancy

    def at(self, *p_W):
        """Return the state of the voxel at a point."""
        return int(self.voxels()[tuple(((np.array(p_W) - LOWER) / EDGE).astype(int))])


@pytest.fixture
def looking(tmp_path):
    """Return a world whose camera fills a grid that nobody has seen."""
    return LookingIntoGrid(tmp_path)


def test_an_image_frees_the_space_it_sees_through_from_where_it_was_taken(looking):
    """The states are those of the core, at the arm's angle between two joint states."""
    looking.turn(0.0, NOW - 20_000_000)
    looking.turn(1.0, NOW)
    assert (looking.voxels() == UNKNOWN).all()
    assert looking.see(1.0, stamp=NOW - 10_000_000)
    lens = CameraIntrinsics(60, 60, 50.0, 50.0, 29.5, 29.5)
    X_WC, X_WG = np.eye(4), np.eye(4)
    # x right, y down, z ahead, at half a radian.
    c, s = np.cos(0.5), np.sin(0.5)
    X_WC[:3, :3] = np.transpose([[s, -c, 0.0], [0.0, 0.0, -1.0], [c, s, 0.0]])
    X_WC[:3, 3], X_WG[:3, 3] = (c, s, 0.0), LOWER
    rules = DepthRules(step=1, near=0.1, far=5.0, lower=(-np.inf, -np.inf, -0.3))
    view = DepthView.of(np.full((60, 60), 1.0, np.float32), lens, X_WC, rules)
    expected, changed = voxels_after(np.full(COUNTS, UNKNOWN), EDGE, X_WG, view)
    assert min(changed) > 50
    assert (looking.voxels() == expected).all()
    assert looking.at(1.5 * c, 1.5 * s, 0.0) == FREE
    assert looking.at(2.0 * c, 2.0 * s, 0.0) == OCCUPIED
    assert looking.at(2.3 * c, 2.3 * s, 0.0) == UNKNOWN  # behind what is seen
    assert looking.at(-1.0, 0.0, 0.0) == UNKNOWN  # out of view
    free, occupied, unknown = np.bincount(expected.reshape(-1), minlength=3).tolist()
    assert looking.images.newest == {
        "free voxels": free, "occupied voxels": occupied, "unknown voxels": unknown,
        "points of the newest image": len(looking.world.snapshot.images["camera"].radii),
        "voxels freed by it": free, "voxels hit by it": occupied,
    }  # fmt: skip
    assert looking.faults() == {}


def test_unknown_voxels_count_as_a_query_asks(looking):
    """A point behind the wall is in the grid, or as far away as the wall."""
    assert looking.see(1.0)
    grid = looking.world.snapshot.names.geometry_id("seen")

    def distance(query, *p_W):
        (found,) = [e for e in query.compute_signed_distance_to_point(p_W) if e.id_G == grid]
        return found.distance

    query = looking.world.snapshot.query
    assert distance(query, 2.35, 0.05, 0.05) < 0.0
    known = query.with_unknown_voxels(is_free=True)
    assert distance(known, 2.35, 0.05, 0.05) == pytest.approx(0.25)  # the wall's voxels end at 2.1
    assert distance(known, 1.55, 0.05, 0.05) == pytest.approx(0.45)


def test_what_went_away_is_cleared_and_what_nobody_looks_at_stays(looking):
    """Only where the next image sees through it: half of its pixels have no depth."""
    assert looking.see(1.0)
    left, right = (2.05, 0.15, 0.05), (2.05, -0.15, 0.05)
    assert looking.at(*left) == looking.at(*right) == OCCUPIED
    depth = np.full((60, 60), 3.0)
    depth[:, 30:] = np.nan
    looking.now += SECOND
    assert looking.see(depth, stamp=NOW + SECOND)
    assert looking.at(*left) == FREE
    assert looking.at(*right) == OCCUPIED


def test_the_robot_is_no_voxel_and_a_load_that_was_seen_goes_with_it(looking):
    """The ball at (2, 0, 0) is occupied space until the arm holds it."""
    depth = np.full((60, 60), 1.45)
    depth[26:34, 26:34] = 0.95
    assert looking.see(depth)
    assert looking.at(1.95, 0.05, 0.05) == OCCUPIED

    def hang(edit):
        inspector = edit.scene_graph.model_inspector()
        frame = inspector.get_frame_id_by_name(edit.records["load"].id, "held")
        upper = inspector.get_frame_id_by_name(edit.records["arm"].id, "upper")
        edit.scene_graph.change_parent(edit.records["load"].id, frame, upper)

    before = looking.voxels()
    looking.world.edit(hang)
    assert (looking.voxels() == before).all()  # an edit keeps the voxels
    looking.now = NOW + SECOND
    looking.turn(0.0, NOW + SECOND)
    assert looking.see(depth, stamp=NOW + SECOND)
    assert looking.at(1.95, 0.05, 0.05) == FREE
    assert looking.at(2.45, 0.55, 0.05) == OCCUPIED  # the wall, beside it
    assert looking.faults() == {}


def test_voxels_expire_to_unknown_and_the_scene_s_own_do_not(tmp_path):
    """After three seconds, of those that were seen again later than that; free ones, too."""
    half = WHOLE // 2
    begun = VOXELS.replace(f"runs: [[2, {WHOLE}]]", f"runs: [[0, {half}], [2, {half}]]")
    looking = LookingIntoGrid(tmp_path, begun)
    assert looking.see(1.0)
    looking.now += 2 * SECOND
    depth = np.full((60, 60), np.nan)
    depth[:, :30] = 1.0
    assert looking.see(depth, stamp=looking.now)
    seen = looking.voxels()
    looking.now = NOW + 3 * SECOND
    assert not looking.update()
    looking.now += 1
    assert looking.update()
    assert looking.at(2.05, 0.15, 0.05) == OCCUPIED
    assert looking.at(1.55, 0.15, 0.05) == FREE
    assert looking.at(2.05, -0.15, 0.05) == looking.at(1.55, -0.15, 0.05) == UNKNOWN
    assert not looking.update()
    looking.now = NOW + 5 * SECOND + 1
    assert looking.update()
    gone = seen != looking.voxels()
    assert gone.sum() > 100
    assert (looking.voxels()[gone] == UNKNOWN).all()
    assert (looking.voxels()[:25] == FREE).all()  # as the file has them


def test_a_clock_that_jumps_back_has_voxels_expire_after_that_time(looking):
    """As points do."""
    assert looking.see(1.0)
    looking.world.forget_stamps(NOW - SECOND)
    looking.now = NOW + 2 * SECOND
    assert not looking.update()
    looking.now += 1
    assert looking.update()
    assert (looking.voxels() == UNKNOWN).all()


def test_an_image_is_looked_at_beside_the_updates(looking):
    """The voxels come with a later update; those before it hold until then."""
    worker = ToldWorker()
    looking.images.look_in(worker)
    assert not looking.see(1.0)
    assert (looking.voxels() == UNKNOWN).all()
    worker.finish()
    assert looking.update()
    assert looking.at(1.55, 0.05, 0.05) == FREE


def test_a_world_tells_until_when_all_is_in_it_that_sensors_saw(tmp_path):
    """The newest image of the sensor that is behind; of sensors that remember alone."""

    def seen(looking):
        now = looking.world.snapshot
        return seen_until(now.images, now.records, now.sensing)

    looking = LookingIntoGrid(tmp_path)
    assert seen(looking) == 0
    assert looking.see(1.0, stamp=NOW - 3)
    looking.turn(1.0, NOW)
    assert seen(looking) == NOW - 3
    looking.world.forget_stamps()
    assert seen(looking) == 0
    second = "sources:\n  - {name: late, depth: {image: late/depth, fills: camera}}"
    looking = LookingIntoGrid(tmp_path, VOXELS.replace("sources:", second))
    assert looking.see(1.0)
    assert seen(looking) == 0
    plain = VOXELS.replace("- {name: load}", "- {name: load}\n  - {name: once, points: {}}")
    plain += CLOUD.replace("source: camera", "source: once").replace("name: seen", "name: cloud")
    looking = LookingIntoGrid(tmp_path, plain)
    assert looking.see(1.0)
    assert seen(looking) == NOW


def test_a_cloud_of_the_same_source_is_left_alone(looking):
    """Images fill the grid; the grid listens to no maps."""
    assert looking.world.snapshot.sensing == {"camera"}
    assert looking.world.snapshot.with_grids == set()
    assert looking.see(1.0)
    source = looking.world.records["camera"].id
    cloud = GeometryInstance(np.eye(4), PointCloud([[0.0, 0.0, 9.0]], 0.1), "cloud")
    looking.world.edit(lambda edit: edit.scene_graph.register_anchored_geometry(source, cloud))
    assert looking.at(1.55, 0.05, 0.05) == FREE
    looking.now += SECOND
    assert looking.see(2.0, stamp=looking.now)
    assert looking.at(2.05, 0.05, 0.05) == FREE
    assert looking.faults() == {}


class LookingWithLidar(LookingIntoGrid):
    """A lidar at the same place fills the camera's grid, too."""

    def __init__(self, folder):
        lidar = """  - {name: lidar, points: {fills: camera, remember: true, frame: arm/upper,
     pose: {xyz: [1, 0, 0]}}}
  - {name: load}"""
        super().__init__(folder, VOXELS.replace("  - {name: load}", lidar))
        record = self.world.records["lidar"]
        self.clouds = PointChannel(record, Intake("lidar", self.warnings.append), 4000)

    def hear(self, x):
        """Have a cloud of a wall 2 m wide and high arrive, x m before the lidar."""
        y, z = np.meshgrid(np.linspace(-1.0, 1.0, 41), np.linspace(-1.0, 1.0, 41))
        message = cloud_message(np.stack([np.full(y.shape, x), y, z], -1).reshape(-1, 3), "")
        message.header.stamp.sec = self.now // SECOND
        self.clouds.store(serialize_message(message), 1)
        limits, world = TimeLimits(now=self.now, max_age=5 * SECOND, max_lead=SECOND), self.world
        with world.lock:
            grid = world.clouds["camera"]
            assert apply_kept(self.clouds, self.clouds.record, lambda: grid, limits) is not None
            world.commit((), 1, (), {"camera"})


def test_clouds_fill_the_same_grid_by_their_rays(tmp_path):
    """Free before the wall that a lidar sees, occupied there; its rays begin at its own frame."""
    looking = LookingWithLidar(tmp_path)
    looking.hear(1.05)
    assert looking.at(1.55, 0.05, 0.05) == FREE
    assert looking.at(2.05, 0.05, 0.05) == OCCUPIED
    assert looking.at(2.35, 0.05, 0.05) == looking.at(1.05, 0.95, 0.05) == UNKNOWN
    assert looking.clouds.newest["voxels hit by it"] == (looking.voxels() == OCCUPIED).sum()
    # An image that sees through the wall's place clears it.
    looking.now += SECOND
    assert looking.see(3.0, stamp=looking.now)
    assert looking.at(2.05, 0.05, 0.05) == FREE
    assert looking.warnings == []


def test_what_a_sensor_of_another_source_saw_goes_with_it(tmp_path):
    """Where a source is removed all is unknown that it told last; the others' voxels stay."""
    looking = LookingWithLidar(tmp_path)
    depth = np.full((60, 60), np.nan)
    depth[:, :30] = 1.0
    looking.hear(1.25)
    before = looking.voxels()
    looking.now += SECOND
    assert looking.see(depth, stamp=looking.now)
    both = looking.voxels()
    seen_by_both = before != both  # on one side the image ends before the lidar's wall
    assert looking.at(2.05, 0.15, 0.05) == looking.at(2.25, -0.15, 0.05) == OCCUPIED
    world = looking.world
    world.edit(lambda edit: edit.remove_source(edit.records["lidar"]))
    left = looking.voxels()
    assert looking.at(2.25, -0.15, 0.05) == looking.at(2.05, -0.15, 0.05) == UNKNOWN
    assert looking.at(2.05, 0.15, 0.05) == OCCUPIED
    assert looking.at(1.55, 0.15, 0.05) == FREE
    assert seen_by_both.sum() > 20
    assert (left[seen_by_both] == both[seen_by_both]).all()
    assert (left[left != UNKNOWN] == both[left != UNKNOWN]).all()
    assert ((left == UNKNOWN) & (both != UNKNOWN)).sum() > 100
    # The grid's own sensor goes on, and what it saw stays when other sources go.
    looking.now += SECOND
    assert looking.see(1.25, stamp=looking.now)
    assert looking.at(2.25, -0.15, 0.05) == OCCUPIED
    seen = looking.voxels()
    world.edit(lambda edit: edit.remove_source(edit.records["load"]))
    assert (looking.voxels() == seen).all()
    assert looking.warnings == []


def test_of_several_grids_the_file_names_one(tmp_path):
    """Else nobody knows which, and that is said."""
    other = GRID.replace("name: seen", "name: other")
    looking = LookingIntoGrid(tmp_path, VOXELS + other)
    assert not looking.see(1.0)
    assert looking.faults() == {Fault.UNKNOWN_GEOMETRY: 1}
    assert "2 voxel grids, ['other', 'seen']" in looking.warnings[-1]
    named = VOXELS.replace("into: voxel_grid,", "into: voxel_grid, geometry: seen,")
    looking = LookingIntoGrid(tmp_path, named + other)
    assert looking.see(1.0)
    assert looking.at(1.55, 0.05, 0.05) == FREE
