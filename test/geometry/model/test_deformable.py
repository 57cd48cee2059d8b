"""Deformable geometries: what is registered, and where their vertices are."""

from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays
import numpy as np
import pytest
from soft_bodies import other_configuration, QUARTER, soft_instance, TETRAHEDRON, WORLD

from scene_graph_ros.geometry import (
    Box,
    Convex,
    GeometryId,
    HalfSpace,
    Mesh,
    Role,
    SceneGraph,
    Sphere,
)
from scene_graph_ros.geometry.errors import (
    DeformableError,
    InvalidConfigurationError,
    MeshError,
    NameConflictError,
    OwnershipError,
    PropertyError,
    UnknownIdError,
)
from scene_graph_ros.geometry.meshes.volume_io import save_volume_mesh
from scene_graph_ros.geometry.meshes.volume_mesh import VolumeMesh


def test_registration(world, pad):
    """It is a geometry of its source on the world, deformable, not anchored and not rigid."""
    i = world.inspector
    assert i.is_deformable(pad) and not i.is_deformable(world.ball1)
    assert i.get_all_deformable_geometry_ids() == [pad]
    assert i.num_deformable_geometries() == 1
    assert i.get_frame_id(pad) == WORLD and not i.is_anchored(pad)
    assert i.num_anchored_geometries() == 1
    assert i.num_anchored_geometries() + i.num_dynamic_geometries() == i.num_geometries() == 5
    assert i.get_owning_source_id(pad) == world.arm
    assert i.get_geometry_id_by_name(WORLD, Role.PROXIMITY, "pad") == pad
    assert np.array_equal(i.get_pose_in_frame(pad), QUARTER)
    mesh = i.get_reference_mesh(pad)
    assert mesh.num_tetrahedra == 12
    assert mesh.volume == pytest.approx(0.2**3, rel=1e-14)


def test_it_starts_in_its_reference_configuration(world, pad):
    """The mesh in G, turned a quarter about z and moved by (3, 4, 5)."""
    context = world.scene_graph.create_default_context()
    q_WG = context.configuration(pad)
    x, y, z = world.inspector.get_reference_mesh(pad).vertices.T
    assert np.allclose(q_WG, np.column_stack([3 - y, 4 + x, 5 + z]), rtol=0, atol=1e-15)
    query = world.scene_graph.query_object(context)
    assert np.array_equal(query.get_configurations_in_world(pad), q_WG)
    with pytest.raises(ValueError, match="read-only"):
        q_WG[0] = 0.0


def test_resolution_hint(world):
    """A finer hint gives more tetrahedra; sides of a box's cells are no longer than it."""
    meshes = []
    for k, hint in enumerate((0.1, 0.05)):
        soft = world.scene_graph.register_deformable_geometry(
            world.arm, WORLD, soft_instance(f"pad_{k}"), hint
        )
        meshes.append(world.inspector.get_reference_mesh(soft))
    assert [mesh.num_tetrahedra for mesh in meshes] == [12 * 2**3, 12 * 4**3]


def test_a_ball_from_its_hint(world):
    """A round shape is made of tetrahedra with no edge longer than twice the hint."""
    soft = world.scene_graph.register_deformable_geometry(
        world.arm, WORLD, soft_instance(shape=Sphere(0.1)), 0.03
    )
    mesh = world.inspector.get_reference_mesh(soft)
    corners = mesh.vertices[mesh.tetrahedra]
    edges = np.linalg.norm(corners[:, :, None] - corners[:, None], axis=-1)
    assert edges.max() <= 0.06
    assert 0.95 < mesh.volume / (4 / 3 * np.pi * 0.1**3) < 1.0


def test_equal_balls_share_their_mesh(world):
    """A mesh is made once for a shape and hint; positions are each geometry's own."""
    soft = [
        world.scene_graph.register_deformable_geometry(
            world.arm, WORLD, soft_instance(f"soft_{k}", shape=Sphere(0.1)), hint
        )
        for k, hint in enumerate((0.05, 0.05, 0.06))
    ]
    first, second, other = (world.inspector.get_reference_mesh(i) for i in soft)
    assert first is second
    assert other.num_tetrahedra < first.num_tetrahedra
    context = world.scene_graph.create_default_context()
    q_WG = context.configuration(soft[1]).copy()
    context.set_configurations(world.arm, {soft[0]: 2.0 * q_WG})
    assert np.array_equal(context.configuration(soft[1]), q_WG)


