"""Compliant and deformable geometry in scene files: what becomes of it, and where mistakes are."""

import subprocess
import sys
import textwrap

import numpy as np
import pytest

from scene_graph_ros.check import main
from scene_graph_ros.geometry import Role, SceneGraph
from scene_graph_ros.scene_files import load_scene, load_scene_text, SceneFileError

SCENE = """\
version: 1
sources:
  - {name: s}
  - {name: soft, configurations: {topic: sim/vertices}}
geometries:
  - name: pad
    source: s
    shape: {type: box, size: [0.2, 0.2, 0.2]}
    roles:
      proximity:
        hydroelastic: {compliance_type: compliant, hydroelastic_modulus: 100000, margin: 0.001}
        material: {static_friction: 1, dynamic_friction: 1}
  - name: sponge
    source: soft
    pose: {xyz: [1, 2, 3]}
    shape: {type: box, size: [0.4, 0.2, 0.2]}
    deformable: {resolution_hint: 0.1}
"""

VTK = """# vtk DataFile Version 3.0
one tetrahedron
ASCII
DATASET UNSTRUCTURED_GRID
POINTS 4 double
0 0 0  1 0 0  0 1 0  0 0 1
CELLS 1 5
4 0 1 2 3
CELL_TYPES 1
10
"""

INNER = "v 0.1 0.1 0.1\nv 0.3 0.1 0.1\nv 0.1 0.3 0.1\nv 0.1 0.1 0.3\n"
FACES = "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"


def apply(text, **options):
    """Register a scene given as text; return the inspector and what was loaded."""
    scene_graph = SceneGraph()
    loaded = load_scene_text(text, label="f").apply(scene_graph, **options)
    return scene_graph.model_inspector(), loaded


def problem(text):
    """Return the message with which a scene is refused, and check that nothing is left of it."""
    scene_graph = SceneGraph()
    with pytest.raises(SceneFileError) as caught:
        load_scene_text(textwrap.dedent(text), label="f").apply(scene_graph)
    assert scene_graph.model_inspector().num_geometries() == 0
    return str(caught.value)


def test_hydroelastic_properties_arrive_as_the_core_wants_them():
    """Group, name and value; whole numbers become floats."""
    inspector, loaded = apply(SCENE)
    properties = inspector.get_proximity_properties(loaded.geometries["s/world/pad"])
    assert properties.get_property("hydroelastic", "compliance_type") == "compliant"
    assert properties.get_property("hydroelastic", "hydroelastic_modulus", float) == 1e5
    assert properties.get_property("hydroelastic", "margin", float) == 1e-3
    assert properties.get_property("material", "dynamic_friction", float) == 1.0


def test_a_deformable_geometry_is_in_the_world_and_has_a_mesh():
    """It is at its pose, filled with tetrahedra about as large as wanted, with both roles."""
    inspector, loaded = apply(SCENE)
    sponge = loaded.geometries["soft/world/sponge"]
    assert inspector.is_deformable(sponge)
    assert not inspector.is_deformable(loaded.geometries["s/world/pad"])
    mesh = inspector.get_reference_mesh(sponge)
    assert mesh.volumes().sum() == pytest.approx(0.4 * 0.2 * 0.2, rel=1e-12)
    assert len(mesh.tetrahedra) >= 4 * 2 * 2
    assert inspector.get_properties(sponge, Role.ILLUSTRATION) is not None
    assert loaded.sources["soft"].configuration_topic == "sim/vertices"
    assert loaded.sources["s"].configuration_topic == ""
    # Nothing of this source moves by poses.
    assert loaded.sources["soft"].pose_type == ""


