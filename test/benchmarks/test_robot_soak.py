"""Robots on a bad network over DDS, and the sweep of robots' files."""

from pathlib import Path

import pytest
from searching import times

from benchmarks import robot_files
from benchmarks.messages.robot_soak import soak_robot
from scene_graph_ros.scene_files import find_package

WHEELS = Path(__file__).parents[2] / "build" / "robot_files"
"""Where `make robot-files` puts robots of other wheels."""
FROM_OTHERS = (
    "expected a number, got '0.07,'",
    "expected 3 numbers, got",
    "Bullet means by that",
    "it is Bullet's word",
    "Drake has such a link",
    "is for xacro",
    "no <link>",
    "no link 'base_link'",
    "not well-formed XML",
)
"""Why files may be refused: URDF's own parser does, limits make no sense, or it is a dialect."""


@pytest.mark.search
def test_poses_are_the_references_at_each_update():
    """With messages jittered, reordered, sent twice and lost between two processes."""
    result = soak_robot(times(60), rate=100.0)
    assert result.sent > 0
    assert result.received <= result.sent
    assert result.updates > result.received // 100
    assert result.out_of_order > 0
    # Sines, cosines and a few products of numbers about 1.
    assert result.largest_error < 1e-14
    assert result.wrong_stamps == 0


@pytest.mark.search
def test_files_load_or_are_refused_with_their_line():
    """The last robots of the package at hand; all of the wheels, where they were fetched."""
    own = find_package("example-robot-data") / "robots"
    files = robot_files.urdfs_below([own])[-times(8) :]
    if WHEELS.is_dir() and times(1) > 1:
        files += robot_files.urdfs_below([WHEELS])
    for read in robot_files.read_all(files, with_meshes=False):
        if read.refused:
            assert read.has_place, read.refused
            assert any(words in read.refused for words in FROM_OTHERS), read.refused
        assert not read.left_out, read


def test_a_file_that_is_refused_is_told_with_its_place(tmp_path):
    """And what a robot names that is not there."""
    (tmp_path / "a").mkdir()
    (tmp_path / "a" / "bad.URDF").write_text('<robot name="a">\n<link/></robot>')
    mesh = '<visual><geometry><mesh filename="package://gone/x.stl"/></geometry></visual>'
    (tmp_path / "a" / "good.urdf").write_text(
        f'<robot name="a"><link name="l">{mesh}</link></robot>'
    )
    bad, good = robot_files.read_all(robot_files.urdfs_below([tmp_path]), with_meshes=True)
    assert bad.has_place
    assert ":2: link.name: missing attribute" in bad.refused
    assert not good.refused
    assert "package 'gone' not found" in good.left_out[0]
