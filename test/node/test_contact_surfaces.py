"""Contact surfaces over DDS: in the contacts, as triangles and a cloud, by service, on demand."""

from __future__ import annotations

from diagnostic_msgs.msg import DiagnosticArray
from node_harness import diagnostics_from_now, diagnostics_values, wait_until
import numpy as np
import pytest
from rcl_interfaces.msg import Parameter as ParameterMessage
from rcl_interfaces.msg import ParameterType, ParameterValue
from rcl_interfaces.srv import SetParametersAtomically
from scene_requests import pose, reference, transform, what_if
from sensor_msgs.msg import MultiDOFJointState, PointCloud2
from visualization_msgs.msg import Marker, MarkerArray

from msg_adapters.contact_surface_markers import pressure_namespace
from msg_adapters.contact_surfaces import face_points_from_msg, surface_arrays_from_msg
from scene_graph_msgs.msg import (
    ContactArray,
    GeometryDescription,
    Property,
    QueryOptions,
    RoleProperties,
    Shape,
    Status,
)
import scene_graph_msgs.srv as srv
from scene_graph_ros.geometry import SceneGraph
from scene_graph_ros.scene_files import load_scene_text
from scene_graph_ros.views.surfaces import pressure_colors

MODULUS = 1e5
"""Pa, reached in the box 0.1 m below its faces."""

DEPTH = 0.01
"""m, of the box in the floor."""

SCENE = f"""
version: 1
sources: [{{name: cell}}, {{name: gripper}}]
frames:
  - {{name: pad, source: gripper, pose: {{xyz: [0.5, 0, {0.2 - DEPTH}]}}}}
  - {{name: ball, source: gripper, pose: {{xyz: [3, 0, 0.09]}}}}
geometries:
  - name: floor
    source: cell
    shape: {{type: half_space}}
    roles: {{proximity: {{hydroelastic: {{compliance_type: rigid}}}}}}
  - name: pad
    source: gripper
    frame: pad
    shape: {{type: box, size: [0.2, 0.3, 0.4]}}
    roles:
      proximity:
        hydroelastic: {{compliance_type: compliant, hydroelastic_modulus: {MODULUS}}}
        material: {{hunt_crossley_dissipation: 0.5}}
  - {{name: ball, source: gripper, frame: ball, shape: {{type: sphere, radius: 0.1}}}}
"""

FORCE = MODULUS / 0.1 * (0.2 * 0.3 * DEPTH - (0.2 + 0.3) * DEPTH**2 + 4 / 3 * DEPTH**3)
"""N. Pressure is modulus / 0.1 m times the distance to the nearest face. On the floor that is the
depth, except within DEPTH of the sides: the integral of min(DEPTH, distance to the sides) over the
rectangle is that of the area (a - 2 t)(b - 2 t) over t from 0 to DEPTH."""


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    """A compliant box 1 cm deep in a rigid floor, and a ball without properties as deep in it."""
    path = tmp_path_factory.mktemp("scene") / "pad.yaml"
    path.write_text(SCENE)
    return path


@pytest.fixture(scope="module")
def node(start_node, scene):
    """A node with that scene."""
    return start_node({"scene": scene, "pressure_scale": 2e4, "diagnostics_rate": 20.0})


@pytest.fixture(scope="module")
def core():
    """What the core says about the same scene."""
    scene_graph = SceneGraph()
    loaded = load_scene_text(SCENE).apply(scene_graph)
    context = scene_graph.create_default_context()
    loaded.set_initial_poses(context)
    return scene_graph.query_object(context)


def test_the_box_presses_on_the_floor_as_hard_as_it_should(client, node):
    """In ~/contacts the pair with properties is a surface with the force of a closed form."""
    contacts = client.listen(ContactArray, "contacts")
    message = contacts.wait_for(lambda m: len(m.surfaces) == 1, "the surface")
    (surface,) = message.surfaces
    assert surface.geometry_a.name == "floor"
    assert surface.geometry_b.name == "pad"
    # The floor is A: B, the box, pushes it down.
    assert surface.wrench.force.z == pytest.approx(-FORCE, rel=1e-12)
    assert surface.wrench.force.x == pytest.approx(0.0, abs=1e-9)
    assert surface.area == pytest.approx(0.06, rel=1e-12)
    assert surface.pressure == pytest.approx(FORCE / 0.06, rel=1e-12)
    assert surface.pressure_max == pytest.approx(MODULUS * DEPTH / 0.1, rel=1e-12)
    assert surface.traction.z == pytest.approx(-FORCE / 0.06, rel=1e-12)
    assert surface.normal.z == pytest.approx(-1.0, abs=1e-12)
    assert surface.centroid.x == pytest.approx(0.5, abs=1e-12)
    assert surface.centroid.z == pytest.approx(0.0, abs=1e-12)
    assert surface.wrench.torque.y == pytest.approx(0.0, abs=1e-9)
    client.forget(contacts)


