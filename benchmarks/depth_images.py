"""How long an image of depth, or a cloud, takes: ``python -m benchmarks.depth_images``.

A Panda before a table, seen by a camera that looks at it and by one at its wrist, 640x480. Of each
image points are made without the robot, by exact distances to its bodies, and an image before it
is cleared; likewise of the same points as a cloud in rows and columns. Times are of the processor,
the least of some calls.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
import os
import time
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.machine import machine
from benchmarks.plans import panda
from scene_graph_ros.geometry import (
    Box,
    GeometryInstance,
    PerceptionProperties,
    SceneGraph,
)
from scene_graph_ros.geometry.perception import (
    CameraIntrinsics,
    ClippingRange,
    DepthRange,
    DepthRenderCamera,
    ExactRenderEngine,
    RenderCameraCore,
)
from scene_graph_ros.geometry.spatial.poses import pose_from_xyz_rpy
from scene_graph_ros.scene_files import register_robot
from scene_graph_ros.sensing import CloudView, DepthRules, DepthView, SeenPoints, SelfFilter

__all__ = ["main"]

_LENS = CameraIntrinsics(640, 480, 600.0, 600.0, 319.5, 239.5)
_Q = (0.0, -0.5, 0.0, -2.0, 0.0, 1.6, 0.8)
_REPEATS = 7


def _least(ask: Callable[[], Any]) -> float:
    """Return the least time of some calls, ms, after one that is not counted."""
    ask()
    times = []
    for _ in range(_REPEATS):
        begin = time.process_time()
        ask()
        times.append(time.process_time() - begin)
    return 1e3 * min(times)


def _at(eye: Sequence[float], target: Sequence[float]) -> NDArray[np.float64]:
    """Return the pose of a camera at an eye that looks at a target, y down."""
    ahead = np.subtract(target, eye) / np.linalg.norm(np.subtract(target, eye))
    right = np.cross(ahead, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    X_WC = np.eye(4)
    X_WC[:3, :3] = np.stack([right, np.cross(ahead, right), ahead], axis=1)
    X_WC[:3, 3] = eye
    return X_WC


def images() -> tuple[SelfFilter, dict[str, tuple[NDArray[np.float32], NDArray[np.float64]]]]:
    """Return the filter of the robot, in place, and by camera an image and its pose."""
    model, semantics = panda()
    graph = SceneGraph()
    source, cell = graph.register_source("panda"), graph.register_source("cell")
    frames = register_robot(model, graph, source, semantics=semantics, visual=False)
    table = GeometryInstance(pose_from_xyz_rpy([0.57, 0.0, -0.02]), Box(0.8, 1.2, 0.04), "table")
    table.set_perception_properties(PerceptionProperties())
    graph.register_anchored_geometry(cell, table)
    bodies = graph.model_inspector().get_geometries_for_source(source)
    for body in bodies:
        graph.assign_role(source, body, PerceptionProperties())
    graph.add_renderer("exact", ExactRenderEngine())
    tree = model.kinematic_tree(semantics)
    q = np.zeros(tree.num_positions)
    q[:7], q[7:] = _Q, 0.02
    X_WF = dict(zip(frames.values(), tree.link_poses(q, list(frames)), strict=True))
    context = graph.create_default_context()
    context.set_frame_poses(source, X_WF)
    own = SelfFilter(graph.model_inspector(), bodies)
    own.place(X_WF)
    X_HC = pose_from_xyz_rpy([0.07, 0.0, -0.03], [0.0, -0.3, 1.5708])
    places = {
        "looks at it": _at((1.6, 0.0, 0.9), (0.3, 0.0, 0.3)),
        "at its wrist": X_WF[frames["panda_hand"]] @ X_HC,
    }
    core = RenderCameraCore("exact", _LENS, ClippingRange(0.01, 10.0))
    camera, query = DepthRenderCamera(core, DepthRange(0.01, 10.0)), graph.query_object(context)
    still = SceneGraph.world_frame_id()
    return own, {
        name: (query.render_depth_image(camera, still, X_WC), X_WC)
        for name, X_WC in places.items()
    }


def main() -> int:
    """Print the table."""
    print(machine(os.getloadavg()[0]))
    print("| camera | pixels | robot's points | points | to points ms | clearing ms |")
    print("| --- | ---: | ---: | ---: | ---: | ---: |")
    own, seen = images()
    for name, (depth, X_WC) in seen.items():
        whole = DepthView.of(depth, _LENS, X_WC, DepthRules(step=1))
        cells = np.flatnonzero(whole.p_CPs[..., 2].reshape(-1) > 0.0)
        p_CPs, size = whole.p_CPs.reshape(-1, 3)[cells], whole.mask.shape
        looks: dict[str, Callable[[], DepthView | CloudView]] = {
            "all": partial(DepthView.of, depth, _LENS, X_WC, DepthRules(step=1), own),
            "blocks of 2 x 2": partial(DepthView.of, depth, _LENS, X_WC, DepthRules(step=2), own),
            "a cloud": partial(
                CloudView.of, p_CPs, X_WC, DepthRules(error=2e-3), own, cells=cells, size=size
            ),
        }
        for said, look in looks.items():
            view = look()
            new = view.points()
            before = SeenPoints(new.p_WPs, new.radii, *np.zeros((2, len(new.radii)), np.int64))
            taken = _least(lambda look=look: look().points())
            cleared = _least(lambda b=before, v=view, n=new: b.after(v, n, 1, 1_000_000))
            print(
                f"| {name} | {said} | {len(view.own_points())} | {len(new.radii)} |"
                f" {taken:.1f} | {cleared:.1f} |",
                flush=True,
            )
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
