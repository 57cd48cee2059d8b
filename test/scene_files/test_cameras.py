"""Cameras in scene files: what becomes of them, who is seen, and where mistakes are."""

import subprocess
import sys

import numpy as np
from PIL import Image
import pytest

from scene_graph_ros.check import main
from scene_graph_ros.geometry import Rgba, Role, SceneGraph
from scene_graph_ros.geometry.perception import CameraOutput, ExactRenderEngine
from scene_graph_ros.scene_files import load_scene, load_scene_text, SceneFileError

HEAD = """\
version: 1
sources: [{name: cell}, {name: arm}]
frames: [{name: hand, source: arm}]
geometries:
  - {name: plain, source: cell, shape: {type: sphere, radius: 1}}
  - {name: named, source: arm, frame: hand, shape: {type: sphere, radius: 1}, label: 5}
  - {name: hidden, source: cell, shape: {type: sphere, radius: 1}, roles: {proximity: {}}}
  - name: styled
    source: cell
    shape: {type: sphere, radius: 1}
    color: [0.5, 0.25, 0]
    label: 6
    roles: {perception: {label: {id: 7}}}
"""
CAMERA = """\
cameras:
  - name: wrist
    source: arm
    frame: hand
    pose: {xyz: [1, 2, 3]}
    size: [640, 480]
    fov_y: 1.0
"""

URDF = """<robot name="r"><link name="base"><visual><geometry><sphere radius="0.1"/></geometry>
<material name="m"><color rgba="0.1 0.2 0.3 1"/></material></visual></link></robot>"""


def apply(text, **options):
    """Register a scene given as text; return the scene graph and what was loaded."""
    scene_graph = SceneGraph()
    return scene_graph, load_scene_text(text, label="f").apply(scene_graph, **options)


def problems(text):
    """Return the lines with which a scene is refused, and check that nothing is left of it."""
    scene_graph = SceneGraph()
    with pytest.raises(SceneFileError) as caught:
        load_scene_text(text, label="f").apply(scene_graph)
    assert scene_graph.model_inspector().num_sources() == 1  # its own
    assert scene_graph.renderer_count() == 0
    return caught.value.problems


def properties(scene_graph, name):
    """Return the perception properties of a geometry, None where it has no such role."""
    inspector = scene_graph.model_inspector()
    ids = [g for g in inspector.get_all_geometry_ids() if inspector.get_name(g) == name]
    return inspector.get_properties(ids[0], Role.PERCEPTION)


def test_a_camera_is_described_by_names():
    """Frame, pose and lens; what is not said has its default."""
    scene_graph, loaded = apply(HEAD + CAMERA)
    (camera,) = loaded.cameras.values()
    assert (camera.name, camera.source, camera.frame) == ("wrist", "arm", "hand")
    np.testing.assert_array_equal(camera.X_PC[:3, 3], [1, 2, 3])
    assert camera.outputs == {CameraOutput.COLOR, CameraOutput.DEPTH, CameraOutput.LABEL}
    assert camera.rate == 30.0
    core, depth = camera.camera.core, camera.camera.depth_range
    assert (core.intrinsics.width, core.intrinsics.height) == (640, 480)
    # The upper edge of the image is half the angle above its axis.
    assert core.intrinsics.fy == pytest.approx(240.0 / np.tan(0.5), rel=1e-15)
    assert (core.clipping.near, core.clipping.far) == (depth.min_depth, depth.max_depth)
    assert scene_graph.has_renderer(core.renderer_name)


def test_every_field_counts():
    """A lens in pixels, ranges, what is offered and how often."""
    body = CAMERA.replace("fov_y: 1.0", "intrinsics: {fx: 1, fy: 2, cx: 3, cy: -4}")
    more = "    clipping: [0.5, 4]\n    depth_range: [1, 2]\n    images: [points]\n    rate: 5\n"
    _, loaded = apply(HEAD + body + more, prefix="a_")
    (camera,) = loaded.cameras.values()
    assert (camera.name, camera.source, camera.rate) == ("a_wrist", "a_arm", 5.0)
    assert camera.outputs == {CameraOutput.POINTS}
    lens, core = camera.camera.core.intrinsics, camera.camera.core
    assert (lens.fx, lens.fy, lens.cx, lens.cy) == (1.0, 2.0, 3.0, -4.0)
    assert (core.clipping.near, core.clipping.far) == (0.5, 4.0)
    assert (camera.camera.depth_range.min_depth, camera.camera.depth_range.max_depth) == (1, 2)


