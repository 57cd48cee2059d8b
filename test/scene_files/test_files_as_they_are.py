"""Robots' files as they are found: limits, names, blanks, addresses and other dialects."""

from __future__ import annotations

from pathlib import Path

import pytest

from scene_graph_ros.check import main
from scene_graph_ros.geometry import SceneGraph
from scene_graph_ros.robots.adjacency import adjacent_pairs
from scene_graph_ros.scene_files import load_srdf, load_urdf, register_robot, SceneFileError
from scene_graph_ros.scene_files.packages import Packages, resolve_resource

BALL = '<geometry><sphere radius="1"/></geometry>'


def arm(limit='<limit lower="-1" upper="1" velocity="1"/>', extra="", kind="revolute"):
    """Return a robot of one joint."""
    return (
        '<robot name="a"><link name="base"/><link name="arm"/>\n'
        f'<joint name="j" type="{kind}"><parent link="base"/><child link="arm"/>\n'
        f"{limit}\n{extra}</joint></robot>"
    )


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [
        (arm('<limit lower="1" upper="-1"/>'), 3, "lower, 1, is above upper, -1"),
        (arm('<limit lower="-1" upper="1" velocity="-2"/>'), 3, "must not be negative, got -2"),
        (arm('<limit lower="1_0" upper="20"/>'), 3, "expected a number, got '1_0'"),
        (
            arm(extra='<safety_controller soft_lower_limit="2" soft_upper_limit="3"/>'),
            4,
            "nothing",
        ),
        (arm(extra='<safety_controller soft_lower_limit="1" soft_upper_limit="-1"/>'), 4, "above"),
    ],
)
def test_limits_that_make_no_sense_are_refused_with_their_line(text, line, words):
    """No position is between them, or no speed."""
    with pytest.raises(SceneFileError, match=words) as error:
        load_urdf(text)
    assert f":{line}:" in str(error.value)


def test_a_joint_that_needs_limits_and_has_none_is_refused_by_check(tmp_path, capsys):
    """It can be used; but no program that writes URDF means it."""
    file = tmp_path / "arm.urdf"
    file.write_text(arm(limit=""))
    assert load_urdf(file).joints["j"].lower is None
    assert main([str(file)]) == 1
    assert "arm.urdf:2: joint['j']: a revolute joint needs a <limit>" in capsys.readouterr().err


def test_a_follower_that_leaves_its_leader_no_position_is_refused():
    """2 q + 5 for q in [-1, 1] is 3 to 7, which is not in [-1, 1]; 2 q + 3 just touches it."""
    two = arm().replace("</robot>", "") + (
        '<link name="finger"/><joint name="f" type="revolute"><parent link="arm"/>'
        '<child link="finger"/><limit lower="-1" upper="1"/>'
        '<mimic joint="j" multiplier="2" offset="{}"/></joint></robot>'
    )
    assert load_urdf(two.format(3)).joints["f"].mimic is not None
    with pytest.raises(SceneFileError, match="joint 'j' leads it to 3 to 7"):
        load_urdf(two.format(5))


def test_soft_limits_narrow_hard_ones_and_check_tells(tmp_path, capsys):
    """The narrowest of both ends; a pair of zeros, as some files have it, says nothing."""
    soft = '<safety_controller soft_lower_limit="-0.5" soft_upper_limit="2" k_velocity="1"/>'
    file = tmp_path / "arm.urdf"
    file.write_text(arm(extra=soft))
    joint = load_urdf(file).joints["j"]
    assert (joint.lower, joint.upper) == (-0.5, 1.0)
    assert main([str(file)]) == 0
    assert "narrows the limits to -0.5 to 1, from -1 to 1" in capsys.readouterr().out
    joint = load_urdf(arm(extra='<safety_controller k_velocity="1"/>')).joints["j"]
    assert (joint.lower, joint.upper) == (-1.0, 1.0)


@pytest.mark.parametrize("before", ["", "\n", " \t\r\n\n", "\ufeff"])
@pytest.mark.parametrize("after", ["", "\n", "\0", "\n\0\0"])
def test_blanks_before_and_a_nul_behind_are_passed_over(tmp_path, before, after):
    """As templates and programs in C leave them; lines are counted from the file's first."""
    text = f'{before}<?xml version="1.0"?>\n{arm()}{after}'
    file = tmp_path / "arm.urdf"
    file.write_bytes(text.encode())
    lines = before.count("\n") + 2
    for source in (text, file):
        assert load_urdf(source).links["base"].location.line == lines