def test_reference_mesh_is_taken_as_it_is(world):
    """A mesh of the caller's own: the shape is only a description."""
    mesh = VolumeMesh(TETRAHEDRON, [[0, 1, 2, 3]])
    soft = world.scene_graph.register_deformable_geometry(
        world.arm, WORLD, soft_instance(), reference_mesh=mesh
    )
    assert world.inspector.get_reference_mesh(soft) is mesh
    assert world.inspector.get_shape(soft) == Box(0.2, 0.2, 0.2)


def test_volume_file(world, tmp_path):
    """A Mesh of a VTK file of tetrahedra has the file's, whatever the hint, times its scale."""
    path = tmp_path / "pad.vtk"
    save_volume_mesh(path, VolumeMesh(TETRAHEDRON, [[0, 1, 2, 3]]))
    soft = world.scene_graph.register_deformable_geometry(
        world.arm, WORLD, soft_instance(shape=Mesh(path, scale=2.0)), 0.1
    )
    mesh = world.inspector.get_reference_mesh(soft)
    assert np.array_equal(mesh.vertices, 2.0 * TETRAHEDRON)
    assert mesh.num_tetrahedra == 1


@pytest.mark.parametrize(
    ("shape", "hint", "mesh", "error", "words"),
    [
        (HalfSpace(), 0.1, None, DeformableError, "'pad'.*half space"),
        (None, 0.0, None, DeformableError, "'pad'.*resolution_hint.*0.0"),
        (None, np.nan, None, DeformableError, "resolution_hint.*nan"),
        (None, True, None, DeformableError, "resolution_hint.*True"),
        (None, "0.1", None, DeformableError, "resolution_hint.*'0.1'"),
        (None, None, 7, DeformableError, "VolumeMesh.*7"),
        (None, 0.1, VolumeMesh(TETRAHEDRON, [[0, 1, 2, 3]]), DeformableError, "0.1"),
        (None, 1e-6, None, MeshError, "refused"),
        (Sphere(1.0), None, None, PropertyError, "resolution_hint"),
        (Convex(vertices=TETRAHEDRON[:3]), None, None, MeshError, "flat"),
    ],
)
def test_bad_registration_changes_nothing(world, shape, hint, mesh, error, words):
    """What cannot be made of tetrahedra is refused by name and value."""
    version = world.scene_graph.create_default_context().model_version
    with pytest.raises(error, match=words):
        world.scene_graph.register_deformable_geometry(
            world.arm, WORLD, soft_instance(shape=shape), hint, reference_mesh=mesh
        )
    assert world.scene_graph.create_default_context().model_version == version


def test_only_the_world_carries_deformables(world, pad):
    """Neither a frame that moves nor a geometry can be its parent, nor it that of another."""
    graph = world.scene_graph
    with pytest.raises(DeformableError, match=r"'link1'.*world"):
        graph.register_deformable_geometry(world.arm, world.link1, soft_instance("b"), 0.1)
    with pytest.raises(UnknownIdError):
        graph.register_deformable_geometry(world.arm, world.ball1, soft_instance("b"), 0.1)
    with pytest.raises(DeformableError, match=r"'pad'.*hang"):
        graph.register_geometry(world.arm, pad, world.instance("b"))
    with pytest.raises(NameConflictError, match="'pad'"):
        graph.register_deformable_geometry(world.arm, WORLD, soft_instance(), 0.1)
    with pytest.raises(TypeError):
        graph.register_deformable_geometry(world.arm, WORLD, Box(1, 1, 1), 0.1)
    assert world.inspector.num_deformable_geometries() == 1


