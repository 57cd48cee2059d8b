"""Addresses of files: package://, file://, relative; and where packages are found."""

import subprocess
import sys

import pytest

from scene_graph_ros.scene_files import (
    find_package,
    resolve_resource,
    SceneFileError,
    UnknownPackageError,
)
from scene_graph_ros.scene_files.packages import Packages


@pytest.fixture(autouse=True)
def empty_environment(monkeypatch):
    """Keep packages of this machine out of the tests."""
    monkeypatch.delenv("AMENT_PREFIX_PATH", raising=False)
    monkeypatch.delenv("ROS_PACKAGE_PATH", raising=False)


def make_prefix(folder, package, *, indexed=True):
    """Make an install prefix with one package, which holds a file ``part``; return its share."""
    share = folder / "share" / package
    share.mkdir(parents=True)
    (share / "part").write_text("x")
    if indexed:
        index = folder / "share/ament_index/resource_index/packages"
        index.mkdir(parents=True, exist_ok=True)
        (index / package).write_text("")
    return share


def make_source(folder, package):
    """Make a source checkout of a package with a manifest; return its folder."""
    folder.mkdir(parents=True)
    (folder / "package.xml").write_text(f"<package><name>{package}</name></package>")
    (folder / "part").write_text("x")
    return folder


def test_ament_index_in_the_order_of_prefixes(tmp_path, monkeypatch):
    """The first prefix that has the package wins; prefixes without it are passed over."""
    make_prefix(tmp_path / "one", "other")
    two, three = (make_prefix(tmp_path / name, "robot") for name in ("two", "three"))
    monkeypatch.setenv("AMENT_PREFIX_PATH", f"{tmp_path / 'one'}:{tmp_path / 'two'}:{three}")
    assert find_package("robot") == two
    assert resolve_resource("package://robot/part") == two / "part"


def test_a_folder_outside_the_index_is_no_package(tmp_path, monkeypatch):
    """A share folder that neither the index nor a manifest names is not taken for a package."""
    make_prefix(tmp_path, "robot", indexed=False)
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(tmp_path))
    with pytest.raises(UnknownPackageError, match="'robot' not found; searched ament prefix"):
        find_package("robot")


def test_search_order(tmp_path, monkeypatch):
    """A map beats folders, these beat the ament index, and that beats the file's surroundings."""
    mapped = make_source(tmp_path / "mapped", "robot")
    folder = make_source(tmp_path / "folders/robot", "robot")
    installed = make_prefix(tmp_path / "prefix", "robot")
    around = make_source(tmp_path / "checkout", "robot")
    file = around / "part"
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(tmp_path / "prefix"))
    everything = Packages.of({"robot": mapped}, [tmp_path / "folders"])
    assert everything.find("robot", near=file) == mapped
    assert Packages.of(None, [tmp_path / "folders"]).find("robot", near=file) == folder
    assert Packages().find("robot", near=file) == installed
    monkeypatch.delenv("AMENT_PREFIX_PATH")
    assert Packages().find("robot", near=file) == around


@pytest.mark.parametrize("entry", ["checkout", "checkout/robot", "prefix"])
def test_package_dirs_may_be_contain_or_install_the_package(tmp_path, entry):
    """A search folder is the package itself, has it inside, or is an install prefix with it."""
    make_source(tmp_path / "checkout/robot", "robot")
    make_prefix(tmp_path / "prefix", "robot")
    assert (find_package("robot", package_dirs=[tmp_path / entry]) / "part").is_file()


def test_manifest_name_counts_not_the_folders(tmp_path):
    """A checkout may be called otherwise than its package."""
    folder = make_source(tmp_path / "robot-main", "robot")
    assert find_package("robot", package_dirs=[folder]) == folder


def test_ros_package_path(tmp_path, monkeypatch):
    """The search path of older workspaces is honoured."""
    folder = make_source(tmp_path / "src/robot", "robot")
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path / "src"))
    assert find_package("robot") == folder


def test_wheels_that_bring_a_share_folder_are_found():
    """example-robot-data, installed by pip, is found without any environment variable."""
    assert (find_package("example-robot-data") / "package.xml").is_file()


def test_unknown_package_lists_the_places(tmp_path, monkeypatch):
    """The error names each place that was searched."""
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(tmp_path / "prefix"))
    with pytest.raises(UnknownPackageError) as caught:
        find_package("nobody", package_dirs=[tmp_path / "mine"])
    for place in (tmp_path / "prefix", tmp_path / "mine", sys.prefix):
        assert str(place) in str(caught.value)


def test_map_to_nowhere(tmp_path):
    """A mapped package whose folder is missing is not looked for elsewhere."""
    with pytest.raises(UnknownPackageError, match=r"'robot' is mapped to .*gone, which is"):
        find_package("robot", package_map={"robot": tmp_path / "gone"})


def test_file_addresses_and_relative_paths(tmp_path):
    """file:// is percent-decoded; a relative path starts from the file that contains it."""
    part = tmp_path / "a part"
    part.write_text("x")
    assert resolve_resource(f"file://{tmp_path}/a%20part") == part
    assert resolve_resource("a part", base=tmp_path / "scene.yaml") == part
    assert resolve_resource(str(part)) == part


@pytest.mark.parametrize(
    ("resource", "message"),
    [
        ("package://robot", "expected package://<package>/<path>, got 'package://robot'"),
        ("package://", "expected package://<package>/<path>"),
        ("file://part", "expected file:///<absolute path>, got 'file://part'"),
        ("http://host/part", "got the scheme 'http' in 'http://host/part'"),
        ("model://robot/part", "got the scheme 'model'"),
        ("/no/such/part", "'/no/such/part': no such file"),
        ("/tmp", "'/tmp': is a folder"),
        ("/dev/zero", "'/dev/zero': is no regular file"),
        ("a\0b", "'a\\x00b': embedded null byte"),
        ("a" * 4000, "aaa': File name too long"),
        ("a" * 100_000, "at most 4096 characters, got 100000: 'aaa"),
        (f"package://{'a' * 3000}/part", "aaa' not found; searched"),
        ("~nobody_of_this_name/part", "'~nobody_of_this_name/part': Could not determine home"),
        ("", "expected a path, package:// or file://, got ''"),
    ],
)
def test_wrong_addresses_are_quoted(resource, message):
    """Each wrong address is named with what was expected."""
    with pytest.raises(SceneFileError) as caught:
        resolve_resource(resource)
    assert message in str(caught.value)


def test_three_slashes_after_package(tmp_path):
    """Some descriptions write package:///name/file, and mean package://name/file."""
    share = make_prefix(tmp_path, "robot")
    packages = Packages.of(None, [tmp_path])
    assert resolve_resource("package:///robot/part", packages=packages) == share / "part"


def test_reading_files_imports_neither_ros_nor_more_than_asked():
    """Resolving an address loads no ROS module, no pydantic and no pinocchio."""
    code = (
        "import sys; from scene_graph_ros.scene_files import resolve_resource, load_urdf;"
        "load_urdf('<robot><link name=\"a\"/></robot>');"
        "unwanted = {'rclpy', 'ament_index_python', 'pydantic', 'pinocchio'};"
        "print(sorted(unwanted & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