def test_a_generated_name_is_one_that_is_free():
    """The second geometry would be called as the first is."""
    robot = load_urdf(
        f'<robot name="a"><link name="l"><collision name="l_collision_1">{BALL}</collision>'
        f'<collision>{BALL}</collision><collision name="l_collision_1">{BALL}</collision>'
        "</link></robot>"
    )
    names = [geometry.name for geometry in robot.links["l"].collisions]
    assert names == ["l_collision_1", "l_collision_1_2", "l_collision_2"]
    scene = SceneGraph()
    register_robot(robot, scene, scene.register_source("a"))


def test_chains_go_through_what_both_ends_have_above_them():
    """From tip to tip over the torso, up, and down."""
    text = '<robot name="y"><link name="torso"/>' + "".join(
        f'<link name="{side}{i}"/><joint name="{side}j{i}" type="continuous">'
        f'<parent link="{parent}"/><child link="{side}{i}"/></joint>'
        for side in "lr"
        for i, parent in ((1, "torso"), (2, f"{side}1"))
    )
    chains = {"across": ("l2", "r2"), "up": ("l2", "torso"), "down": ("torso", "r1"), "none": 2}
    chains["none"] = ("l1", "l1")
    groups = "".join(
        f'<group name="{n}"><chain base_link="{a}" tip_link="{b}"/></group>'
        for n, (a, b) in chains.items()
    )
    robot = load_urdf(text + "</robot>")
    srdf = load_srdf(f'<robot name="y">{groups}</robot>', robot)
    assert {name: set(joints) for name, joints in srdf.groups.items()} == {
        "across": {"lj1", "lj2", "rj1", "rj2"},
        "up": {"lj1", "lj2"},
        "down": {"rj1"},
        "none": set(),
    }


@pytest.mark.parametrize(
    "address",
    ["file:{}", "file://{}", "file://localhost{}", "{}", "package://cell/my%20part.stl"],
)
def test_addresses_with_blanks_and_of_this_machine(tmp_path, address):
    """%20 is a blank wherever no file is called so; the folder is called as its package."""
    folder = tmp_path / "cell" / "urdf"
    folder.mkdir(parents=True)
    part = tmp_path / "cell" / "my part.stl"
    part.write_text("solid")
    resource = address.format(str(part).replace(" ", "%20"))
    assert resolve_resource(resource, base=folder / "a.urdf", packages=Packages()) == part


@pytest.mark.parametrize("urdf", ["robot/a.urdf", "robot/x/a.urdf", "robot/x/y/a.urdf"])
def test_a_package_without_a_manifest_beside_its_urdf(tmp_path, urdf):
    """A folder that is called so, of one of the three folders above the file."""
    part = tmp_path / "robot" / "arm_description" / "part.stl"
    part.parent.mkdir(parents=True)
    part.write_text("solid")
    found = resolve_resource(
        "package://arm_description/part.stl", base=tmp_path / urdf, packages=Packages()
    )
    assert found == part


def test_a_file_that_is_called_with_a_percent_sign_is_that_file(tmp_path):
    """Only where it is not there the sign is an escape."""
    part = tmp_path / "a%20b.stl"
    part.write_text("solid")
    assert resolve_resource(str(part)) == part


def test_a_file_of_another_machine_is_refused():
    """There is no way to read it."""
    with pytest.raises(SceneFileError, match="'elsewhere' would be another machine"):
        resolve_resource("file://elsewhere/x.stl")


def test_a_pointer_of_git_lfs_is_named(tmp_path):
    """It says what to do, in place of an odd mesh."""
    part = tmp_path / "part.stl"
    part.write_text("version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 845429046\n")
    with pytest.raises(SceneFileError, match="git lfs pull"):
        resolve_resource(str(part))