def test_cameras_see_what_has_no_roles_of_its_own():
    """And what has a label; a label in the properties counts more than one beside them."""
    scene_graph, _ = apply(HEAD + CAMERA)
    assert properties(scene_graph, "hidden") is None
    assert not properties(scene_graph, "plain").has_property("label", "id")
    assert properties(scene_graph, "named").get_property("label", "id") == 5
    styled = properties(scene_graph, "styled")
    assert styled.get_property("label", "id") == 7
    assert styled.get_property("phong", "diffuse") == Rgba(0.5, 0.25, 0)


def test_without_cameras_only_labels_ask_for_the_role():
    """No renderer, no camera."""
    scene_graph, loaded = apply(HEAD)
    assert (loaded.cameras, scene_graph.renderer_count()) == ({}, 0)
    assert properties(scene_graph, "plain") is None
    assert properties(scene_graph, "named") is not None


@pytest.mark.parametrize("body", ["label: 9", "perception: {label: {id: 9}}"])
def test_robots_are_seen_in_their_colours(tmp_path, body):
    """Visual geometry has the role with the label of the robot."""
    (tmp_path / "r.urdf").write_text(URDF)
    robot = f"robots: [{{name: r, urdf: {tmp_path}/r.urdf, {body}}}]\n"
    scene_graph, _ = apply("version: 1\n" + robot)
    inspector = scene_graph.model_inspector()
    (seen,) = inspector.get_all_geometry_ids(Role.PERCEPTION)
    look = inspector.get_properties(seen, Role.PERCEPTION)
    assert look.get_property("label", "id") == 9
    assert look.get_property("phong", "diffuse") == Rgba(0.1, 0.2, 0.3, 1.0)
    assert inspector.get_properties(seen, Role.ILLUSTRATION) is not None


LENS = "fov_y: 1.0"
FOV = "fov_y: 1\n    "


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("name: wrist", "name: wr-ist", "name: the name of a camera must be made of up to"),
        ("name: wrist", "name: 3d", "name: the name of a camera must be made of up to 64"),
        ("source: arm\n    f", "source: arn\n    f", "source: no source or robot 'arn'"),
        ("frame: hand\n", "frame: hnad\n", "frame: source 'arm' has no frame 'hnad'"),
        ("[640, 480]", "[640]", "size: must have at least 2 entries, got 1"),
        ("[640, 480]", "[640, 0]", "size[1]: must be at least 1, got 0"),
        ("[640, 480]", "[640, 4.5]", "size[1]: must be an integer, got 4.5"),
        ("[640, 480]", "[9000, 9000]", "size: CameraIntrinsics: 9000 x 9000 are more than"),
        (LENS, "fov_y: 3.2", "fov_y: must be less than 3.14159, got 3.2"),
        (LENS, "fov_y: 0", "fov_y: must be positive, got 0"),
        (LENS, "rate: 10", "cameras[0]: give fov_y or intrinsics, and only one of them"),
        (LENS, "intrinsics: {fx: 0, fy: 1, cx: 0, cy: 0}", "intrinsics.fx: must be positive"),
        (LENS, "intrinsics: {fx: 1e10, fy: 1, cx: 0, cy: 0}", "intrinsics: CameraIntrinsics: fx"),
        (LENS, FOV + "rate: 0", "rate: must be at least 0.001, got 0"),
        (LENS, FOV + "rate: 1e4", "rate: must be at most 1000, got 10000"),
        (LENS, FOV + "images: []", "images: must have at least 1 entries, got 0"),
        (LENS, FOV + "images: [ir]", "images[0]: must be 'color', 'depth', 'label'"),
        (LENS, FOV + "clipping: [2, 1]", "clipping: ClippingRange: near must be less than far"),
        (LENS, FOV + "clipping: [.nan, 1]", "clipping[0]: must be finite, got nan"),
        (LENS, FOV + "depth_range: [3, 2]", "depth_range: DepthRange: min_depth must be less"),
        (LENS, FOV + "depth_range: [1, 200]", "depth_range: DepthRenderCamera: DepthRange(min"),
        ("xyz: [1, 2, 3]", "quaternion: [0, 0, 0, 2]", "pose: "),
        ("label: 5", "label: 32764", "label: must be at most 32763, got 32764"),
        ("label: {id: 7}", "label: {id: 32766}", "RenderLabel(EMPTY), which no geometry can"),
    ],
)
def test_mistakes_are_named_with_field_and_value(old, new, message):
    """Each is one problem with its line."""
    text = HEAD + CAMERA
    assert old in text
    (problem,) = problems(text.replace(old, new))
    assert problem.startswith("f:")
    assert message in problem


