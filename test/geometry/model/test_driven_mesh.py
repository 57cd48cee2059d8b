"""Surfaces that deformable geometries carry along."""

import numpy as np
import pytest
from soft_bodies import QUARTER, soft_instance, TETRAHEDRON, WORLD

from scene_graph_ros.geometry import (
    GeometryFrame,
    GeometryId,
    GeometryInstance,
    IllustrationProperties,
    Mesh,
    PerceptionProperties,
    ProximityProperties,
    Role,
)
from scene_graph_ros.geometry.errors import (
    DeformableError,
    InvalidShapeError,
    PropertyError,
    RoleError,
    UnknownIdError,
)
from scene_graph_ros.geometry.meshes.volume_mesh import VolumeMesh


def test_driven_mesh_is_the_boundary(world):
    """For each role it has, the outside of the volume mesh, whose vertices move with it."""
    roles = (ProximityProperties, IllustrationProperties, PerceptionProperties)
    soft = world.scene_graph.register_deformable_geometry(
        world.arm, WORLD, soft_instance(roles=roles), 0.1
    )
    context = world.scene_graph.create_default_context()
    context.set_configurations(world.arm, {soft: 2.0 * context.configuration(soft)})
    query = world.scene_graph.query_object(context)
    for role in (Role.PROXIMITY, Role.ILLUSTRATION, Role.PERCEPTION):
        (surface,) = world.inspector.get_driven_meshes(soft, role)
        assert surface.num_triangles == 6 * 2 * 2 * 2
        assert surface.volume == pytest.approx(0.2**3, rel=1e-12)
        (q_WD,) = query.get_driven_mesh_configurations_in_world(soft, role)
        assert np.array_equal(q_WD, 2.0 * surface.vertices)


@pytest.mark.parametrize("as_path", [False, True])
def test_embedded_mesh_moves_with_the_material(world, tmp_path, as_path):
    """Vertices inside, on the surface and outside follow an affine map exactly."""
    vertices = np.array([[0.01, 0.02, 0.03], [0.1, 0.1, 0.1], [-0.05, 0.1, 0.0], [0.0, 0.0, 0.15]])
    embedded = Mesh(vertices=vertices, faces=[[0, 1, 2], [1, 2, 3]])
    if as_path:
        path = tmp_path / "skin.obj"
        lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in vertices.tolist()]
        path.write_text("\n".join([*lines, "f 1 2 3", "f 2 3 4"]))
        embedded = str(path)
    properties = IllustrationProperties()
    properties.add_property("deformable", "embedded_mesh", embedded)
    instance = soft_instance(X=QUARTER)
    instance.set_illustration_properties(properties)
    soft = world.scene_graph.register_deformable_geometry(world.arm, WORLD, instance, 0.1)
    (surface,) = world.inspector.get_driven_meshes(soft, Role.ILLUSTRATION)
    assert np.array_equal(surface.vertices, vertices) and surface.num_triangles == 2
    (boundary,) = world.inspector.get_driven_meshes(soft, Role.PROXIMITY)
    assert boundary.is_closed
    context = world.scene_graph.create_default_context()
    M = np.array([[1.1, 0.2, 0.0], [0.0, 0.8, -0.3], [0.1, 0.0, 1.2]])
    context.set_configurations(world.arm, {soft: context.configuration(soft) @ M.T})
    query = world.scene_graph.query_object(context)
    (q_WD,) = query.get_driven_mesh_configurations_in_world(soft, Role.ILLUSTRATION)
    expected = (vertices @ QUARTER[:3, :3].T + QUARTER[:3, 3]) @ M.T
    assert np.allclose(q_WD, expected, rtol=0, atol=1e-14)


@pytest.mark.parametrize(
    ("value", "error"), [(7, PropertyError), ("no_such.obj", InvalidShapeError)]
)
def test_bad_embedded_mesh(world, pad, value, error):
    """It is refused when the role is assigned, not when it is drawn."""
    properties = IllustrationProperties()
    properties.add_property("deformable", "embedded_mesh", value)
    with pytest.raises(error):
        world.scene_graph.assign_role(world.arm, pad, properties)
    instance = soft_instance("second")
    instance.set_illustration_properties(properties)
    with pytest.raises(error):
        world.scene_graph.register_deformable_geometry(world.arm, WORLD, instance, 0.1)
    assert world.inspector.get_roles(pad) == {Role.PROXIMITY}


@pytest.mark.parametrize("method", ["get_reference_mesh", "get_driven_meshes"])
def test_inspector_refuses_rigid_and_unknown(world, pad, method):
    """What only a deformable geometry has is refused for others, and for roles it lacks."""
    arguments = [Role.PROXIMITY] if method == "get_driven_meshes" else []
    ask = getattr(world.inspector, method)
    with pytest.raises(DeformableError, match=r"'ball'.*rigid"):
        ask(world.ball1, *arguments)
    with pytest.raises(UnknownIdError):
        ask(GeometryId.get_new_id(), *arguments)
    query = world.scene_graph.query_object(world.scene_graph.create_default_context())
    with pytest.raises(RoleError, match=r"'pad'.*PERCEPTION"):
        world.inspector.get_driven_meshes(pad, Role.PERCEPTION)
    with pytest.raises(RoleError, match=r"'pad'.*PERCEPTION"):
        query.get_driven_mesh_configurations_in_world(pad, Role.PERCEPTION)
    with pytest.raises(DeformableError, match=r"'ball'.*rigid"):
        query.get_configurations_in_world(world.ball1)


def test_a_deformable_needs_no_surface_data(world, tmp_path):
    """The description of a deformable is not read: a file of it may be gone by then."""
    path = tmp_path / "gone.obj"
    path.write_text("v 0 0 0\n")
    instance = GeometryInstance(np.eye(4), Mesh(path), "gone")
    mesh = VolumeMesh(TETRAHEDRON, [[0, 1, 2, 3]])
    soft = world.scene_graph.register_deformable_geometry(
        world.arm, WORLD, instance, reference_mesh=mesh
    )
    path.unlink()
    world.scene_graph.assign_role(world.arm, soft, ProximityProperties())
    frame = world.scene_graph.register_frame(world.arm, GeometryFrame("f"))
    assert world.inspector.get_geometries(frame) == []