def test_shapes_of_drake_are_read():
    """A capsule and an ellipsoid, whose words begin with their program's."""
    shapes = (
        '<drake:capsule radius="0.1" length="0.5"/>',
        '<drake:ellipsoid a="0.1" b="0.2" c="0.3"/>',
    )
    parts = "".join(f"<collision><geometry>{s}</geometry></collision>" for s in shapes)
    robot = load_urdf(
        '<robot name="a" xmlns:drake="http://drake.mit.edu"><link name="l">' + parts + "</link>"
        "</robot>"
    )
    found = [(g.shape.kind, g.shape.size) for g in robot.links["l"].collisions]
    assert found == [("capsule", (0.1, 0.5)), ("ellipsoid", (0.1, 0.2, 0.3))]
    scene = SceneGraph()
    register_robot(robot, scene, scene.register_source("a"))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("<mujoco/>", "MJCF"),
        ("<sdf/>", "SDF"),
        (arm(kind="spherical"), "Bullet's word for a ball joint"),
        (
            '<robot name="a"><link name="l"><collision><geometry><plane normal="0 0 1"/>'
            "</geometry></collision></link></robot>",
            "Bullet's word for a half space",
        ),
        (
            '<robot name="a"><link name="l"/><drake:joint name="j" type="ball"/></robot>',
            "a joint of Drake's",
        ),
    ],
)
def test_other_dialects_are_named(text, words):
    """Whose word it is, and what does the same."""
    with pytest.raises(SceneFileError, match=words):
        load_urdf(text)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (
            '<robot name="a"><link name="l"/><joint name="j" type="fixed"><parent link="world"/>'
            '<child link="l"/></joint></robot>',
            "no link 'world': Drake has such a link",
        ),
        ('<robot name="a"><deformable name="d"/></robot>', "<deformable>: it is Bullet's word"),
        (arm('<limit lower="${-pi}" upper="1"/>'), "limit.lower: '${-pi}' is for xacro"),
        (arm('<origin xyz="$(optenv XYZ 0 0 1)"/>'), "is for xacro; expand the file"),
    ],
)
def test_what_other_programs_expand_or_add_is_named(text, words):
    """Whose it is, and what to do."""
    with pytest.raises(SceneFileError) as error:
        load_urdf(text)
    assert words in str(error.value)


@pytest.mark.parametrize(
    "shape",
    ['<sphere radius="0.0"/>', '<box size="1 0 1"/>', '<mesh filename="x.stl" scale="1 1 0"/>'],
)
def test_a_size_of_nothing_costs_a_visual_alone(shape):
    """Some files switch a visual off by it; a collision of no size is refused, as before."""
    part = "<{0}><geometry>{1}</geometry></{0}>"
    body = part.format("collision", '<sphere radius="1"/>') + "\n" + part.format("visual", shape)
    robot = load_urdf(f'<robot name="a"><link name="l">{body}</link></robot>')
    assert (len(robot.links["l"].collisions), robot.links["l"].visuals) == (1, ())
    (warning,) = [text for text in robot.warnings if "left out" in text]
    assert ":2: link['l']/visual: a size of 0 shows nothing" in warning
    with pytest.raises(SceneFileError, match="must be"):
        load_urdf(
            f'<robot name="a"><link name="l">{part.format("collision", shape)}</link></robot>'
        )


def test_what_is_said_twice_is_told_where_it_agrees():
    """The first counts; a joint with two axes that differ is refused with both lines."""
    axes = '<axis xyz="0 1 0"/>\n<axis xyz="0 {} 0"/>'
    robot = load_urdf(arm(extra=axes.format("1")))
    assert robot.joints["j"].axis == (0.0, 1.0, 0.0)
    (remark,) = robot.warnings
    assert ":5: joint['j']/axis[1]: second <axis>, the first is in line 4, and says" in remark
    with pytest.raises(SceneFileError, match=r":5: .*second <axis>, the first is in line 4"):
        load_urdf(arm(extra=axes.format("-1")))