def test_two_cameras_of_a_name_are_refused():
    """The second is named, and the first one's line."""
    (problem,) = problems(HEAD + CAMERA + CAMERA.partition("\n")[2])
    assert problem == "f:21: cameras[1].name: the name 'wrist' is taken by line 15"


def test_the_check_counts_cameras(tmp_path, capsys):
    """With the scene's other contents."""
    path = tmp_path / "scene.yaml"
    path.write_text(HEAD + CAMERA)
    assert main([str(path)]) == 0
    assert capsys.readouterr().out.endswith(", 1 camera\n")


def test_a_scene_without_cameras_imports_nothing_of_them():
    """Not the packages that see, nor the reader of descriptions."""
    code = (
        "import sys\n"
        "from scene_graph_ros.geometry import SceneGraph\n"
        "from scene_graph_ros.scene_files import load_scene_text\n"
        f"load_scene_text({HEAD!r}).apply(SceneGraph())\n"
        "sys.exit(sorted(m for m in sys.modules if 'perception.' in m or 'files.camera' in m))"
    )
    command = [sys.executable, "-c", code]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.stderr == "[]\n"


COVERED = """\
version: 1
sources: [{name: cell}]
geometries:
  - name: crate
    source: cell
    shape: {type: box, size: [1, 1, 1]}
    roles:
      perception:
        phong:
          diffuse_map: looks/wood.png
          diffuse_scale: [2, 3]
"""


def test_pictures_are_found_beside_the_scene_file(tmp_path):
    """Whatever the working folder; as a package's file, too. The scale is kept."""
    (tmp_path / "looks").mkdir()
    Image.new("RGB", (2, 2)).save(tmp_path / "looks" / "wood.png")
    scene = tmp_path / "scene.yaml"
    for address in ("looks/wood.png", "package://here/looks/wood.png"):
        scene.write_text(
            COVERED.replace("looks/wood.png", address) + f"packages: {{here: {tmp_path}}}\n"
        )
        scene_graph = SceneGraph()
        load_scene(scene).apply(scene_graph)
        look = properties(scene_graph, "crate")
        assert look.get_property("phong", "diffuse_map") == str(tmp_path / "looks" / "wood.png")
        assert look.get_property("phong", "diffuse_scale") == [2, 3]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("wood.png", "oak.png", "looks/oak.png: no such file"),
        ("wood.png", "text.png", "looks/text.png' is no readable PNG or JPEG file"),
        ("[2, 3]", "[2, 0]", "('phong', 'diffuse_scale') must be two numbers that are not 0"),
        ("type: box, size: [1, 1, 1]", "type: convex, vertices: [[0,0,0],[1,0,0],[0,1,0],[0,0,1]]",
         "a hull has no texture coordinates"),
    ],
)  # fmt: skip
def test_the_check_names_the_line_of_a_picture(tmp_path, capsys, old, new, message):
    """And the file, without a node."""
    (tmp_path / "looks").mkdir()
    Image.new("RGB", (2, 2)).save(tmp_path / "looks" / "wood.png")
    (tmp_path / "looks" / "text.png").write_text("wood")
    path = tmp_path / "scene.yaml"
    path.write_text(COVERED.replace(old, new))
    assert main([str(path)]) == 1
    error = capsys.readouterr().err
    assert f"{path}:10: geometries[0].roles.perception.phong.diffuse_map: " in error
    assert message in error


def test_what_people_see_may_be_covered(tmp_path, capsys):
    """The picture is found beside the scene file, and what is wrong with it told by its line."""
    path = tmp_path / "scene.yaml"
    path.write_text(COVERED.replace("perception", "illustration"))
    assert main([str(path)]) == 1
    place = f"{path}:10: geometries[0].roles.illustration.phong.diffuse_map: "
    error = capsys.readouterr().err
    assert place in error
    assert "looks/wood.png: no such file" in error
    (tmp_path / "looks").mkdir()
    Image.new("RGB", (2, 2)).save(tmp_path / "looks" / "wood.png")
    scene_graph = SceneGraph()
    load_scene(path).apply(scene_graph)
    inspector = scene_graph.model_inspector()
    (crate,) = inspector.get_all_geometry_ids(Role.ILLUSTRATION)
    look = inspector.get_properties(crate, Role.ILLUSTRATION)
    assert look.get_property("phong", "diffuse_map") == str(tmp_path / "looks" / "wood.png")


