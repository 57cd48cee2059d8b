"""Which files clients of Foxglove's protocol may be sent: those of a scene's meshes, no others."""

from __future__ import annotations

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
    (tmp_path / "share" / "looks" / "other.png").write_bytes(png(board()))
    return tmp_path


@pytest.fixture
def offered(stage, folder):
    """What may be had of a scene whose mesh is in a package."""
    share = folder / "share"
    stage.add("cup", Mesh(share / "cup.obj"), rgba=None)
    stage.add("plate", Mesh(share / "plate.gltf"), rgba=None, roles=("illustration",))
    stage.add("triangle", Mesh(vertices=np.eye(3), faces=[[0, 1, 2]]))

    def address_of(path: Path) -> str:
        return f"package://kitchen/{path.relative_to(share).as_posix()}"

    return SceneAssets(stage.moment().inspector, lambda: address_of)


def test_a_mesh_and_what_its_file_names(folder, offered):
    """By the address that markers have, by the file's, and as both may be written."""
    share = folder / "share"
    of_cup = ("cup.obj", "cup.mtl", "looks/my board.png")
    for name in (*of_cup, "plate.gltf", "looks/a plate.bin"):
        held = (share / name).read_bytes()
        assert offered.read(f"package://kitchen/{name}") == held
        assert offered.read((share / name).as_uri()) == held
    picture = (share / "looks" / "my board.png").read_bytes()
    assert offered.read("package://kitchen/looks/my%20board.png") == picture
    assert offered.read("package://kitchen/other/../looks/my board.png") == picture


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
        offered.read(address)
    assert "secret" not in str(caught.value).replace(address, "")


def test_a_file_that_is_gone_or_too_large(folder, offered, monkeypatch):
    """With the address and the reason."""
    monkeypatch.setattr(assets, "MAX_ASSET_BYTES", 50)
    with pytest.raises(AssetError, match=r"kitchen/cup.obj: has \d+ bytes, the limit is 50"):
        offered.read("package://kitchen/cup.obj")
    (folder / "share" / "cup.mtl").unlink()
    with pytest.raises(AssetError, match=r"kitchen/cup.mtl: No such file"):
        offered.read("package://kitchen/cup.mtl")