def test_slashes_before_names_are_passed_over():
    """Of links, joints, and what speaks of them, also in an SRDF."""
    robot = load_urdf(
        '<robot name="a"><link name="/base"/><link name="arm"/><link name="f"/>'
        '<joint name="/j" type="continuous"><parent link="base"/><child link="/arm"/></joint>'
        '<joint name="k" type="continuous"><parent link="/arm"/><child link="f"/>'
        '<mimic joint="/j"/></joint></robot>'
    )
    assert list(robot.links) == ["base", "arm", "f"]
    assert robot.joints["k"].mimic.joint == "j"
    srdf = load_srdf(
        '<robot name="a"><virtual_joint name="/v" type="planar" parent_frame="/odom"'
        ' child_link="/base"/><group name="g"><joint name="/j"/></group>'
        '<disable_collisions link1="/base" link2="/arm"/></robot>',
        robot,
    )
    assert srdf.virtual_joints[0].parent_frame == "odom"
    assert srdf.groups["g"] == ("j",)
    assert not srdf.warnings


def broken(tmp_path):
    """Return a robot with two parts that can't be read, and one that can."""
    (tmp_path / "part.stl").write_text("no mesh")
    file = tmp_path / "a.urdf"
    file.write_text(
        f'<robot name="a"><link name="l"><collision>{BALL}</collision>\n'
        '<visual><geometry><sphere radius="-1"/></geometry></visual>\n'
        '<visual><geometry><mesh filename="gone.stl"/></geometry></visual></link></robot>'
    )
    return file


def test_what_can_not_be_read_costs_itself_where_the_user_says_so(tmp_path, capsys):
    """Else all of the robot; never in silence."""
    file = broken(tmp_path)
    with pytest.raises(SceneFileError, match="radius"):
        load_urdf(file)
    robot = load_urdf(file, skip_unreadable=True)
    assert (len(robot.links["l"].collisions), robot.links["l"].visuals) == (1, ())
    left_out = [text for text in robot.warnings if text.endswith("left out")]
    assert [f":{line}:" in text for line, text in zip((2, 3), left_out, strict=True)] == [True] * 2
    scene = tmp_path / "scene.yaml"
    scene.write_text("version: 1\nrobots: [{name: a, urdf: a.urdf, skip_unreadable: true}]\n")
    assert main([str(scene)]) == 0
    assert "a.urdf:2" in capsys.readouterr().err


PILLAR = (
    '<robot name="p"><link name="base"/>'
    f'<link name="pillar"><collision>{BALL}</collision></link>'
    f'<link name="arm"><collision>{BALL}</collision></link><link name="wrist"/>'
    f'<link name="hand"><collision>{BALL}</collision></link>'
    '<joint name="p" type="fixed"><parent link="base"/><child link="pillar"/></joint>'
    '<joint name="a" type="continuous"><parent link="base"/><child link="arm"/></joint>'
    '<joint name="w" type="continuous"><parent link="arm"/><child link="wrist"/></joint>'
    '<joint name="h" type="continuous"><parent link="wrist"/><child link="hand"/></joint></robot>'
)


def test_a_pillar_is_checked_against_the_first_link_that_moves(tmp_path, capsys):
    """The base, without geometry, can't move, and passes nothing on; the wrist does."""
    assert adjacent_pairs(load_urdf(PILLAR)) == {("arm", "hand")}
    (tmp_path / "p.urdf").write_text(PILLAR)
    scene = tmp_path / "scene.yaml"
    scene.write_text("version: 1\nrobots: [{name: p, urdf: p.urdf, filter_adjacent: true}]\n")
    assert main([str(scene)]) == 0
    assert "note: robot 'p': 'arm' and 'hand' are adjacent" in capsys.readouterr().out


def test_an_error_in_what_is_imported_late_is_not_hidden(monkeypatch):
    """An AttributeError inside would be taken for a name that is not there."""
    import importlib

    import scene_graph_ros.scene_files as package

    def fails(name):
        raise AttributeError("module 'numpy' has no attribute 'bool8'")

    monkeypatch.delitem(vars(package), "load_urdf", raising=False)
    monkeypatch.setattr(importlib, "import_module", fails)
    with pytest.raises(ImportError, match=r"scene_files\.urdf can't be imported: .*bool8"):
        package.load_urdf  # noqa: B018


def test_folder_of_the_tests_is_no_package():
    """A name that no folder above has is not found."""
    with pytest.raises(SceneFileError, match="not found"):
        Packages().find("no_such_package", near=Path(__file__))
