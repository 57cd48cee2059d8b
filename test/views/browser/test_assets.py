"""Which files clients of Foxglove's protocol may be sent: those of a scene's meshes, no others."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
from pictured_files import board, gltf, png, write_obj
import pytest

from scene_graph_ros.geometry import Mesh
from scene_graph_ros.views.browser import assets
from scene_graph_ros.views.browser.assets import AssetError, SceneAssets


@pytest.fixture
def folder(tmp_path):
    """A mesh with materials and a picture, and what is none of the scene's."""
    (tmp_path / "share" / "looks").mkdir(parents=True)
    (tmp_path / "share" / "looks" / "my board.png").write_bytes(png(board()))
    write_obj(tmp_path / "share", [(None, "looks/my board.png"), ((1.0, 0.5, 0.0), None)], "cup")
    plate = gltf([{}], [], beside=tmp_path / "share" / "looks" / "a plate.bin")
    plate = plate.replace(b"a%20plate.bin", b"looks/a%20plate.bin")
    (tmp_path / "share" / "plate.gltf").write_bytes(plate)
    (tmp_path / "share" / "secret.txt").write_text("secret")
    (tmp_path / "secret.mtl").write_text("newmtl other\nKd 1 1 1\nsecret")
    (tmp_path / "share" / "looks" / "other.png").write_bytes(png(board()))
    return tmp_path


def assets_of(stage, share):
    """Return what may be had of a scene whose meshes are in a package."""

    def address_of(path: Path) -> str:
        return f"package://kitchen/{os.path.relpath(path, share)}"

    return SceneAssets(stage.moment().inspector, lambda: address_of)


@pytest.fixture
def offered(stage, folder):
    """What may be had of a scene with a cup and a plate."""
    share = folder / "share"
    stage.add("cup", Mesh(share / "cup.obj"), rgba=None)
    stage.add("plate", Mesh(share / "plate.gltf"), rgba=None, roles=("illustration",))
    stage.add("triangle", Mesh(vertices=np.eye(3), faces=[[0, 1, 2]]))
    return assets_of(stage, share)


def read(offered, address):
    """Return all bytes of a file."""
    return b"".join(offered.find(address).fragments())


def test_a_mesh_and_what_its_file_names(folder, offered):
    """By the address that markers have, by the file's, and as both may be written."""
    share = folder / "share"
    of_cup = ("cup.obj", "cup.mtl", "looks/my board.png")
    for name in (*of_cup, "plate.gltf", "looks/a plate.bin"):
        held = (share / name).read_bytes()
        assert read(offered, f"package://kitchen/{name}") == held
        assert read(offered, (share / name).as_uri()) == held
    picture = (share / "looks" / "my board.png").read_bytes()
    assert read(offered, "package://kitchen/looks/my%20board.png") == picture
    assert read(offered, "package://kitchen/other/../looks/my board.png") == picture


@pytest.mark.parametrize(
    "address",
    [
        "file:///etc/passwd",
        "/etc/passwd",
        "package://kitchen/secret.txt",
        "package://kitchen/looks/other.png",
        "package://kitchen/../share/secret.txt",
        "package://kitchen/looks/%2e%2e/secret.txt",
        "package://kitchen",
        "http://127.0.0.1/cup.obj",
        "",
        "\0",
    ],
)
def test_no_other_file_is_sent(offered, address):
    """Whatever is on the disk; the address is told, and nothing of what is there."""
    with pytest.raises(AssetError, match="no mesh of the scene is of ") as caught:
        offered.find(address)
    assert "secret" not in str(caught.value).replace(address, "")


def test_a_file_that_is_gone_or_too_large(folder, offered, monkeypatch):
    """With the address and the reason."""
    with monkeypatch.context() as patch:
        patch.setattr(assets, "MAX_ASSET_BYTES", 50)
        with pytest.raises(AssetError, match=r"kitchen/cup.obj: has \d+ bytes, the limit is 50"):
            offered.find("package://kitchen/cup.obj")
    (folder / "share" / "cup.mtl").unlink()
    with pytest.raises(AssetError, match=r"kitchen/cup.mtl: No such file"):
        offered.find("package://kitchen/cup.mtl")


@pytest.mark.parametrize("name", ["cup.obj", "cup.mtl", "looks/my board.png", "looks/a plate.bin"])
@pytest.mark.parametrize("how", ["link", "other file", "folder", "pipe", "link of the folder"])
def test_what_took_the_place_of_a_file_is_not_sent(folder, offered, name, how):
    """Neither by a link nor otherwise: what was read is sent, or nothing."""
    path, address = folder / "share" / name, f"package://kitchen/{name}"
    held = path.read_bytes()
    assert read(offered, address) == held
    secret = folder / path.name
    secret.write_bytes(b"s" * len(held))
    os.utime(secret, ns=(path.stat().st_atime_ns, path.stat().st_mtime_ns))
    if how == "link of the folder":
        path.parent.rename(folder / "away")
        path.parent.symlink_to(folder)
    else:
        path.unlink()
    if how == "link":
        path.symlink_to(secret)
    elif how == "other file":
        secret.rename(path)
    elif how == "folder":
        path.mkdir()
    elif how == "pipe":
        os.mkfifo(path)
    with pytest.raises(AssetError):
        offered.find(address)