def test_a_file_of_tetrahedra_is_taken_as_it_is(tmp_path):
    """And a role may embed a finer surface, found beside the scene."""
    (tmp_path / "body.vtk").write_text(VTK)
    (tmp_path / "skin.obj").write_text(INNER + FACES)
    (tmp_path / "scene.yaml").write_text(
        "version: 1\n"
        "sources: [{name: s}]\n"
        "geometries:\n"
        "  - name: body\n"
        "    source: s\n"
        "    shape: {type: mesh, file: body.vtk}\n"
        "    deformable: {}\n"
        "    roles: {proximity: {}, illustration: {deformable: {embedded_mesh: skin.obj}}}\n"
    )
    scene_graph = SceneGraph()
    loaded = load_scene(tmp_path / "scene.yaml").apply(scene_graph)
    inspector = scene_graph.model_inspector()
    body = loaded.geometries["s/world/body"]
    np.testing.assert_array_equal(inspector.get_reference_mesh(body).tetrahedra, [[0, 1, 2, 3]])
    (skin,) = inspector.get_driven_meshes(body, Role.ILLUSTRATION)
    assert skin.vertices.max() == 0.3
    (boundary,) = inspector.get_driven_meshes(body, Role.PROXIMITY)
    assert boundary.vertices.max() == 1.0


def geometry(lines, frames=""):
    """Return a scene with one geometry."""
    return (
        "version: 1\nsources: [{name: s}]\n"
        + frames
        + "geometries:\n  - name: g\n    source: s\n"
        + textwrap.indent(textwrap.dedent(lines), "    ")
    )


BOX = "shape: {type: box, size: [1, 1, 1]}\n"
SPHERE = "shape: {type: sphere, radius: 1}\n"


@pytest.mark.parametrize(
    ("text", "places", "words"),
    [
        (
            geometry(
                BOX + "roles:\n  proximity:\n    hydroelastic: {compliance_type: compliant}\n"
            ),
            "f:9: geometries[0].roles.proximity.hydroelastic: ",
            "'hydroelastic_modulus') of geometry 'g' is missing",
        ),
        (
            geometry(BOX + "roles:\n  proximity:\n    hydroelastic: {compliance_type: soft}\n"),
            "f:9: geometries[0].roles.proximity.hydroelastic: ",
            "'soft'",
        ),
        (
            geometry(SPHERE + "roles: {proximity: {hydroelastic: {compliance_type: rigid}}}\n"),
            "f:7: geometries[0].roles.proximity.hydroelastic: ",
            "'resolution_hint') of geometry 'g' is missing",
        ),
        (
            geometry(
                "shape: {type: half_space}\n"
                "roles: {proximity: {hydroelastic: {compliance_type: compliant,"
                " hydroelastic_modulus: 1e5}}}\n"
            ),
            "f:7: geometries[0].roles.proximity.hydroelastic: ",
            "'slab_thickness')",
        ),
        (
            geometry(
                "shape: {type: mesh, vertices: [[0,0,0],[1,0,0],[0,1,0]], faces: [[0,1,2]]}\n"
                "roles: {proximity: {mesh: {representation: triangles}, hydroelastic:"
                " {compliance_type: compliant, hydroelastic_modulus: 1e5}}}\n"
            ),
            "f:7: geometries[0].roles.proximity.hydroelastic: ",
            "",
        ),
        (
            geometry(SPHERE + "deformable: {}\n"),
            "f:7: geometries[0].deformable: ",
            "resolution_hint",
        ),
        (
            geometry("shape: {type: half_space}\ndeformable: {}\n"),
            "f:7: geometries[0].deformable: ",
            "half space",
        ),
        (
            geometry(
                BOX + "deformable: {}\nroles:\n  illustration:\n"
                "    deformable: {embedded_mesh: no.obj}\n"
            ),
            "f:10: geometries[0].roles.illustration.deformable: ",
            "'no.obj': no such file",
        ),
    ],
)
def test_what_is_refused_names_its_place(text, places, words):
    """The message begins with file, line and path, says what is wrong, and nothing is left."""
    message = problem(text)
    assert message.startswith(places), message
    assert words in message


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            geometry(BOX + "deformable: {resolution_hint: 0}\n"),
            "f:7: geometries[0].deformable.resolution_hint: must be positive, got 0",
        ),
        (
            geometry(BOX + "deformable: {hint: 1}\n"),
            "f:7: geometries[0].deformable.hint: unknown key",
        ),
        (
            geometry(BOX + "frame: f\ndeformable: {}\n", "frames: [{name: f, source: s}]\n"),
            "f:8: geometries[0].frame: deformable geometry is in the world, not on a frame;"
            " got 'f'",
        ),
        (
            "version: 1\nsources: [{name: s, configurations: {}}]\n",
            "f:2: sources[0].configurations.topic: missing",
        ),
    ],
)
def test_the_schema_knows_deformables(text, message):
    """What the file alone can tell is wrong before anything is registered."""
    with pytest.raises(SceneFileError) as caught:
        load_scene_text(text, label="f")
    assert str(caught.value) == message