def test_pairs_without_properties_stay_points(client, node):
    """The ball has none: it touches the floor in a point, 1 cm deep."""
    contacts = client.listen(ContactArray, "contacts")
    message = contacts.wait_for(lambda m: len(m.points) == 1, "the point")
    (point,) = message.points
    assert {point.geometry_a.name, point.geometry_b.name} == {"floor", "ball"}
    assert point.depth == pytest.approx(0.01, abs=1e-12)
    client.forget(contacts)


def test_each_face_is_a_point_of_the_cloud(client, node):
    """Decoded, pressure times area sums to the force, and all normals point into the floor."""
    clouds = client.listen(PointCloud2, "contact_surface_points")
    message = clouds.wait_for(lambda m: m.width > 0, "a cloud")
    faces = face_points_from_msg(message)
    assert message.header.frame_id == "world"
    assert message.width == len(faces)
    assert float((faces["pressure"] * faces["area"]).sum()) == pytest.approx(FORCE, rel=1e-5)
    assert float(faces["area"].sum()) == pytest.approx(0.06, rel=1e-5)
    np.testing.assert_allclose(faces["normal_z"], -1.0, atol=1e-6)
    np.testing.assert_allclose(faces["z"], 0.0, atol=1e-7)
    assert (np.abs(faces["x"] - 0.5) < 0.1).all()
    assert (faces["surface"] == 0).all()
    client.forget(clouds)


def test_triangles_are_coloured_on_the_fixed_scale(client, node, core):
    """Corners are where the core has them, in the colour of their pressure; the name says how."""
    markers = client.listen(MarkerArray, "contact_surface_markers")
    message = markers.wait_for(lambda m: m.markers[0].action == Marker.ADD, "triangles")
    (marker,) = message.markers
    assert marker.type == Marker.TRIANGLE_LIST
    assert marker.ns == "pressure 0 (blue) to 20 kPa (red)" == pressure_namespace(2e4)
    corners = np.array([(p.x, p.y, p.z) for p in marker.points])
    colors = np.array([(c.r, c.g, c.b, c.a) for c in marker.colors])
    a, b, c = corners.reshape(-1, 3, 3).transpose(1, 0, 2)
    area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()
    assert area == pytest.approx(0.06, rel=1e-12)
    # Depth, or distance to the sides where that is less, times modulus per metre.
    inside = np.minimum(0.1 - np.abs(corners[:, 0] - 0.5), 0.15 - np.abs(corners[:, 1]))
    pressure = MODULUS / 0.1 * np.minimum(inside, DEPTH)
    np.testing.assert_allclose(colors, pressure_colors(pressure, 2e4), atol=1e-6)
    # 10 kPa of 20 is green, nothing is blue.
    assert [0, 1, 0, 1] in colors.round(6).tolist()
    assert [0, 0, 1, 1] in colors.round(6).tolist()
    client.forget(markers)


def test_another_scale_takes_the_old_triangles_back(client, node):
    """After a change of the parameter the markers have another name, and the former are gone."""
    markers = client.listen(MarkerArray, "contact_surface_markers")
    markers.wait_for(lambda m: m.markers[-1].ns == pressure_namespace(2e4), "the first scale")

    def set_scale(value):
        parameter = ParameterMessage(
            name="pressure_scale",
            value=ParameterValue(type=ParameterType.PARAMETER_DOUBLE, double_value=value),
        )
        request = SetParametersAtomically.Request(parameters=[parameter])
        name = "/scene_graph/set_parameters_atomically"
        assert client.call_any(SetParametersAtomically, name, request).result.successful

    set_scale(5e6)
    message = markers.wait_for(
        lambda m: m.markers[-1].ns == "pressure 0 (blue) to 5 MPa (red)", "the second scale"
    )
    deleted = [m.ns for m in message.markers if m.action == Marker.DELETE]
    assert deleted == [pressure_namespace(2e4)]
    set_scale(2e4)
    client.forget(markers)