def test_a_file_that_changes_while_it_is_sent(folder, offered, monkeypatch):
    """It ends there."""
    monkeypatch.setattr(assets, "FRAGMENT", 16)
    fragments = offered.find("package://kitchen/cup.obj").fragments()
    assert next(fragments) == (folder / "share" / "cup.obj").read_bytes()[:16]
    with (folder / "share" / "cup.obj").open("a") as file:
        file.write("# more")
    with pytest.raises(AssetError, match="no longer the file"):
        list(fragments)


def named(address, stage, folder, *, lines, package=None):
    """Return what may be had of a scene whose one mesh names files in some lines."""
    share = folder / "share"
    mesh = share / "cup.obj"
    mesh.write_text("\n".join([*lines, "v 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl other\nf 1 2 3"]))
    if package is not None:
        (package / "package.xml").touch()
    stage.add("cup", Mesh(mesh), rgba=None, roles=("illustration",))
    return assets_of(stage, share).find(address)


def test_a_library_is_offered_if_a_material_is_from_it(stage, folder):
    """Not any file that reads as a library without one: all text does."""
    (folder / "share" / "used.mtl").write_text("newmtl other\nKd 1 0 0\n")
    lines = ["mtllib secret.txt", "mtllib used.mtl"]
    assert named("package://kitchen/used.mtl", stage, folder, lines=lines)
    with pytest.raises(AssetError, match="no mesh of the scene"):
        assets_of(stage, folder / "share").find("package://kitchen/secret.txt")


@pytest.mark.parametrize("form", ["beside", "absolute", "link"])
def test_a_library_elsewhere_is_not_offered(stage, folder, form):
    """Out of the mesh's folder by its path or by a link, though a material is from it."""
    library = {"beside": "../secret.mtl", "absolute": str(folder / "secret.mtl"), "link": "l.mtl"}
    (folder / "share" / "l.mtl").symlink_to(folder / "secret.mtl")
    asked = f"package://kitchen/{'l' if form == 'link' else '../secret'}.mtl"
    with pytest.raises(AssetError, match="no mesh of the scene"):
        named(asked, stage, folder, lines=[f"mtllib {library[form]}"])
    with pytest.raises(AssetError, match="no mesh of the scene"):
        assets_of(stage, folder / "share").find((folder / "secret.mtl").as_uri())


def test_a_library_of_the_same_package_is_offered(stage, folder):
    """Meshes and materials often lie in folders beside each other."""
    asked = (folder / "secret.mtl").as_uri()
    lines = ["mtllib ../secret.mtl"]
    assert named(asked, stage, folder, lines=lines, package=folder)


def test_pictures_and_buffers_elsewhere_are_not_offered(stage, folder, monkeypatch):
    """A picture by its path, a buffer by a link; and none of another user."""
    share = folder / "share"
    (folder / "board.png").write_bytes(png(board()))
    write_obj(share, [(None, "../board.png")], "cup")
    buffer = share / "looks" / "a plate.bin"
    buffer.rename(folder / "plate.bin")
    buffer.symlink_to(folder / "plate.bin")
    stage.add("cup", Mesh(share / "cup.obj"), rgba=None)
    stage.add("plate", Mesh(share / "plate.gltf"), rgba=None, roles=("illustration",))
    offered = assets_of(stage, share)
    for path in (folder / "board.png", buffer):
        with pytest.raises(AssetError, match="no mesh of the scene"):
            offered.find(path.as_uri())
    mesh = (share / "cup.obj", assets_of(stage, share)._marks[(share / "cup.obj").as_uri()])
    library = offered._marks[(share / "cup.mtl").as_uri()]
    assert assets._may_be_sent(library, mesh)
    assert not assets._may_be_sent(library._replace(owner=library.owner + 1), mesh)


def test_what_is_no_mesh_is_not_sent(stage, folder):
    """Shapes that are only shown are not read before somebody shows them."""
    stage.add("none", Mesh(folder / "share" / "secret.txt"), rgba=None, roles=("illustration",))
    with pytest.raises(AssetError, match="no mesh of the scene"):
        assets_of(stage, folder / "share").find((folder / "share" / "secret.txt").as_uri())


def test_a_workspace_of_links_is_sent(stage, folder):
    """Some builds install links to the sources: files beside each other stay so."""
    share, linked = folder / "share", folder / "linked"
    linked.mkdir()
    (linked / "looks").mkdir()
    for name in ("cup.obj", "cup.mtl", "looks/my board.png"):
        (linked / name).symlink_to(share / name)
    stage.add("cup", Mesh(linked / "cup.obj"), rgba=None)
    offered = assets_of(stage, linked)
    for name in ("cup.obj", "cup.mtl", "looks/my board.png"):
        assert read(offered, f"package://kitchen/{name}") == (share / name).read_bytes()