def test_a_robot_may_be_covered(tmp_path):
    """All of its visual geometry, from a file beside the scene's."""
    (tmp_path / "r.urdf").write_text(URDF)
    Image.new("RGB", (2, 2)).save(tmp_path / "skin.png")
    path = tmp_path / "scene.yaml"
    look = "perception: {phong: {diffuse_map: skin.png}}"
    path.write_text(f"version: 1\nrobots:\n  - {{name: r, urdf: r.urdf, {look}}}\n")
    scene_graph = SceneGraph()
    load_scene(path).apply(scene_graph)
    (seen,) = scene_graph.model_inspector().get_all_geometry_ids(Role.PERCEPTION)
    look = scene_graph.model_inspector().get_properties(seen, Role.PERCEPTION)
    assert look.get_property("phong", "diffuse_map") == str(tmp_path / "skin.png")
    (tmp_path / "skin.png").unlink()
    with pytest.raises(
        SceneFileError, match=r"robots\[0\]\.perception: .*skin\.png: no such file"
    ):
        load_scene(path).apply(SceneGraph())


RENDERERS = """\
renderers:
  - {name: exact, type: exact, default_clear_color: [0, 0, 0]}
  - name: studio
    type: traced
    samples: 2
    lights: [{type: point, position: [0, 0, 3], frame: world}]
"""


def test_cameras_choose_renderers_by_name():
    """Those of the file, with their parameters; the same file again shares them."""
    camera = CAMERA + "    renderer: studio\n"
    scene_graph, loaded = apply(HEAD + RENDERERS + camera)
    assert loaded.cameras["wrist"].camera.core.renderer_name == "studio"
    assert scene_graph.registered_renderer_names() == ["exact", "studio"]
    assert "default_clear_color: [0.0, 0.0, 0.0, 1.0]" in scene_graph.renderer_parameter_yaml(
        "exact"
    )
    studio = scene_graph.renderer_parameter_yaml("studio")
    assert "samples: 2\n" in studio
    assert '"type": "point"' in studio
    load_scene_text(HEAD + RENDERERS + camera, label="f").apply(scene_graph, prefix="again_")
    assert scene_graph.renderer_count() == 2


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("type: traced", "type: vtk", "renderers[1].type: "),
        ("samples: 2", "samples: 0", "renderers[1].samples: must be at least 1, got 0"),
        ("samples: 2", "samples: 70000", "f:16: renderers[1]: TracedRenderEngine: samples must"),
        ("[0, 0, 0]}", "[0, 0, 2]}", "renderers[0].default_clear_color[2]: must be at most 1"),
        ("[0, 0, 3]", "[0, 0]", "renderers[1].lights[0].position: must have at least 3 entries"),
        ("type: point", "type: sun", "renderers[1].lights[0].type: must be"),
        ("name: studio", "name: exact", "renderers[1].name: the name 'exact' is taken by line"),
        ("renderer: studio", "renderer: studoi", "cameras[0].renderer: there is no renderer 'stu"),
    ],
)
def test_mistakes_in_renderers_are_located(old, new, message):
    """With the line and the field; nothing is left of the scene."""
    text = HEAD + RENDERERS + CAMERA + "    renderer: studio\n"
    assert old in text
    (problem,) = problems(text.replace(old, new))
    assert message in problem


def test_another_renderer_of_a_name_is_refused():
    """One that is there keeps its name; what was added of the file is taken back."""
    scene_graph = SceneGraph()
    scene_graph.add_renderer("studio", ExactRenderEngine())
    with pytest.raises(SceneFileError, match=r"renderers\[1\]\.name: .*'studio' already, and it"):
        load_scene_text(HEAD + RENDERERS, label="f").apply(scene_graph)
    assert scene_graph.registered_renderer_names() == ["studio"]


SERVER = """\
renderers:
  - {name: blender, type: gltf_client, base_url: "http://127.0.0.1:9", timeout: 0.5}
"""


def test_a_renderer_may_be_a_server():
    """Nothing is asked while the scene is loaded; a wrong address is located."""
    scene_graph, loaded = apply(HEAD + SERVER + CAMERA + "    renderer: blender\n")
    assert scene_graph.renderer_type_name("blender") == "GltfClientRenderEngine"
    assert loaded.servers == ("blender",)
    (problem,) = problems(HEAD + SERVER.replace("http:", "file:"))
    assert problem.startswith("f:15: renderers[0]: GltfClientRenderEngine: base_url and render_e")
