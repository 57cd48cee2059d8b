"""A scene's values of contact, for geometry that has none."""

import numpy as np
import pytest

from scene_graph_ros.geometry import (
    add_compliant_hydroelastic_properties,
    add_contact_material,
    add_rigid_hydroelastic_properties,
    Box,
    DefaultProximityProperties,
    GeometryFrame,
    GeometryInstance,
    HalfSpace,
    PointCloud,
    ProximityProperties,
    RoleAssign,
    SceneGraph,
    SceneGraphConfig,
    Sphere,
)
from scene_graph_ros.geometry.errors import PropertyError
from scene_graph_ros.geometry.property_errors import PropertyValueError

SOFT = DefaultProximityProperties(
    compliance_type="compliant",
    hydroelastic_modulus=2e6,
    resolution_hint=0.05,
    slab_thickness=0.5,
    margin=1e-3,
    dynamic_friction=0.3,
    static_friction=0.4,
    hunt_crossley_dissipation=7,
    relaxation_time=0.1,
    point_stiffness=1e5,
)


def config(**values):
    """Return a configuration with these defaults."""
    return SceneGraphConfig(default_proximity_properties=DefaultProximityProperties(**values))


def scene(shape, properties=None, chosen=None):
    """Return a scene graph with one geometry on a frame, and both ids."""
    graph = SceneGraph(chosen)
    source = graph.register_source("s")
    frame = graph.register_frame(source, GeometryFrame("f"))
    geometry = graph.register_geometry(source, frame, GeometryInstance(np.eye(4), shape, "g"))
    graph.assign_role(source, geometry, properties or ProximityProperties())
    return graph, source, geometry


def value(owner, geometry, group, name):
    """Return a property of the proximity role, None where there is none."""
    properties = owner.get_proximity_properties(geometry)
    return properties.get_property_or_default(group, name, None)


def test_geometry_without_values_gets_all_of_them():
    """Under the names of the helpers."""
    graph, _, geometry = scene(
        Sphere(0.1), chosen=SceneGraphConfig(default_proximity_properties=SOFT)
    )
    expected = ProximityProperties()
    add_compliant_hydroelastic_properties(expected, 0.05, 2e6, margin=1e-3)
    expected.add_property("hydroelastic", "slab_thickness", 0.5)
    add_contact_material(
        expected, dissipation=7.0, point_stiffness=1e5, static_friction=0.4, dynamic_friction=0.3
    )
    expected.add_property("material", "relaxation_time", 0.1)
    assert graph.model_inspector().get_proximity_properties(geometry) == expected


def test_own_values_stay():
    """Each property by itself; of the two frictions one is enough to keep the scene's away."""
    own = ProximityProperties()
    add_rigid_hydroelastic_properties(own, 0.02)
    own.add_property("material", "static_friction", 1.0)
    graph, _, geometry = scene(
        Sphere(0.1), own, SceneGraphConfig(default_proximity_properties=SOFT)
    )
    inspector = graph.model_inspector()
    assert value(inspector, geometry, "hydroelastic", "compliance_type") == "rigid"
    assert value(inspector, geometry, "hydroelastic", "resolution_hint") == 0.02
    assert value(inspector, geometry, "hydroelastic", "hydroelastic_modulus") == 2e6
    assert value(inspector, geometry, "material", "static_friction") == 1.0
    assert value(inspector, geometry, "material", "dynamic_friction") is None
    assert own.get_property_or_default("material", "relaxation_time", None) is None


def test_a_scene_without_defaults_adds_nothing():
    """As before there were any."""
    graph, _, geometry = scene(Sphere(0.1))
    assert graph.get_config() == SceneGraphConfig()
    assert graph.model_inspector().get_proximity_properties(geometry) == ProximityProperties()


def test_surfaces_are_those_of_written_properties():
    """Force and area of a ball on a slab, the slab's and the ball's values from the scene."""
    graph, source, ball = scene(
        Sphere(0.1), chosen=SceneGraphConfig(default_proximity_properties=SOFT)
    )
    rigid = ProximityProperties()
    add_rigid_hydroelastic_properties(rigid)
    ground = GeometryInstance(np.eye(4), HalfSpace(), "ground")
    ground.set_proximity_properties(rigid)
    graph.register_anchored_geometry(source, ground)
    written = ProximityProperties()
    add_compliant_hydroelastic_properties(written, 0.05, 2e6, margin=1e-3)
    tables = []
    for own in (None, written):
        if own is not None:
            graph.set_config(SceneGraphConfig())
            graph.assign_role(source, ball, own, RoleAssign.REPLACE)
        context = graph.create_default_context()
        X_WF = np.eye(4)
        X_WF[2, 3] = 0.09
        context.set_frame_poses(source, X_WF[np.newaxis])
        tables.append(graph.query_object(context).compute_contact_surfaces("polygon"))
    assert len(tables[0]) == len(tables[1]) == 1
    np.testing.assert_array_equal(tables[0].force_W, tables[1].force_W)
    (surface,) = tables[0]
    ours = surface.material_M if surface.id_M == ball else surface.material_N
    assert ours["relaxation_time"] == 0.1


