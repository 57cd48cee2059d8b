"""A voxel grid that a lidar's clouds fill, over DDS: free is what their rays go through.

The ball of 0.1 m slides along x. All space is unknown first, and the lidar stands at (0, 0, 0).
"""

from cloud_messages import cloud_message
from diagnostic_msgs.msg import DiagnosticArray
from node_harness import diagnostics_from_now, diagnostics_values, wait_until
import numpy as np
from plan_goals import at, rail_publisher
from robot_scenes import SLIDE
from sensor_msgs.msg import PointCloud2

from scene_graph_msgs.msg import Status
from scene_graph_msgs.srv import CheckConfigurations

FREE, COLLIDES = CheckConfigurations.Response.FREE, CheckConfigurations.Response.COLLIDES

SCENE = """
version: 1
sources:
  - {name: around}
  - {name: lidar, points: {into: voxel_grid, remember: true, frame: around/mast}}
robots:
  - {name: slide, urdf: %s, positions: {rail: 1.5}, collision: true}
frames: [{name: mast, source: around}]
geometries:
  - name: space
    source: lidar
    pose: {xyz: [-2, -0.5, -0.3]}
    shape: {type: voxel_grid, voxel: 0.05, counts: [80, 20, 12], runs: [[2, 19200]]}
    roles: {proximity: {}}
"""


def wall(x):
    """Return points ``(n, 3)`` of a wall of 1.2 m across the rail."""
    y, z = np.meshgrid(np.linspace(-0.6, 0.6, 81), np.linspace(-0.6, 0.6, 81))
    return np.stack([np.full(y.shape, x), y, z], axis=-1).reshape(-1, 3)


def test_rays_free_the_space_before_what_they_hit(client, start_node, tmp_path):
    """Free before a wall, occupied there, unknown behind; when it went away, free up to the next.

    What no ray has met stays unknown.
    """
    (tmp_path / "slide.urdf").write_text(SLIDE)
    (tmp_path / "scene.yaml").write_text(SCENE % (tmp_path / "slide.urdf"))
    start_node({"scene": tmp_path / "scene.yaml", "diagnostics_rate": 10.0})
    clouds = client.publisher(PointCloud2, "/lidar/points")
    diagnostics = client.listen(DiagnosticArray, "/diagnostics")
    rail = rail_publisher(client)

    def outcomes():
        answer = client.call("CheckConfigurations", configurations=at(-0.8, -1.2, -1.6, 0.8))
        assert answer.status.code == Status.OK, answer.status
        return list(answer.outcomes)

    def is_seen(x, *expected):
        message = cloud_message(wall(x), "a frame that the scene has not")
        message.header.stamp = client.now()
        rail(1.5)
        clouds.publish(message)
        rail(1.5)
        return outcomes() == list(expected)

    assert outcomes() == [COLLIDES] * 4
    wait_until(lambda: is_seen(-1.2, FREE, COLLIDES, COLLIDES, COLLIDES), "space before the wall")
    said = diagnostics_values(diagnostics_from_now(client, diagnostics), "source lidar points")
    assert int(said["free voxels"]) > 100
    assert int(said["occupied voxels"]) > 10
    wait_until(lambda: is_seen(-3.0, FREE, FREE, FREE, COLLIDES), "space where the wall was")