def test_a_robot_can_be_compliant(tmp_path):
    """Properties of all its collision geometry; what they lack is named at the robot."""
    (tmp_path / "r.urdf").write_text(
        '<robot name="r"><link name="a"><collision><geometry><box size="1 1 1"/></geometry>'
        "</collision></link></robot>"
    )
    text = "version: 1\nrobots:\n  - name: r\n    urdf: r.urdf\n    proximity:\n      {}\n"
    good = "hydroelastic: {compliance_type: compliant, hydroelastic_modulus: 1e6}"
    (tmp_path / "good.yaml").write_text(text.format(good))
    scene_graph = SceneGraph()
    load_scene(tmp_path / "good.yaml").apply(scene_graph)
    inspector = scene_graph.model_inspector()
    (solid,) = inspector.get_all_geometry_ids(Role.PROXIMITY)
    assert inspector.get_proximity_properties(solid).has_group("hydroelastic")
    (tmp_path / "bad.yaml").write_text(text.format("hydroelastic: {compliance_type: compliant}"))
    with pytest.raises(SceneFileError, match="hydroelastic_modulus"):
        load_scene(tmp_path / "bad.yaml").apply(SceneGraph())


def test_the_check_counts_them(capsys, tmp_path):
    """The command says how many geometries are compliant, and how many deformable."""
    (tmp_path / "soft.yaml").write_text(SCENE)
    assert main([str(tmp_path / "soft.yaml")]) == 0
    printed = capsys.readouterr().out
    assert "2 with proximity role, 1 of them compliant, 1 of them deformable" in printed


def test_a_scene_without_them_imports_nothing_of_it():
    """Neither the code of contact surfaces, nor volume meshes, nor their readers."""
    text = geometry(BOX)
    program = (
        "import sys\n"
        "from scene_graph_ros.geometry import SceneGraph\n"
        "from scene_graph_ros.scene_files import load_scene_text\n"
        f"load_scene_text({text!r}).apply(SceneGraph())\n"
        "core = 'scene_graph_ros.geometry.'\n"
        "unwanted = [m for m in sys.modules if m.startswith((core + 'hydroelastic',\n"
        "    core + 'deformable', core + 'meshes.volume', core + 'meshes.tessellate', 'meshio',\n"
        "    'pytetwild'))]\n"
        "sys.exit(', '.join(unwanted) or None)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr


SEEN = """
version: 1
sources:
  - {name: camera, points: {topic: depth/points, geometry: %s}}
geometries:
  - {name: seen, source: camera, shape: {type: point_cloud, radius: 0.1}}
"""


def test_a_source_says_where_its_points_come_from():
    """The topic, and which of its clouds they are; one that is not there is found in the file."""
    _, loaded = apply(SEEN % "seen")
    camera = loaded.sources["camera"]
    assert (camera.points_topic, camera.cloud, camera.pose_type) == ("depth/points", "seen", "")
    said = problem(SEEN % "sean")
    assert "f:4" in said
    assert "source 'camera' has no point_cloud 'sean'" in said
    assert "seen" in said


LOOKING = """
version: 1
sources:
  - name: camera
    depth: {image: ~/eye/depth/image, %s}
  - {name: arm}
frames:
  - {name: wrist, source: camera}
geometries:
  - {name: seen, source: camera, shape: {type: point_cloud, radius: 0.1}}
  - {name: more, source: camera, frame: wrist, shape: {type: point_cloud, radius: 0.1}}
"""


def test_a_source_says_how_its_images_of_depth_are_read():
    """Topics, lens, frame, which pixels are points, and what is left of them; a prefix counts."""
    said = (
        "geometry: seen, frame: arm/hand, pose: {xyz: [1, 2, 3]}, rectified: true, rate: 5,"
        " step: 3, range: [0.2, 4], remove: [arm], padding: 0.01, shadow: 4, margin: 0.05,"
        " expires: 20, region: {lower: [-1, -2, -3], upper: [1, 2, 3]}, floor: 0.5"
    )
    _, loaded = apply(LOOKING % said, prefix="left_")
    camera = loaded.sources["left_camera"]
    depth = camera.sensor
    assert (depth.image_topic, depth.info_topic) == (
        "~/eye/depth/image", "~/eye/depth/camera_info"
    )  # fmt: skip
    assert (camera.cloud, depth.frame, depth.is_rectified) == ("seen", "left_arm/hand", True)
    assert depth.X_FS[:3, 3].tolist() == [1.0, 2.0, 3.0]
    assert (depth.rate, depth.step, depth.near, depth.far) == (5.0, 3, 0.2, 4.0)
    assert (depth.remove, depth.padding, depth.shadow) == (("left_arm",), 0.01, 4)
    assert (depth.margin, depth.expires) == (0.05, 20.0)
    assert (depth.lower, depth.upper) == ((-1.0, -2.0, 0.5), (1.0, 2.0, 3.0))
    _, loaded = apply(LOOKING % "geometry: seen, info: eye/lens")
    depth = loaded.sources["camera"].sensor
    assert (depth.info_topic, depth.frame, depth.remove) == ("eye/lens", "", None)
    assert (depth.expires, depth.lower, depth.upper[0]) == (0.0, (-np.inf,) * 3, np.inf)
    assert loaded.sources["arm"].sensor is None


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ("geometry: sean", "no point_cloud 'sean'"),
        ("geometry: more", "'more' is on frame 'wrist'"),
        ("geometry: seen, remove: [arn]", "no source 'arn'"),
        ("geometry: seen, range: [2, 1]", "2 must be less than 1"),
        ("geometry: seen, step: 0", "step: must be at least 1, got 0"),
        ("geometry: seen, pose: {xyz: [0, 0, 1]}", "pose needs the frame"),
        ("geometry: seen, region: {lower: [0, 0, 0], upper: [1, 0, 1]}", "on each axis"),
        ("geometry: seen, expires: 0", "expires: must be positive, got 0"),
        ("geometry: seen, voxel: 1", "unknown key"),
    ],
)
def test_settings_of_images_that_cannot_be_are_found_in_the_file(settings, said):
    """With the line, and a name that may be meant."""
    found = problem(LOOKING % settings)
    assert "f:5" in found
    assert said in found