@pytest.mark.parametrize("representation", ["triangle", "polygon"])
def test_the_service_answers_what_the_core_does(client, node, core, representation):
    """Every column is the core's, number by number."""
    surfaces, points = core.compute_contact_surfaces_with_fallback(representation)
    answer = client.call(
        "ComputeContactSurfaces",
        representation=representation,
        with_fallback=True,
        with_gradients=True,
    )
    assert answer.status.code == Status.OK, answer.status
    ((got,),) = surface_arrays_from_msg(answer.table)
    (expected,) = surfaces
    assert answer.table.geometries.name == ["floor", "pad"]
    assert (got.is_compliant_A, got.is_compliant_B) == (False, True)
    force, moment = expected.force_and_moment(expected.centroid_W)
    for ours, theirs in (
        (got.total_area, expected.total_area),
        (got.centroid_W, expected.centroid_W),
        (got.force_W, force),
        (got.moment_W, moment),
        (got.vertices_W, expected.vertices_W),
        (got.pressure, expected.pressure),
        (got.face_normals_W, expected.face_normals_W),
        (got.face_areas, expected.face_areas),
        (got.face_centroids_W, expected.face_centroids_W),
        (got.face_pressures, expected.face_pressures),
        (got.grad_pressure_B_W, expected.grad_pressure_N_W),
    ):
        np.testing.assert_allclose(ours, theirs, rtol=1e-12, atol=1e-12)
    np.testing.assert_array_equal(got.grad_pressure_A_W, 0.0)
    assert [list(face) for face in got.faces] == [list(face) for face in expected.faces]
    assert list(answer.contacts.configuration_start) == [0, 1]
    assert list(answer.contacts.depth) == list(points.depth)
    assert answer.contacts.geometries.name == ["floor", "ball"]


def test_without_fallback_a_pair_without_surface_is_refused(client, node):
    """The status names the pair; so it does for a representation that is none."""
    answer = client.call("ComputeContactSurfaces")
    assert answer.status.code == Status.UNSUPPORTED_PAIR
    assert "ball" in answer.status.message
    answer = client.call("ComputeContactSurfaces", representation="hexagon")
    assert answer.status.code == Status.INVALID_ARGUMENT
    assert "hexagon" in answer.status.message
    answer = client.call("ComputeContactSurfaces", with_faces=False, with_gradients=True)
    assert answer.status.code == Status.INVALID_ARGUMENT


def test_what_if_presses_elsewhere(client, node):
    """Deeper, and not at all: each configuration has its own surfaces; sums alone on request."""
    options = what_if("pad", (0, 0, 0.2 - 2 * DEPTH), (0, 0, 0.3))
    answer = client.call(
        "ComputeContactSurfaces", options=options, with_fallback=True, with_faces=False
    )
    assert answer.status.code == Status.OK, answer.status
    assert list(answer.table.configuration_start) == [0, 1, 1]
    d = 2 * DEPTH
    force = MODULUS / 0.1 * (0.06 * d - 0.5 * d**2 + 4 / 3 * d**3)
    assert answer.table.forces[2] == pytest.approx(-force, rel=1e-12)
    assert list(answer.contacts.configuration_start) == [0, 1, 2]
    assert len(answer.table.vertices) == 0
    (surface,), () = surface_arrays_from_msg(answer.table)
    assert surface.faces == ()


def test_too_many_faces_are_too_many(client, start_node, scene, node):
    """The limit is on faces of the whole answer; sums alone have none."""
    other = start_node(
        {"scene": scene, "max_faces_per_response": 30}, remaps=["__node:=small"]
    )  # fmt: skip
    kind = srv.ComputeContactSurfaces

    def ask(**fields):
        request = kind.Request(with_fallback=True, **fields)
        return client.call_any(kind, "/small/compute_contact_surfaces", request)

    answer = ask()
    assert answer.status.code == Status.TOO_LARGE
    assert "max_faces_per_response" in answer.status.message
    assert ask(with_faces=False).status.code == Status.OK
    assert ask(representation="polygon").status.code == Status.OK
    assert other.stop() == 0


def test_the_force_follows_the_pose(client, node):
    """A pose that lifts the box ends the surface; the markers are taken back."""
    contacts = client.listen(ContactArray, "contacts")
    markers = client.listen(MarkerArray, "contact_surface_markers")
    publisher = client.publisher(MultiDOFJointState, "/gripper/poses")

    def move(z):
        message = MultiDOFJointState(joint_names=["pad"], transforms=[transform(0.5)])
        message.transforms[0].translation.z = z
        message.header.stamp = client.now()
        publisher.publish(message)

    move(0.3)
    contacts.wait_for_newest(lambda m: len(m.surfaces) == 0, "the end of the surface")
    markers.wait_for_newest(lambda m: m.markers[0].action == Marker.DELETE, "the deletion")
    move(0.2 - DEPTH)
    message = contacts.wait_for_newest(lambda m: len(m.surfaces) == 1, "the surface again")
    assert message.surfaces[0].wrench.force.z == pytest.approx(-FORCE, rel=1e-9)
    for listener in (contacts, markers):
        client.forget(listener)


