"""The table of bodies: kinds, sharing, layout, trees, and what is refused."""

import numpy as np
import pytest

from scene_graph_ros.geometry import (
    add_compliant_hydroelastic_properties,
    add_rigid_hydroelastic_properties,
    Box,
    Capsule,
    Convex,
    Cylinder,
    Ellipsoid,
    GeometryFrame,
    GeometryInstance,
    HalfSpace,
    Mesh,
    ProximityProperties,
    RoleAssign,
    SceneGraph,
    Sphere,
)
from scene_graph_ros.geometry.errors import MeshError, PropertyError
from scene_graph_ros.geometry.hydroelastic.body_table import (
    body_table,
    BodyKind,
    build_body_table,
)
from scene_graph_ros.geometry.meshes.tessellate import tessellate_surface
from scene_graph_ros.geometry.model.contact_properties import (
    add_compliant_hydroelastic_properties_for_half_space,
)

MODULUS = 1e6
VERTICES, FACES = tessellate_surface(Box(1.0, 1.0, 1.0))
SHAPES = [
    Sphere(0.2),
    Capsule(0.1, 0.2),
    Box(0.1, 0.2, 0.3),
    Cylinder(0.1, 0.2),
    Ellipsoid(0.1, 0.2, 0.3),
    Convex(vertices=VERTICES),
    Mesh(vertices=VERTICES, faces=FACES),
]


def _rigid(hint=0.1):
    properties = ProximityProperties()
    add_rigid_hydroelastic_properties(properties, hint)
    return properties


def _compliant(hint=0.1, margin=None, modulus=MODULUS):
    properties = ProximityProperties()
    add_compliant_hydroelastic_properties(properties, hint, modulus, margin=margin)
    return properties


def _slab(margin=None):
    properties = ProximityProperties()
    add_compliant_hydroelastic_properties_for_half_space(properties, 0.5, MODULUS, margin=margin)
    return properties


def _rows(table, body):
    return slice(table.element_start[body], table.element_start[body + 1])


def test_kinds_and_sharing():
    """A row says what its geometry is; equal shapes with equal properties share one body."""
    shapes = [
        Sphere(0.2),
        Sphere(0.2),
        Sphere(0.2),
        HalfSpace(),
        HalfSpace(),
        Sphere(0.3),
        Sphere(0.2),
    ]
    properties = [_rigid(), _compliant(), ProximityProperties(), _slab(0.01), _rigid(),
                  _compliant(), _compliant()]  # fmt: skip
    table = build_body_table(shapes, properties)
    assert table.kind.tolist() == [
        BodyKind.RIGID_SURFACE,
        BodyKind.COMPLIANT_VOLUME,
        BodyKind.NONE,
        BodyKind.COMPLIANT_HALF_SPACE,
        BodyKind.RIGID_HALF_SPACE,
        BodyKind.COMPLIANT_VOLUME,
        BodyKind.COMPLIANT_VOLUME,
    ]
    assert table.body.tolist() == [0, 1, -1, 2, 3, 4, 1]
    assert table.margin.tolist() == [0.0, 0.0, 0.0, 0.01, 0.0, 0.0, 0.0]


@pytest.mark.parametrize("shapes", [[], SHAPES, [HalfSpace()]], ids=["none", "all", "plane"])
@pytest.mark.parametrize("properties", [_rigid, _compliant, ProximityProperties])
def test_layout_is_the_same_whatever_is_in_it(shapes, properties):
    """Types, contiguity and writability, on which the kernels' signature depends, never vary."""
    if shapes == [HalfSpace()] and properties is _compliant:
        properties = _slab
    table = build_body_table(shapes, [properties() for _ in shapes])
    expected = {
        "kind": (np.int32, 1), "body": (np.int64, 1), "margin": (np.float64, 1),
        "element_start": (np.int64, 1), "elements": (np.int64, 2), "vertex_start": (np.int64, 1),
        "vertices": (np.float64, 2), "pressure": (np.float64, 1), "gradient_G": (np.float64, 2),
        "constant": (np.float64, 1), "normals": (np.float64, 2), "node_start": (np.int64, 1),
        "node_lower": (np.float64, 2), "node_upper": (np.float64, 2), "node_left": (np.int64, 1),
        "node_right": (np.int64, 1), "order": (np.int64, 1),
    }  # fmt: skip
    assert list(expected) == list(table._fields)
    for name, array in table._asdict().items():
        assert (array.dtype, array.ndim) == expected[name], name
        assert array.flags.c_contiguous and array.flags.writeable, name