@pytest.mark.parametrize("flat", [False, True])
def test_set_and_get(world, pad, flat):
    """Positions come as (v, 3) or in one row, are copied, and others' stay."""
    context = world.scene_graph.create_default_context()
    second = world.scene_graph.register_deformable_geometry(
        world.arm, WORLD, soft_instance("second"), 0.2, context=context
    )
    before = context.configuration(second)
    q_WG = other_configuration(context, pad)
    given = q_WG.ravel() if flat else q_WG
    context.set_configurations(world.arm, {pad: given})
    assert np.array_equal(context.configuration(pad), q_WG)
    given[...] = 0.0
    assert context.configuration(pad).any()
    assert context.configuration(second) is before


def bad_values(count):
    """Return positions that are refused, and what the error says."""
    good = np.zeros((count, 3))
    nan, far = good.copy(), good.copy()
    nan[3, 1], far[4, 2] = np.nan, 2e12
    return [
        (nan, r"vertex 3 .*nan"),
        (far, r"vertex 4 .*2000000000000"),
        (good[:-1], rf"\({count}, 3\).*\({count - 1}, 3\)"),
        (good.ravel()[:-1], rf"\({3 * count},\)"),
        (good.T, r"\(3, "),
        ("soft", "numbers"),
        ([[1.0], [1.0, 2.0]], "numbers"),
    ]


@pytest.mark.parametrize("case", range(7))
def test_bad_positions_change_nothing(world, pad, case):
    """All or nothing: the first geometry's good positions are not taken either."""
    graph = world.scene_graph
    second = graph.register_deformable_geometry(world.arm, WORLD, soft_instance("second"), 0.2)
    context = graph.create_default_context()
    before, version = context.snapshot, context.pose_version
    value, words = bad_values(world.inspector.get_reference_mesh(second).num_vertices)[case]
    with pytest.raises(InvalidConfigurationError, match=f"'second' of source 'arm'.*{words}"):
        context.set_configurations(
            world.arm, {pad: other_configuration(context, pad), second: value}
        )
    assert context.snapshot is before and context.pose_version == version


def test_only_the_owner_deforms(world, pad):
    """Another source, an unknown id and a rigid geometry are refused, naming who is meant."""
    context = world.scene_graph.create_default_context()
    q_WG = context.configuration(pad)
    with pytest.raises(OwnershipError, match=r"'pad'.*'arm': 'other' cannot deform"):
        context.set_configurations(world.other, {pad: q_WG})
    with pytest.raises(DeformableError, match=r"'ball'.*rigid"):
        context.set_configurations(world.arm, {world.ball1: q_WG})
    with pytest.raises(UnknownIdError):
        context.set_configurations(world.arm, {GeometryId.get_new_id(): q_WG})
    with pytest.raises(TypeError, match="must map"):
        context.set_configurations(world.arm, q_WG)
    with pytest.raises(DeformableError, match=r"'ball'.*rigid"):
        context.configuration(world.ball1)


@settings(max_examples=60, deadline=None)
@given(
    data=st.data(),
    shape=st.sampled_from([(4, 3), (12,), (3, 4), (5, 3), (4, 4), (0,), (1, 4, 3)]),
)
def test_any_array_is_taken_whole_or_refused(data, shape):
    """Whatever numbers: finite ones of the right shape are there after, else nothing changed."""
    graph = SceneGraph()
    source = graph.register_source("s")
    mesh = VolumeMesh(TETRAHEDRON, [[0, 1, 2, 3]])
    soft = graph.register_deformable_geometry(source, WORLD, soft_instance(), reference_mesh=mesh)
    context = graph.create_default_context()
    value = data.draw(arrays.arrays(np.float64, shape))
    is_good = shape in ((4, 3), (12,)) and bool((np.abs(value) <= 1e12).all())
    snapshot = context.snapshot
    if is_good:
        context.set_configurations(source, {soft: value})
        assert np.array_equal(context.configuration(soft), value.reshape(4, 3))
        assert np.array_equal(snapshot.configuration(soft).q_WG, TETRAHEDRON)
    else:
        with pytest.raises(InvalidConfigurationError, match="q_WG of geometry 'pad'"):
            context.set_configurations(source, {soft: value})
        assert context.snapshot is snapshot
