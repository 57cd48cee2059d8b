"""What deformable contact returns: participation, frames, and that nothing of it changes."""

import pickle

import numpy as np
import pytest

from scene_graph_ros.geometry import Box, GeometryId, HalfSpace
from scene_graph_ros.geometry.deformable.results import ContactParticipation
from scene_graph_ros.geometry.errors import UnknownIdError

CUBE, CELL = Box(0.2, 0.2, 0.2), 0.1


def test_permutation_puts_participating_vertices_first():
    """Vertices 1, 2 and 5 of six: they become 0, 1, 2, and the others 3, 4, 5."""
    part = ContactParticipation(np.array([False, True, True, False, False, True]))
    assert part.vertices.tolist() == [1, 2, 5]
    assert part.permutation.tolist() == [3, 0, 1, 4, 5, 2]
    assert (part.num_vertices, part.num_vertices_in_contact) == (6, 3)
    vertices = np.arange(6)
    permuted = np.empty(6, int)
    permuted[part.permutation] = vertices
    assert permuted.tolist() == [1, 2, 5, 0, 3, 4]
    with pytest.raises(ValueError, match="read-only"):
        part.permutation[0] = 1


@pytest.fixture(name="surface")
def _surface(scene):
    soft = scene.soft(CUBE, CELL)
    scene.rigid(HalfSpace())
    scene.deform(soft, lambda q: q + np.array([0.0, 0.0, 0.09]))
    return scene.contact()[0]


def test_contact_frames(surface):
    """Each is right-handed and orthonormal, its z-axis against the normal."""
    R_WC = surface.R_WCs
    assert R_WC.shape == (surface.num_contact_points, 3, 3)
    assert np.allclose(R_WC[:, :, 2], -surface.nhats_BA_W, rtol=0, atol=0)
    assert np.allclose(R_WC @ np.swapaxes(R_WC, 1, 2), np.eye(3), rtol=0, atol=1e-15)
    assert np.allclose(np.linalg.det(R_WC), 1.0, rtol=0, atol=1e-15)


def test_nothing_can_be_written(surface):
    """Every array is read-only and every field frozen."""
    arrays = [value for value in vars(surface).values() if isinstance(value, np.ndarray)]
    assert len(arrays) == 9
    assert not any(array.flags.writeable for array in arrays)
    with pytest.raises(AttributeError):
        surface.face_areas = None
    with pytest.raises(IndexError):
        surface.polygon(surface.num_contact_points)


def test_sequence(scene):
    """It is a sequence of surfaces; who was not asked about is unknown."""
    empty = scene.contact()
    assert (len(empty), list(empty), dict(empty.participation)) == (0, [], {})
    with pytest.raises(UnknownIdError):
        empty.contact_participation(GeometryId.get_new_id())


def test_the_same_again(scene, surface):
    """Asked of the same moment, it is the same object; of an equal one, the same numbers."""
    assert scene.query.bake().compute_deformable_contact()[0].id_A == surface.id_A
    query = scene.query
    assert query.compute_deformable_contact() is query.compute_deformable_contact()
    other = scene.graph.query_object(scene.context.clone()).compute_deformable_contact()[0]
    for name, value in vars(surface).items():
        if isinstance(value, np.ndarray):
            assert np.array_equal(value, getattr(other, name))


def test_a_baked_query_keeps_its_moment(scene, surface):
    """What is deformed later changes the live query, not the baked one."""
    baked = scene.query.bake()
    scene.deform(surface.id_A, lambda q: q + np.array([0.0, 0.0, 1.0]))
    assert len(scene.contact()) == 0
    assert len(baked.compute_deformable_contact()) == 1


def test_surfaces_can_be_pickled(surface):
    """A surface goes to another process."""
    copy = pickle.loads(pickle.dumps(surface))
    assert copy.id_A == surface.id_A
    assert np.array_equal(copy.contact_points_W, surface.contact_points_W)