@pytest.mark.parametrize("shape", SHAPES, ids=repr)
def test_field_takes_the_pressure_at_every_corner(shape):
    """The field is 0 on the surface and E at the deepest, in all tetrahedra."""
    table = build_body_table([Sphere(0.05), shape], [_compliant(), _compliant()])
    rows = _rows(table, 1)
    elements = table.elements[rows]
    assert elements.min() == table.vertex_start[1] and elements.max() == len(table.vertices) - 1
    values = np.einsum("ekj,ej->ek", table.vertices[elements], table.gradient_G[rows])
    values += table.constant[rows, None]
    assert np.abs(values - table.pressure[elements]).max() <= 1e-9 * MODULUS
    assert table.pressure[table.vertex_start[1] :].max() == MODULUS
    assert (table.normals[rows] == 0.0).all()


@pytest.mark.parametrize("shape", SHAPES, ids=repr)
def test_rigid_bodies_have_outward_normals_and_no_field(shape):
    """The triangles are those of the surface, the fourth index is -1."""
    table = build_body_table([shape], [_rigid()])
    assert (table.elements[:, 3] == -1).all()
    triangles = table.vertices[table.elements[:, :3]]
    middle = triangles.mean(axis=1)
    # All these shapes contain the origin and are convex.
    assert (np.einsum("ij,ij->i", middle, table.normals) > 0.0).all()
    assert np.abs(np.linalg.norm(table.normals, axis=1) - 1.0).max() <= 1e-15
    edges = np.diff(triangles, axis=1)
    assert np.abs(np.einsum("ekj,ej->ek", edges, table.normals)).max() <= 1e-15
    assert not table.pressure.any() and not table.gradient_G.any() and not table.constant.any()


def test_half_spaces():
    """A rigid one has nothing; a compliant one has one element with the slab's field."""
    table = build_body_table([HalfSpace(), HalfSpace()], [_rigid(), _slab()])
    assert table.element_start.tolist() == [0, 0, 1]
    assert table.elements.tolist() == [[-1, -1, -1, -1]]
    assert table.gradient_G.tolist() == [[0.0, 0.0, -MODULUS / 0.5]]
    assert table.constant.tolist() == [0.0]
    assert len(table.vertices) == 0 and len(table.node_left) == 0


@pytest.mark.parametrize("properties", [_rigid, _compliant])
def test_tree_holds_every_element_once_in_boxes_that_hold_it(properties):
    """Walking a body's tree from its root meets each element in one leaf, inside all its boxes."""
    table = build_body_table([Box(1.0, 2.0, 3.0), Capsule(0.2, 0.5)], [properties()] * 2)
    first_node, last_node = table.node_start[1:3]
    elements = table.elements[_rows(table, 1)]
    order = table.order[_rows(table, 1)]
    found, stack = [], [0]
    while stack:
        node = stack.pop()
        row = first_node + node
        assert row < last_node
        left, right = table.node_left[row], table.node_right[row]
        if left < 0:
            inside = order[-1 - left : -1 - left + right]
            found += inside.tolist()
            corners = elements[inside]
            points = table.vertices[corners[corners >= 0]]
            assert (points >= table.node_lower[row]).all()
            assert (points <= table.node_upper[row]).all()
            continue
        for child in (left, right):
            assert (table.node_lower[first_node + child] >= table.node_lower[row]).all()
            assert (table.node_upper[first_node + child] <= table.node_upper[row]).all()
            stack.append(child)
    assert sorted(found) == list(range(len(elements)))


