"""Who gets the handle of a source of the scene that the node starts with."""

from __future__ import annotations

import os
from pathlib import Path
import re
import stat
from types import SimpleNamespace

import pytest

from msg_adapters.errors import MessageError
from scene_graph_msgs import srv
from scene_graph_ros.geometry import SceneGraph
from scene_graph_ros.geometry.errors import NameConflictError
from scene_graph_ros.located import SceneFileError
from scene_graph_ros.node.world.edits import EDITS
from scene_graph_ros.node.world.inputs import message_type
from scene_graph_ros.node.world.scenes import SceneLoader
from scene_graph_ros.node.world.world import World

_SCENE = """version: 1
sources:
  - {name: objects%s}
frames: [{name: mug, source: objects}]
"""


def loaded(folder: Path, key: str = "") -> World:
    """Return the world of a node that starts with a scene whose source has a key."""
    path = folder / "cell.yaml"
    path.write_text(_SCENE % (f", {key}" if key else ""))
    world = World(SceneGraph())
    loader = SceneLoader("", message_type, ())
    world.edit(lambda edit: loader.load(edit, str(path)))
    return world


def names_in(folder: Path) -> list[str]:
    """Return what is in a folder."""
    return sorted(each.name for each in folder.iterdir())


def register(world: World, **fields) -> srv.RegisterSource.Response:
    """Ask for a source as a client does."""
    request = srv.RegisterSource.Request(**{"name": "objects", **fields})
    response = srv.RegisterSource.Response()
    tools = SimpleNamespace(check_pose_type=message_type)
    world.edit(lambda edit: EDITS["RegisterSource"](request, response, edit, tools))
    return response


def test_without_a_word_nobody_gets_a_handle(tmp_path):
    """As it was: the name is taken."""
    with pytest.raises(NameConflictError, match="'objects' exists already"):
        register(loaded(tmp_path))


@pytest.mark.parametrize("token", [0, 77])
def test_the_first_gets_what_it_claims_once(tmp_path, token):
    """With a token of its own a program that was restarted gets it again."""
    world = loaded(tmp_path, "claim: first")
    got = register(world, token=token).source
    assert got.token == world.handles["objects"].token
    assert got.token == token or not token
    for other in (0, got.token ^ 1):
        with pytest.raises(NameConflictError, match="was claimed"):
            register(world, token=other)
    version = world.snapshot.scene_version
    assert register(world, token=got.token).source == got
    assert world.snapshot.scene_version == version


def test_a_claim_says_the_type_that_the_source_has_or_none(tmp_path):
    """A wrong one leaves the handle to whoever asks rightly."""
    world = loaded(tmp_path, "claim: first")
    with pytest.raises(MessageError, match="sends sensor_msgs/msg/MultiDOFJointState, not geom"):
        register(world, pose_type="geometry_msgs/msg/PoseStamped")
    assert register(world, pose_type="sensor_msgs/msg/MultiDOFJointState").source.token


def test_a_token_is_made_in_a_file_for_the_user_alone_and_found_again(tmp_path):
    """Below the scene's folder, also in a folder of its own."""
    (tmp_path / "own").mkdir()
    token = loaded(tmp_path, "token_file: own/objects.token").handles["objects"].token
    path = tmp_path / "own" / "objects.token"
    assert stat.S_IMODE(path.stat().st_mode) == 0o600
    assert path.read_text() == f"{token}\n"
    assert names_in(path.parent) == ["objects.token"]
    again = loaded(tmp_path, "token_file: own/objects.token")
    assert again.handles["objects"].token == token
    assert register(again, token=token).source.token == token
    with pytest.raises(NameConflictError):
        register(again)


@pytest.mark.parametrize(
    ("text", "mode", "words"),
    [
        ("12\n", 0o640, "others may use it, with mode 0640: chmod 600 it"),
        ("", 0o600, "must hold a number from 1"),
        ("hunter2", 0o600, "must hold a number from 1"),
        ("0", 0o600, "must hold a number from 1"),
        (str(2**64), 0o600, "must hold a number from 1"),
        ("1" * 65, 0o600, "has 65 bytes, the limit is 64"),
    ],
)
def test_a_file_that_is_no_token_of_the_user_is_refused(tmp_path, text, mode, words):
    """And not repeated."""
    path = tmp_path / "t"
    path.write_text(text)
    path.chmod(mode)
    with pytest.raises(SceneFileError, match=re.escape(words)) as caught:
        loaded(tmp_path, "token_file: t")
    assert "hunter2" not in str(caught.value)


@pytest.mark.parametrize("key", ["token_file: ../t", "token_file: /etc/t", "token_file: ."])
def test_a_file_elsewhere_is_refused_with_the_line(tmp_path, key):
    """Before anything is opened or made."""
    with pytest.raises(
        SceneFileError, match=r"cell.yaml:3: sources\[0\].token_file: must lie below"
    ):
        loaded(tmp_path, key)


@pytest.mark.parametrize("target", ["file", "folder", "pipe"])
def test_a_link_out_of_the_folder_and_what_is_no_file_are_refused(tmp_path, target):
    """A pipe is not waited for."""
    inside, outside = tmp_path / "in", tmp_path / "out"
    inside.mkdir()
    outside.mkdir()
    (outside / "t").write_text("12")
    (outside / "t").chmod(0o600)
    key = "token_file: t"
    if target == "file":
        (inside / "t").symlink_to(outside / "t")
    elif target == "folder":
        (inside / "way").symlink_to(outside)
        key = "token_file: way/new"
    else:
        os.mkfifo(inside / "t")
    with pytest.raises(SceneFileError, match=r"leads out of the folder|is no regular file"):
        loaded(inside, key)
    assert names_in(outside) == ["t"]


def test_both_keys_at_once_are_refused(tmp_path):
    """They would say who gets the handle twice."""
    with pytest.raises(SceneFileError, match="give token_file or claim, not both"):
        loaded(tmp_path, "claim: first, token_file: t")


@pytest.mark.parametrize("key", ["token_file: t", "claim: first"])
def test_a_scene_of_a_request_has_neither(tmp_path, key):
    """Also from a file where scenes lie; no file is made, and nothing is added."""
    path = tmp_path / "cell.yaml"
    path.write_text(_SCENE % f", {key}")
    world, loader = World(SceneGraph()), SceneLoader("", message_type, (), folders=(tmp_path,))
    request = SimpleNamespace(resource=str(path), text="", prefix="")
    with pytest.raises(MessageError, match=f"'objects': {key.partition(':')[0]} can be said by"):
        world.edit(lambda edit: loader.load_request(edit, request))
    assert names_in(tmp_path) == ["cell.yaml"]
    assert not world.records


def test_nothing_shows_a_token(tmp_path):
    """Neither what is known of a source nor its handle, as text."""
    world = loaded(tmp_path, "claim: first")
    token = str(register(world).source.token)
    assert token not in repr(world.handles) + repr(world.records) + repr(world.snapshot.records)
