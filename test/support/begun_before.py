"""Imported, this has done what most nodes of tests begin with, once for all that are forked.

That is to import what reads scenes and meshes and what is on in most scenes, and to load the
kernels of pairs. What is there then is taken for lasting: a forked process looks for garbage in
its own objects alone, and does not copy the pages of the others for that.
"""

from __future__ import annotations

import gc
import inspect
import sys
import threading

import numpy as np
import scipy.sparse.csgraph
import scipy.spatial  # noqa: F401
import trimesh  # noqa: F401

from scene_graph_ros.geometry import SceneGraph
from scene_graph_ros.node.effects import markers, point_contact  # noqa: F401
from scene_graph_ros.scene_files import load_scene_text

__all__: list[str] = []

_SCENE = """
version: 1
sources: [{name: s}]
frames: [{name: f, source: s, pose: {xyz: [0, 0, 0.05]}}]
geometries:
  - {name: floor, source: s, shape: {type: half_space}}
  - {name: ball, source: s, frame: f, shape: {type: sphere, radius: 0.1}}
  - {name: box, source: s, shape: {type: box, size: [1, 1, 1]}}
"""


def _ask() -> None:
    scene_graph = SceneGraph()
    load_scene_text(_SCENE).apply(scene_graph)
    query = scene_graph.query_object(scene_graph.create_default_context())
    assert query.compute_point_pair_penetration()
    assert query.compute_signed_distance_pairwise_closest_points()
    assert query.compute_signed_distance_to_point(np.zeros(3))


_ask()
# A logger looks up the files of all modules at its first message.
inspect.getmodule(sys._getframe())
assert threading.active_count() == 1, "threads are not forked"
gc.collect()
gc.freeze()