def test_margin_and_modulus_scale_what_they_should():
    """Twice the modulus is twice the pressure; a margin's outer pressure is -E margin / depth."""
    soft, hard, thick = (
        build_body_table([Sphere(0.2)], [p])
        for p in (_compliant(), _compliant(modulus=2.0 * MODULUS), _compliant(margin=0.01))
    )
    assert (hard.gradient_G == 2.0 * soft.gradient_G).all()
    assert (hard.vertices == soft.vertices).all()
    assert thick.pressure.min() == pytest.approx(-MODULUS * 0.01 / 0.2, rel=1e-12)
    assert np.linalg.norm(thick.vertices, axis=1).max() == pytest.approx(0.21, rel=1e-12)
    assert thick.gradient_G == pytest.approx(soft.gradient_G, rel=1e-9, abs=1e-3)


def test_what_cannot_be_built_is_refused_by_name():
    """The message names the geometry, and the reason."""
    open_mesh = Mesh(vertices=VERTICES, faces=FACES[1:])
    for shape, words in ((Sphere(0.0), "is a point"), (open_mesh, "not closed")):
        with pytest.raises(MeshError, match=f"(?s)geometry 'pad'.*{words}"):
            build_body_table([shape], [_compliant()], ["pad"])
    with pytest.raises(MeshError, match="geometry 'pad': resolution_hint 1e-06 m"):
        build_body_table([Sphere(1.0)], [_compliant(1e-6)], ["pad"])
    with pytest.raises(PropertyError, match=r"'slab_thickness'.*'floor' is missing"):
        build_body_table([HalfSpace()], [_compliant()], ["floor"])


class TestInAModel:
    """The table of a model is built once, and again when shapes or properties change."""

    def _scene(self):
        scene_graph = SceneGraph()
        source = scene_graph.register_source("robot")
        frame = scene_graph.register_frame(source, GeometryFrame("hand"))
        ids = []
        for k, properties in enumerate([_compliant(), ProximityProperties(), _rigid()]):
            instance = GeometryInstance(np.eye(4), Sphere(0.1 + 0.1 * k), f"ball_{k}")
            ids.append(scene_graph.register_geometry(source, frame, instance))
            scene_graph.assign_role(source, ids[-1], properties)
        return scene_graph, source, ids

    def test_rows_are_those_of_the_proximity_arrays(self):
        """A geometry without hydroelastic properties has a row, of kind NONE."""
        scene_graph, _, _ = self._scene()
        state = scene_graph.create_default_context().state
        table = body_table(state)
        assert table.kind.tolist() == [2, 0, 1]
        assert body_table(state) is table

    def test_new_properties_make_a_new_table(self):
        """The context that is left alone keeps its own."""
        scene_graph, source, ids = self._scene()
        context = scene_graph.create_default_context()
        before = body_table(context.state)
        scene_graph.assign_role(source, ids[1], _compliant(), RoleAssign.REPLACE, context=context)
        assert body_table(context.state).kind.tolist() == [2, 2, 1]
        assert before.kind.tolist() == [2, 0, 1]

    def test_incomplete_properties_are_refused_with_the_role(self):
        """The message names geometry and property, and the geometry has no role afterwards."""
        scene_graph, source, _ = self._scene()
        instance = GeometryInstance(np.eye(4), HalfSpace(), "floor")
        floor = scene_graph.register_anchored_geometry(source, instance)
        with pytest.raises(PropertyError, match=r"'slab_thickness'.*'floor' is missing"):
            scene_graph.assign_role(source, floor, _compliant())
        assert scene_graph.model_inspector().get_proximity_properties(floor) is None