def test_another_configuration_takes_the_place_of_the_one_before():
    """Also for what is there, and its own values stay; contexts that exist keep theirs."""
    graph, _, geometry = scene(Box(1, 1, 1), chosen=config(point_stiffness=1.0))
    context = graph.create_default_context()
    graph.set_config(config(hunt_crossley_dissipation=0.0))
    inspector = graph.model_inspector()
    assert value(inspector, geometry, "material", "point_contact_stiffness") is None
    assert value(inspector, geometry, "material", "hunt_crossley_dissipation") == 0.0
    query = graph.query_object(context)
    assert value(query.inspector(), geometry, "material", "point_contact_stiffness") == 1.0
    assert graph.get_config(context) == config(point_stiffness=1.0)
    graph.set_config(config(point_stiffness=3.0), context=context)
    assert value(query.inspector(), geometry, "material", "point_contact_stiffness") == 3.0
    assert graph.get_config() == config(hunt_crossley_dissipation=0.0)
    copy = graph.clone()
    assert copy.get_config() == graph.get_config()
    graph.set_config(SceneGraphConfig())
    assert inspector.get_proximity_properties(geometry) == ProximityProperties()
    assert value(copy.model_inspector(), geometry, "material", "hunt_crossley_dissipation") == 0.0


def test_another_shape_and_another_role_are_filled_anew():
    """From what the geometry was given, not from what it got."""
    graph, source, geometry = scene(
        Sphere(0.1), chosen=SceneGraphConfig(default_proximity_properties=SOFT)
    )
    inspector = graph.model_inspector()
    graph.change_shape(source, geometry, PointCloud(np.zeros((1, 3)), radius=0.1))
    assert value(inspector, geometry, "hydroelastic", "compliance_type") is None
    assert value(inspector, geometry, "material", "relaxation_time") == 0.1
    graph.change_shape(source, geometry, Box(1, 1, 1))
    assert value(inspector, geometry, "hydroelastic", "compliance_type") == "compliant"
    stiff = ProximityProperties()
    stiff.add_property("material", "point_contact_stiffness", 9.0)
    graph.assign_role(source, geometry, stiff, RoleAssign.REPLACE)
    assert value(inspector, geometry, "material", "point_contact_stiffness") == 9.0
    assert value(inspector, geometry, "hydroelastic", "margin") == 1e-3


def test_deformable_geometry_gets_materials_alone():
    """It has no contact surfaces."""
    graph = SceneGraph(SceneGraphConfig(default_proximity_properties=SOFT))
    source = graph.register_source("s")
    instance = GeometryInstance(np.eye(4), Box(1, 1, 1), "soft")
    instance.set_proximity_properties(ProximityProperties())
    body = graph.register_deformable_geometry(source, graph.world_frame_id(), instance, 1.0)
    inspector = graph.model_inspector()
    assert not inspector.get_proximity_properties(body).has_group("hydroelastic")
    assert value(inspector, body, "material", "static_friction") == 0.4


def test_a_configuration_that_some_geometry_cannot_have_changes_nothing():
    """A compliant ball needs a resolution, which neither it nor the scene has."""
    graph, _, _ = scene(Sphere(0.1))
    with pytest.raises(PropertyError, match="resolution_hint"):
        graph.set_config(config(compliance_type="compliant", hydroelastic_modulus=1e6))
    assert graph.get_config() == SceneGraphConfig()


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"compliance_type": "soft"}, "compliance_type must be of .*, not 'soft'"),
        ({"compliance_type": None}, "compliance_type must be of"),
        ({"hydroelastic_modulus": 0.0}, "hydroelastic_modulus must be finite and positive"),
        ({"resolution_hint": np.nan}, "resolution_hint must be finite and positive, not"),
        ({"slab_thickness": "thick"}, "slab_thickness must be finite and positive"),
        ({"margin": -1e-9}, "margin must be finite and at least 0, not -1e-09"),
        ({"margin": True}, "margin must be finite and at least 0, not True"),
        ({"relaxation_time": np.inf}, "relaxation_time must be finite and at least 0"),
        ({"static_friction": 0.4}, "come together"),
        ({"static_friction": 0.4, "dynamic_friction": 0.5}, "must not exceed static_friction"),
        ({"hunt_crossley_dissipation": -1.0}, "dissipation must be finite and at least 0"),
        ({"point_stiffness": 0.0}, "point_stiffness must be finite and positive"),
    ],
)
def test_values_that_no_geometry_could_have_are_refused(values, message):
    """By name and value."""
    with pytest.raises(PropertyValueError, match=message):
        DefaultProximityProperties(**values)


def test_other_objects_are_refused():
    """In the constructor, by set_config and as defaults."""
    with pytest.raises(PropertyValueError, match="config must be a SceneGraphConfig, not 3"):
        SceneGraph(3)
    graph = SceneGraph()
    for bad in (None, SOFT, {}):
        with pytest.raises(PropertyValueError, match="config must be a SceneGraphConfig"):
            graph.set_config(bad)
    with pytest.raises(PropertyValueError, match="default_proximity_properties must be"):
        SceneGraphConfig(default_proximity_properties={})
