"""The command that checks files, of meshes and of the pictures that they name."""

import re

from checking import check, write
from pictured_files import huge_png, write_obj
import pytest

from scene_graph_ros.check import main


@pytest.mark.parametrize(
    ("name", "reason", "own_reason"),
    [
        ("lost.png", "does not exist", "no such file"),
        ("huge.png", *(2 * ("8193 x 8192 are more than 67108864 pixels",))),
    ],
)
def test_a_picture_that_is_missing_or_huge(tmp_path, capsys, name, reason, own_reason):
    """One that the scene names is refused; one that a mesh's file names is told, and left out.

    Where warnings are taken for errors the latter is one, too.
    """
    (tmp_path / "huge.png").write_bytes(huge_png())
    body = (
        "version: 1\nsources: [{name: table}]\ngeometries:\n- {source: table, name: cup,"
        " shape: {type: mesh, file: %s.obj}, roles: {perception: %s}}\n"
    )
    reason = f"texture file '{tmp_path}/{name}'.*{reason}"
    for options, code, summary in (((), 0, "ok:.*, 1 warning"), (("--strict",), 1, "not usable:")):
        # A file of its own: each is told once in a process.
        mesh = write_obj(tmp_path, [((0.5, 0.5, 0.5), name)], f"mesh{code}")
        scene = write(tmp_path, "scene.yaml", body % (mesh.stem, "{}"))
        status, (said,), (line,) = check(capsys, *options, scene)
        assert status == code
        assert re.match(f"{scene}: scene {summary}", said)
        told = f"warning: {scene}: mesh file '{mesh}' names '{name}', shown without: {reason}"
        assert re.match(told, line)
    scene = write(tmp_path, "own.yaml", body % (mesh.stem, f"{{phong: {{diffuse_map: {name}}}}}"))
    status, (said,), (line,) = check(capsys, scene)
    assert status == 1
    assert re.match(rf"error: {scene}:\d+: geometries\[0\].*{tmp_path}/{name}.*{own_reason}", line)
    assert said.startswith(f"{scene}: scene not usable: 1 error")


def test_a_mesh_file_is_reported_and_drawn(capsys, tmp_path):
    """Its parts and repairs in the summary, an open edge as a warning, and in a picture."""
    box = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n"
    box += "f 4 3 2 1\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n"
    closed = write(tmp_path, "closed.obj", box + "f 5 6 7 8\n")
    status, out, err = check(capsys, str(closed))
    assert (status, err) == (0, [])
    assert out == [f"{closed}: mesh ok: 12 triangles, 1 x 1 x 1 m; 1 closed part"]
    opened, picture = write(tmp_path, "open.obj", box), tmp_path / "open.png"
    status, out, err = check(capsys, str(opened), "--draw", str(picture))
    assert status == 0
    assert "10 triangles, 1 x 1 x 1 m; 0 closed parts, 1 sheet" in out[0]
    assert err == [
        f"warning: {opened}: 4 edges are open, one at (0.5, 0, 1), so a sheet has two sides and no"
        " inside"
    ]
    assert picture.read_bytes().startswith(b"\x89PNG")


BOX = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n"
SIDES = "f 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\nf 5 6 7 8\n"
USABLE = {
    "closed.obj": (BOX + SIDES + "f 4 3 2 1\n", "1 closed part", None),
    "turned.obj": (BOX + SIDES + "f 1 2 3 4\n", "repaired: 2 triangles turned (one at (", None),
    "open.obj": (BOX + SIDES, "0 closed parts, 1 sheet", "4 edges are open, one at (0.5, 0, 0)"),
    "T.obj": (
        BOX + "v .5 0 0\n" + SIDES.replace("f 1 2 6 5", "f 1 9 6 5\nf 9 2 6") + "f 4 3 2 1\n",
        "1 closed part; repaired: 1 T vertices (one at (0.5, 0, 0))",
        None,
    ),
    "crossing.obj": (
        BOX + "f 1 3 2 4\n",
        "1 sheet; repaired: 1 faces cut that cross themselves (one at (0, 0, 0))",
        "4 edges are open",
    ),
}
UNUSABLE = {
    "lfs.stl": (b"version https://git-lfs.github.com/spec/v1\noid x\n", "run 'git lfs pull'"),
    "empty.stl": (b"", "the file is empty"),
    "words.stl": (b"hello\n" * 20, "no facets in words, and is too short for a binary one"),
    "short.stl": (bytes(80) + b"\2\0\0\0" + bytes(50), "ends before its last triangle, of 2"),
    "points.obj": (b"v 0 0 0\nv 1 0 0\nv 0 1 0\n", "there is no triangle with an area"),
    "missing.obj": (None, "no such file"),
}


@pytest.mark.parametrize("name", USABLE)
def test_each_usable_mesh_file_is_summed_up_and_drawn(capsys, tmp_path, name):
    """In one line, with its repairs; a warning says where it is open."""
    text, told, warning = USABLE[name]
    picture = tmp_path / "picture.png"
    status, (said,), err = check(capsys, str(write(tmp_path, name, text)), "--draw", str(picture))
    assert status == 0
    assert told in said
    assert len(err) == (warning is not None)
    assert warning is None or warning in err[0]
    assert picture.read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize("name", UNUSABLE)
def test_each_unusable_mesh_file_is_told_why(capsys, tmp_path, name):
    """In one line, by its name; there is no picture."""
    contents, told = UNUSABLE[name]
    if contents is not None:
        (tmp_path / name).write_bytes(contents)
    picture = tmp_path / "picture.png"
    status, (said,), (line,) = check(capsys, str(tmp_path / name), "--draw", str(picture))
    assert status == 1
    assert said == f"{tmp_path / name}: {said.split()[1]} not usable: 1 error"
    assert line.startswith("error: ")
    assert name in line
    assert told in line
    assert not picture.exists()


def test_a_picture_that_cannot_be_written_is_told(capsys, tmp_path):
    """By its name and the reason; where there is nothing to draw the call is wrong."""
    closed = write(tmp_path, "closed.obj", USABLE["closed.obj"][0])
    for picture, reason in (("no/folder.png", "No such file"), ("a.mesh", "is not supported")):
        status, _, (line,) = check(capsys, str(closed), "--draw", str(tmp_path / picture))
        assert status == 1
        assert re.match(rf"error: {closed}: the picture '.*{picture}' can't be.*{reason}", line)
    scene = write(tmp_path, "empty.yaml", "version: 1\n")
    with pytest.raises(SystemExit, match="2"):
        main([str(scene), "--draw", str(tmp_path / "a.png")])
    assert "argument --draw: none of the files is a mesh" in capsys.readouterr().err
