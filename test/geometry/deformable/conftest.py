"""Soft boxes and what they meet, that the tests of deformable contact share."""

import numpy as np
import pytest

from scene_graph_ros.geometry import (
    GeometryFrame,
    GeometryInstance,
    ProximityProperties,
    SceneGraph,
)


def pose(x=0.0, y=0.0, z=0.0, R=None):
    """Return a pose (4, 4)."""
    X = np.eye(4)
    X[:3, 3] = (x, y, z)
    if R is not None:
        X[:3, :3] = R
    return X


def instance(shape, name, X=None):
    """Return an instance with the proximity role."""
    result = GeometryInstance(np.eye(4) if X is None else X, shape, name)
    result.set_proximity_properties(ProximityProperties())
    return result


class Scene:
    """One source with whatever is added to it."""

    def __init__(self):
        self.graph = SceneGraph()
        self.source = self.graph.register_source("scene")
        self._context = None

    def soft(self, shape, hint=None, X=None, *, name=None, mesh=None):
        """Add a deformable geometry."""
        name = name or f"soft_{self.graph.model_inspector().num_geometries()}"
        return self.graph.register_deformable_geometry(
            self.source,
            self.graph.world_frame_id(),
            instance(shape, name, X),
            hint,
            reference_mesh=mesh,
        )

    def rigid(self, shape, X=None, *, anchored=True):
        """Add a rigid geometry, on a frame of its own unless it is anchored."""
        name = f"rigid_{self.graph.model_inspector().num_geometries()}"
        if anchored:
            return self.graph.register_anchored_geometry(self.source, instance(shape, name, X))
        frame = self.graph.register_frame(self.source, GeometryFrame(name))
        return self.graph.register_geometry(self.source, frame, instance(shape, name, X))

    @property
    def context(self):
        """The one context, made when it is asked for first."""
        if self._context is None:
            self._context = self.graph.create_default_context()
        return self._context

    @property
    def query(self):
        """A live query object."""
        return self.graph.query_object(self.context)

    def contact(self):
        """Return the contact now."""
        return self.query.compute_deformable_contact()

    def deform(self, geometry_id, function):
        """Move the vertices by a function of where they are."""
        q_WG = function(self.query.get_configurations_in_world(geometry_id))
        self.context.set_configurations(self.source, {geometry_id: q_WG})

    def mesh(self, geometry_id):
        """Return the reference mesh."""
        return self.context.inspector().get_reference_mesh(geometry_id)


@pytest.fixture(name="scene")
def _scene():
    return Scene()


@pytest.fixture(name="make_scene")
def _make_scene():
    return Scene


@pytest.fixture(name="pose")
def _pose():
    return pose


def check_invariants(surface, query):
    """Check what holds for every surface, of whatever geometries."""
    count = surface.num_contact_points
    assert count > 0
    starts = surface.face_starts
    assert starts[0] == 0 and starts[-1] == len(surface.vertices_W)
    assert (np.diff(starts) >= 3).all() and (np.diff(starts) <= 8).all()
    size = np.ptp(query.get_configurations_in_world(surface.id_A), axis=0).max()
    reach = np.abs(query.get_configurations_in_world(surface.id_A)).max()
    near = 1e-12 * size + 1e-14 * reach
    assert np.allclose(np.linalg.norm(surface.nhats_BA_W, axis=1), 1.0, rtol=0, atol=1e-14)
    assert (surface.face_areas > 0.0).all()
    assert (surface.signed_distances <= 0.0).all()
    for face in range(count):
        corners, n = surface.polygon(face), surface.nhats_BA_W[face]
        arms = corners - surface.contact_points_W[face]
        assert np.abs(arms @ n).max() <= near  # flat, with the contact point in its plane
        around = np.cross(arms, np.roll(arms, -1, axis=0)) @ n
        assert (around > -near * size).all()  # convex about its centroid, counter-clockwise
        assert 0.5 * around.sum() == pytest.approx(surface.face_areas[face], rel=1e-6)
    sides = [(surface.id_A, surface.vertex_indices_A, surface.barycentric_coordinates_A)]
    if surface.is_B_deformable:
        sides.append((surface.id_B, surface.vertex_indices_B, surface.barycentric_coordinates_B))
    for geometry_id, indices, weights in sides:
        q_WG = query.get_configurations_in_world(geometry_id)
        assert np.allclose(weights.sum(axis=1), 1.0, rtol=0, atol=1e-15)
        assert (weights > -1e-6).all()
        points = np.einsum("fk,fkj->fj", weights, q_WG[indices])
        assert np.abs(points - surface.contact_points_W).max() <= near


@pytest.fixture(name="check_invariants")
def _check_invariants():
    return check_invariants
