"""Which files a request may name, and how much of them an answer repeats."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest

from scene_graph_ros.convex.errors import ConvexSetError
from scene_graph_ros.convex.iris.regions_yaml import regions_from_document
from scene_graph_ros.geometry.files import package_folder, Reach
from scene_graph_ros.located import SceneFileError
from scene_graph_ros.node.world.scenes import folders_of, SceneLoader
from scene_graph_ros.scene_files import load_scene
from scene_graph_ros.scene_files.packages import resolve_resource

_SHADOW = "root:$y$hunter2:19000:0:99999:7:::\nsecret:!:19000::::::\n"
_CREDENTIALS = "hunter2: {user: secret}\npassword: hunter2\n"


def _refused(loader: SceneLoader, resource: object) -> str:
    request = SimpleNamespace(resource=str(resource), text="", prefix="")
    with pytest.raises(SceneFileError) as caught:
        loader.load_request(None, request)
    return str(caught.value)


@pytest.fixture(name="cell")
def _cell(tmp_path):
    """Return a folder below which requests may name files."""
    folder = tmp_path / "cell"
    folder.mkdir()
    return folder


@pytest.fixture(name="loader")
def _loader(cell):
    return SceneLoader("", lambda name: None, (), folders=(cell,))


@pytest.mark.parametrize("content", [_SHADOW, _CREDENTIALS, "hunter2", "- hunter2\n- secret\n",
                                     "a: *hunter2\n", "!hunter2 x\n", "[hunter2]: x\n",
                                     "hunter2: 1\nhunter2: 2\n"])  # fmt: skip
def test_what_is_no_scene_is_not_repeated(loader, cell, content):
    """Also where it lies where scenes do, and is called like one."""
    path = cell / "scene.yaml"
    path.write_text(content)
    said = _refused(loader, path)
    assert "hunter2" not in said and "secret" not in said
    assert "scene.yaml" in said


def test_of_keys_that_are_unknown_five_are_named_and_cut(loader, cell):
    """A mapping with a version may be something else's."""
    keys = [f"{'k' * 60}{i}" for i in range(20)]
    (cell / "a.yaml").write_text("version: 1\n" + "".join(f"{key}: secret\n" for key in keys))
    said = _refused(loader, cell / "a.yaml")
    assert said.count("k" * 40 + "...") == 5 and "k" * 41 not in said
    assert "15 more unknown keys" in said and "secret" not in said


@pytest.mark.parametrize(
    ("place", "reason"),
    [
        ("secret.yaml", "lies in none of the folders"),
        ("cell/../secret.yaml", "lies in none of the folders"),
        ("cell/notes.txt", "end with .yaml or .yml"),
        ("nothing.yaml", "lies in none of the folders"),
        ("cell/nothing.yaml", "no such file"),
    ],
)
def test_a_request_names_yaml_below_the_folders(loader, tmp_path, place, reason):
    """Whether another file exists is not told."""
    (tmp_path / "secret.yaml").write_text(_CREDENTIALS)
    (tmp_path / "cell" / "notes.txt").write_text(_SHADOW)
    for resource in (tmp_path / place, f"file://{tmp_path / place}"):
        assert reason in _refused(loader, resource)
    with pytest.raises(SceneFileError, match=reason):
        loader.requested_text(str(tmp_path / place))


def test_a_scene_of_a_request_names_no_robot_of_elsewhere(loader, cell, tmp_path):
    """Its robots are texts, too."""
    from scene_graph_ros.geometry import SceneGraph
    from scene_graph_ros.scene_files import load_scene_text

    (tmp_path / "secret.urdf").write_text("<hunter2/>")
    (cell / "notes.txt").write_text("<hunter2/>")
    for urdf in ("../secret.urdf", "notes.txt", "../nothing.urdf"):
        text = f"version: 1\nrobots: [{{name: r, urdf: {urdf}}}]\n"
        scene = load_scene_text(text, base=cell / "s.yaml", reach=loader._reach)
        with pytest.raises(SceneFileError, match="a request may name") as caught:
            scene.apply(SceneGraph())
        assert "hunter2" not in str(caught.value)


def test_links_below_a_folder_lead_where_its_owner_wants(loader, cell, tmp_path):
    """So a workspace that was installed with links works."""
    (tmp_path / "source.yaml").write_text("version: 1\n")
    (cell / "installed.yaml").symlink_to(tmp_path / "source.yaml")
    assert loader.requested_text(str(cell / "installed.yaml"))[1] == "version: 1\n"


def test_the_folders_are_those_of_the_start(tmp_path):
    """The named ones, that for regions, and the package or folder of the scene."""
    package = tmp_path / "package"
    (package / "config").mkdir(parents=True)
    scene = package / "config" / "cell.yaml"
    assert package_folder(scene) == package / "config"
    (package / "package.xml").write_text("<package/>")
    assert package_folder(scene) == package
    assert folders_of("/a:/b", scene, "/r") == (Path("/a"), Path("/b"), Path("/r"), package)
    assert folders_of("", None, "") == ()


