"""The memory of dropped contact surfaces is used again, and never while anybody looks at it."""

import numpy as np
import pytest

from scene_graph_ros.geometry import (
    add_compliant_hydroelastic_properties,
    GeometryFrame,
    GeometryInstance,
    ProximityProperties,
    SceneGraph,
    Sphere,
)

BALLS = 12


@pytest.fixture
def ask():
    """Return a function that moves soft balls that overlap a little, and asks for surfaces."""
    scene_graph = SceneGraph()
    source = scene_graph.register_source("balls")
    properties = ProximityProperties()
    add_compliant_hydroelastic_properties(properties, 0.03, 1e6)
    for k in range(BALLS):
        frame = scene_graph.register_frame(source, GeometryFrame(f"frame{k}"))
        ball = GeometryInstance(np.eye(4), Sphere(0.1), f"ball{k}")
        geometry = scene_graph.register_geometry(source, frame, ball)
        scene_graph.assign_role(source, geometry, properties)
    context = scene_graph.create_default_context()
    query = scene_graph.query_object(context)
    X_WF = np.tile(np.eye(4), (BALLS, 1, 1))

    def surfaces(step):
        X_WF[:, 0, 3] = (0.12 + 1e-5 * step) * np.arange(BALLS)
        context.set_frame_poses(source, X_WF)
        return query.compute_contact_surfaces()

    return surfaces


def address(surfaces):
    """Return where the vertices are."""
    return surfaces.vertices_W.ctypes.data


def test_dropped_surfaces_leave_their_memory_to_the_next(ask):
    """The system clears no new pages for an answer that follows one of its size."""
    for step in range(3):
        ask(step)
    seen = set()
    for step in range(3, 9):
        surfaces = ask(step)
        seen.add(address(surfaces))
    assert len(surfaces.vertices_W) > 4096  # what is small comes from the heap
    assert len(seen) == 2


def test_seen_surfaces_keep_their_bits(ask):
    """A column, a face's row, gradients and a slice of an earlier answer stay as they were."""
    looks = (
        lambda s: s.vertices_W[3:],
        lambda s: s.corners,
        lambda s: s[1].face_centroids_W,
        lambda s: s.pressure[::2],
    )
    views, copies = [], []
    for step, look in enumerate(looks):
        views.append(look(ask(step)))
        copies.append(views[-1].copy())
    for step in range(4, 8):
        ask(step)
    for view, copy in zip(views, copies, strict=True):
        assert (view == copy).all()