def test_surfaces_nobody_listens_to_are_not_computed(client, node):
    """The effect is on and advertised, but its counters stand still without subscribers."""
    diagnostics = client.listen(DiagnosticArray, "/diagnostics")

    def computed():
        message = diagnostics_from_now(client, diagnostics)
        return int(diagnostics_values(message, "contact_surfaces")["computed"])

    effect = {e.name: e for e in client.call("ListEffects").effects}["contact_surfaces"]
    assert effect.is_on
    assert "1 geometry is compliant" in effect.reason
    publisher = client.publisher(MultiDOFJointState, "/gripper/poses")

    def moves():
        message = MultiDOFJointState(joint_names=["ball"], transforms=[transform(3.0)])
        message.header.stamp = client.now()
        publisher.publish(message)
        stamp = message.header.stamp
        options = QueryOptions(minimal_stamp=stamp)
        options.timeout.sec = 20
        assert client.call("HasCollisions", options=options).status.code == Status.OK

    # A subscription that ended is noticed late.
    wait_until(lambda: computed() == (moves(), computed())[1], "the end of the computing")
    before = computed()
    for _ in range(5):
        moves()
    assert computed() == before
    client.forget(diagnostics)


def test_a_body_that_can_not_be_made_is_refused_at_once(client, node):
    """An open mesh has no volume: registration says so, and the node goes on."""
    source = client.call("RegisterSource", name="late").source
    properties = [
        Property(
            group="hydroelastic",
            name="compliance_type",
            type=Property.STRING,
            strings=["compliant"],
        ),
        Property(
            group="hydroelastic", name="hydroelastic_modulus", type=Property.DOUBLE, doubles=[1e5]
        ),
    ]
    sheet = Shape(kind=Shape.MESH, vertices=[0.0, 0, 0, 1, 0, 0, 0, 1, 0], triangles=[0, 1, 2])
    role = RoleProperties(role=RoleProperties.PROXIMITY, properties=properties)
    description = GeometryDescription(name="sheet", shape=sheet, pose=pose(), roles=[role])
    answer = client.call("RegisterAnchoredGeometry", source=source, geometries=[description])
    assert answer.status.code == Status.INVALID_ARGUMENT, answer.status
    assert len(answer.geometry_ids) == 0
    role.properties = properties[:1]
    answer = client.call("RegisterAnchoredGeometry", source=source, geometries=[description])
    assert answer.status.code == Status.INVALID_ARGUMENT
    assert "hydroelastic_modulus" in answer.status.message


def test_the_effect_comes_and_goes_with_compliant_geometry(client, start_node):
    """Loading a scene turns it on; with ordinary properties the same pair is a point again."""
    other = start_node(remaps=["__node:=other"])
    topics = {"/other/contact_surface_markers", "/other/contact_surface_points"}
    assert not topics & client.topics()

    def call(name, **fields):
        kind = getattr(srv, name)
        words = "".join(f"_{c.lower()}" if c.isupper() else c for c in name).lstrip("_")
        answer = client.call_any(kind, f"/other/{words}", kind.Request(**fields))
        assert answer.status.code == Status.OK, answer.status
        return answer

    gripper = call("LoadScene", text=SCENE).sources[1]
    wait_until(lambda: topics <= client.topics(), "the topics")
    contacts = client.listen(ContactArray, "/other/contacts")
    contacts.wait_for_newest(lambda m: len(m.surfaces) == 1, "the surface")
    call(
        "AssignRole",
        source=gripper,
        geometries=[reference("gripper/pad/pad")],
        role=RoleProperties(role=RoleProperties.PROXIMITY),
        assign=1,
    )
    message = contacts.wait_for_newest(lambda m: len(m.points) == 2, "two points")
    assert len(message.surfaces) == 0
    wait_until(lambda: not topics & client.topics(), "the end of the topics")
    client.forget(contacts)
    assert other.stop() == 0
    assert "Traceback" not in other.output()


def test_a_scene_can_do_without(client, start_node, tmp_path):
    """Switched off by the scene file, the effect is not there, and every pair is a point."""
    (tmp_path / "off.yaml").write_text(SCENE + 'effects: {contact_surfaces: "off"}\n')
    other = start_node({"scene": tmp_path / "off.yaml"}, remaps=["__node:=off"])
    contacts = client.listen(ContactArray, "/off/contacts")
    message = contacts.wait_for(lambda m: len(m.points) == 2, "two points")
    assert len(message.surfaces) == 0
    assert not [topic for topic in client.topics() if topic.startswith("/off/contact_surface")]
    kind = srv.ListEffects
    effects = client.call_any(kind, "/off/list_effects", kind.Request()).effects
    (effect,) = [e for e in effects if e.name == "contact_surfaces"]
    assert not effect.is_on
    assert effect.reason == "switched off by the scene file"
    client.forget(contacts)
    assert other.stop() == 0


def test_the_node_survived_all_of_it(client, node):
    """After all this the node lives, and has no internal error on record."""
    assert node.is_alive()
    assert client.call("HasCollisions").status.code == Status.OK
    assert "Traceback" not in node.output()
