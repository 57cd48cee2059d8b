"""Cases of the corpus as scenes of the public API."""

import numpy as np

from hard_corpus.bodies import extent
from scene_graph_ros.geometry import (
    GeometryFrame,
    GeometryInstance,
    ProximityProperties,
    SceneGraph,
)

__all__ = ["scene_of", "spread"]


def scene_of(cases):
    """Return (query object, ids of A and B per case): all pairs in one scene, a frame per body."""
    scene_graph = SceneGraph()
    source = scene_graph.register_source("corpus")
    poses, ids = {}, []
    for k, case in enumerate(cases):
        pair = []
        for name, shape, X in (("A", case.A, case.X_WA), ("B", case.B, case.X_WB)):
            frame = scene_graph.register_frame(source, GeometryFrame(f"{name}{k}"))
            instance = GeometryInstance(np.eye(4), shape, f"{name}{k}")
            geometry = scene_graph.register_geometry(source, frame, instance)
            scene_graph.assign_role(source, geometry, ProximityProperties())
            poses[frame] = X
            pair.append(geometry)
        ids.append(pair)
    context = scene_graph.create_default_context()
    context.set_frame_poses(source, poses)
    return scene_graph.query_object(context), ids


def spread(cases):
    """Return the finite cases on a grid, 10 m apart, so that only the pairs themselves meet."""
    found = []
    for case in cases:
        if extent(case.A) > 0.0 and extent(case.B) > 0.0:
            place = np.array((*divmod(len(found), 40), 0)) * 10.0
            X_WA, X_WB = case.X_WA.copy(), case.X_WB.copy()
            X_WA[:3, 3] += place
            X_WB[:3, 3] += place
            found.append(case._replace(X_WA=X_WA, X_WB=X_WB))
    return found