def test_what_packages_share_may_be_named(tmp_path, monkeypatch):
    """Without any parameter."""
    share = tmp_path / "share" / "robots"
    share.mkdir(parents=True)
    (share / "package.xml").write_text("<package/>")
    (share / "cell.yaml").write_text("version: 1\n")
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(tmp_path))
    loader = SceneLoader("", lambda name: None, (), folders=())
    assert loader.requested_text("package://robots/cell.yaml")[1] == "version: 1\n"


def test_the_users_own_call_reads_any_file_and_says_why(tmp_path):
    """As the offline check does."""
    path = tmp_path / "scene.txt"
    path.write_text("a: *nobody\n")
    with pytest.raises(SceneFileError, match="nobody"):
        load_scene(path)
    assert Reach().is_anywhere and not Reach(()).is_anywhere


@pytest.mark.parametrize("child", [None, "regions"])
@pytest.mark.parametrize(
    "document",
    ["hunter2", ["hunter2"], {f"{'k' * 50}{i}": "hunter2" for i in range(9)},
     {"regions": "hunter2"}, {"regions": {"a": "hunter2"}}],
)  # fmt: skip
def test_of_what_are_no_regions_no_value_is_repeated(document, child):
    """At most five names, each cut."""
    with pytest.raises(ConvexSetError) as caught:
        regions_from_document(document, "file", child)
    said = str(caught.value)
    assert "hunter2" not in said
    assert "k" * 41 not in said and said.count("kkk...") <= 5


TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
MESH = """<robot name="r"><link name="base"><collision><geometry><mesh filename="{}"/></geometry>
</collision></link></robot>"""


def test_meshes_lie_below_the_folders(loader, cell, tmp_path):
    """Whether there is another one is not told, however it is spelled."""
    outside, inside = tmp_path / "outside.obj", cell / "in side.obj"
    for file in (outside, inside, tmp_path / "out%20.obj"):
        file.write_text(TRIANGLE)
    assert loader.resolve(str(inside)) == inside
    assert loader.resolve(inside.as_uri()) == inside  # with %20
    others = ("nothing.obj", "out%20.obj", "out%21.obj", "cell/../outside.obj")
    said = set()
    for name in (outside, *(tmp_path / other for other in others), outside.as_uri()):
        with pytest.raises(SceneFileError) as caught:
            loader.resolve(str(name))
        said.add(str(caught.value).rpartition(": ")[2])
    assert len(said) == 1
    assert "resource_folders" in said.pop()


def test_packages_of_requests_lie_below_the_folders(loader, cell, tmp_path):
    """A scene names packages beside it: whether a folder elsewhere exists is not told."""
    (tmp_path / "private").mkdir()
    (tmp_path / "private" / "x.obj").write_text(TRIANGLE)
    (cell / "parts").mkdir()
    (cell / "parts" / "x.obj").write_text(TRIANGLE)
    packages = replace(loader._packages, reach=loader._reach)
    base = cell / "scene.yaml"
    found = resolve_resource("package://parts/x.obj", base=base, packages=packages)
    assert found == cell / "parts" / "x.obj"
    said = set()
    for name in ("private", "nothing"):
        with pytest.raises(SceneFileError, match="not found") as caught:
            resolve_resource(f"package://{name}/x.obj", base=base, packages=packages)
        said.add(str(caught.value).replace(name, "it"))
    assert len(said) == 1
    # The user's own scene finds it.
    assert resolve_resource("package://private/x.obj", base=base).is_file()


@pytest.mark.parametrize("kind", ["shape", "picture", "urdf"])
def test_what_a_scene_of_a_request_names_is_held_to_the_folders(loader, cell, tmp_path, kind):
    """Meshes and pictures of its geometries, and those of its robots."""
    from scene_graph_ros.geometry import SceneGraph
    from scene_graph_ros.scene_files import load_scene_text

    (tmp_path / "outside.obj").write_text(TRIANGLE)
    (tmp_path / "outside.png").write_bytes(b"")
    (cell / "r.urdf").write_text(MESH.format(tmp_path / "outside.obj"))
    shape = "{type: box, size: [1, 1, 1]}"
    roles = "{perception: {phong: {diffuse_map: ../outside.png}}}"
    if kind == "shape":
        shape, roles = "{type: mesh, file: ../outside.obj}", "{proximity: {}}"
    text = "version: 1\nsources: [{name: s}]\n" + (
        "robots: [{name: r, urdf: r.urdf}]\n"
        if kind == "urdf"
        else f"geometries: [{{name: g, source: s, shape: {shape}, roles: {roles}}}]\n"
    )
    scene = load_scene_text(text, base=cell / "s.yaml", reach=loader._reach)
    with pytest.raises(SceneFileError, match="lies in none of the folders"):
        scene.apply(SceneGraph())