SENSING = """
version: 1
sources:
  - name: lidar
    points: {%s}
  - {name: camera}
geometries:
  - {name: seen, source: lidar, shape: {type: point_cloud, radius: 0.1}}
  - {name: moving, source: camera, frame: wrist, shape: {type: point_cloud, radius: 0.1}}
frames:
  - {name: wrist, source: camera}
"""


def test_a_source_says_how_its_clouds_are_read():
    """As images of depth; without more each message has all points of its sensor."""
    _, loaded = apply(SENSING % "remember: true, rate: 5, floor: 1, fills: lidar", prefix="a_")
    its = loaded.sources["a_lidar"].sensor
    assert (its.remembers, its.rate, its.fills, its.has_radii) == (True, 5.0, "a_lidar", False)
    assert (its.near, its.far, its.padding, its.lower[2]) == (0.0, np.inf, 0.02, 1.0)
    _, loaded = apply(SENSING % "")
    its = loaded.sources["lidar"].sensor
    assert (its.remembers, its.rate, its.fills, its.remove) == (False, np.inf, "", None)
    assert loaded.sources["camera"].sensor is None


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ("fills: camara", "no source 'camara'"),
        ("fills: camera, geometry: seen", "geometry is named by the source that is filled"),
        ("fills: camera", "'moving' is on frame 'wrist'"),
        ("range: [3, 1]", "3 must be less than 1"),
        ("step: 2", "unknown key"),
    ],
)
def test_settings_of_clouds_that_cannot_be_are_found_in_the_file(settings, said):
    """With the line, and a name that may be meant."""
    found = problem(SENSING % settings)
    assert "f:5" in found
    assert said in found


def test_points_and_images_fill_one_cloud_only_one_way():
    """A source that says both is refused."""
    text = LOOKING % "geometry: seen"
    both = text.replace("  - name: camera\n", "  - name: camera\n    points: {topic: p}\n")
    assert "give points or depth" in problem(both)
