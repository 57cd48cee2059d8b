"""The drawing of the cameras' conventions is the one that its program makes."""

from pathlib import Path

import matplotlib.image
import numpy as np
import pytest

from scene_graph_ros.geometry import SceneGraph
from scene_graph_ros.geometry.perception import DepthRange, DepthRenderCamera, RenderCameraCore
from tools import camera_conventions as drawing

PICTURE = Path(__file__).parents[2] / "docs" / "camera_conventions.png"


def test_the_picture_is_up_to_date(tmp_path):
    """Pixel by pixel, but for what another version of the fonts does."""
    drawing.main(["--output", str(tmp_path / "a.png")])
    now, kept = (matplotlib.image.imread(path) for path in (tmp_path / "a.png", PICTURE))
    assert now.shape == kept.shape
    assert kept[..., :3].std() > 0.05
    assert np.abs(now - kept).mean() < 0.002


def test_the_depth_that_is_drawn_is_that_of_the_image():
    """At the pixel whose ray is shown."""
    u, v = drawing.SHOWN
    core = RenderCameraCore("exact", drawing.LENS, drawing.CLIPPING, drawing.X_BS)
    limits = DepthRange(drawing.CLIPPING.near, drawing.CLIPPING.far)
    query = drawing.ball_before_camera()
    depth = query.render_depth_image(
        DepthRenderCamera(core, limits), SceneGraph.world_frame_id(), drawing.X_WP @ drawing.X_PC
    )
    assert depth[v, u] == pytest.approx(drawing.shown_ray()[1], rel=1e-6)
