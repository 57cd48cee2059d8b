"""URDF: what is read, and where it is wrong."""

import math

import numpy as np
import pytest

from scene_graph_ros.located import SceneFileError
from scene_graph_ros.robots.robot_parts import JointType, MeshFile, PrimitiveShape
from scene_graph_ros.scene_files.urdf import load_urdf

ARM = """<robot name="arm">
  <material name="red"><color rgba="1 0 0 1"/></material>
  <link name="base">
    <collision name="foot">
      <origin xyz="0.1 0.2 0.3" rpy="0 0 1.5707963267948966"/>
      <geometry><box size="1 2 3"/></geometry>
    </collision>
    <collision name="foot"><geometry><sphere radius="0.5"/></geometry></collision>
    <visual><geometry><cylinder radius="0.1" length="0.7"/></geometry>
      <material name="red"/></visual>
    <visual>
      <geometry><capsule radius="0.2" length="0.4"/></geometry>
      <material name="own"><color rgba="0 0.5 1 0.25"/></material>
    </visual>
  </link>
  <link name="tip"><visual><geometry><box size="1 1 1"/></geometry>
      <material name="own"/></visual></link>
  <link name="finger"/>
  <link name="other_finger"/>
  <joint name="turn" type="revolute">
    <parent link="base"/><child link="tip"/>
    <origin xyz="0 0 1"/><axis xyz="0 3 4"/><limit lower="-1" upper="2" effort="1" velocity="1"/>
  </joint>
  <joint name="slide" type="prismatic">
    <parent link="tip"/><child link="finger"/>
    <limit upper="0.04" effort="1" velocity="1"/>
  </joint>
  <joint name="follow" type="prismatic">
    <parent link="tip"/><child link="other_finger"/>
    <mimic joint="slide" multiplier="-1" offset="0.5"/>
  </joint>
  <transmission name="t"><joint name="turn"/></transmission>
</robot>"""


def chain(joint="", link="", tail=""):
    """Return a URDF of two links a and b; the joint's content starts in line 4."""
    return (
        f'<robot name="r">\n<link name="a">{link}</link><link name="b"/>\n'
        f'<joint name="j" type="revolute"><parent link="a"/><child link="b"/>\n{joint}</joint>\n'
        f"{tail}</robot>"
    )


def error_of(text):
    """Return the message with which a URDF is refused."""
    with pytest.raises(SceneFileError) as caught:
        load_urdf(text)
    return str(caught.value)


def test_links_and_their_geometry():
    """Shapes keep URDF's sizes, poses are roll-pitch-yaw, and names are made unique."""
    base = load_urdf(ARM).links["base"]
    first, second = base.collisions
    assert (first.name, second.name) == ("foot", "base_collision_1")
    assert first.shape == PrimitiveShape("box", (1.0, 2.0, 3.0))
    assert second.shape == PrimitiveShape("sphere", (0.5,))
    # A quarter turn about z sends x to y.
    expected = [[0, -1, 0, 0.1], [1, 0, 0, 0.2], [0, 0, 1, 0.3], [0, 0, 0, 1]]
    np.testing.assert_allclose(first.X_LG, expected, atol=1e-15)
    np.testing.assert_array_equal(second.X_LG, np.eye(4))
    shapes = [visual.shape for visual in base.visuals]
    assert shapes == [
        PrimitiveShape("cylinder", (0.1, 0.7)),
        PrimitiveShape("capsule", (0.2, 0.4)),
    ]


def test_materials_by_name_wherever_they_are_defined():
    """A colour is the element's own, the robot's, or that of another link's material."""
    robot = load_urdf(ARM)
    assert [v.rgba for v in robot.links["base"].visuals] == [(1, 0, 0, 1), (0, 0.5, 1, 0.25)]
    assert robot.links["tip"].visuals[0].rgba == (0, 0.5, 1, 0.25)
    assert robot.links["base"].collisions[0].rgba is None
    assert robot.warnings == ()


def test_joints():
    """Types, unit axes, limits, mimicry and the tree's root come out as written."""
    robot = load_urdf(ARM)
    turn, slide, follow = (robot.joints[n] for n in ("turn", "slide", "follow"))
    assert robot.root == "base"
    assert (turn.type, turn.axis) == (JointType.REVOLUTE, (0.0, 0.6, 0.8))
    assert (turn.lower, turn.upper) == (-1.0, 2.0)
    assert (slide.lower, slide.upper) == (0.0, 0.04)
    assert slide.axis == (1.0, 0.0, 0.0)
    assert (follow.mimic.joint, follow.mimic.multiplier, follow.mimic.offset) == ("slide", -1, 0.5)
    assert robot.parent_joint("tip") is turn
    assert robot.parent_joint("base") is None


def test_parents_come_before_children_whatever_the_order_in_the_file():
    """Joints are sorted from the root outward."""
    text = """<robot><link name="c"/><link name="b"/><link name="a"/>
      <joint name="bc" type="fixed"><parent link="b"/><child link="c"/></joint>
      <joint name="ab" type="fixed"><parent link="a"/><child link="b"/></joint></robot>"""
    assert list(load_urdf(text).joints) == ["ab", "bc"]


def test_mesh_paths_and_scale(tmp_path):
    """A mesh is found relative to the file; one that is not there is a warning with its place."""
    (tmp_path / "part.stl").write_bytes(b"solid\nendsolid\n")
    mesh = '<geometry><mesh filename="{}" scale="1 -2 0.5"/></geometry>'
    link = "".join(
        f"<collision>{mesh.format(name)}</collision>\n" for name in ("part.stl", "gone.stl")
    )
    file = tmp_path / "robot.urdf"
    file.write_text(f'<robot><link name="a">{link}</link></robot>')
    robot = load_urdf(file)
    found, gone = (geometry.shape for geometry in robot.links["a"].collisions)
    assert found == MeshFile("part.stl", (1.0, -2.0, 0.5), tmp_path / "part.stl")
    assert gone.path is None
    (warning,) = robot.warnings
    place = f"{file}:2: link['a']/collision[1]/geometry/mesh.filename: "
    assert warning == f"{place}'gone.stl' means {tmp_path / 'gone.stl'}: no such file"


@pytest.mark.parametrize(
    ("shape", "message"),
    [
        ('<box size="1 2"/>', "geometry/box.size: expected 3 numbers, got '1 2'"),
        ('<box size="1 0 2"/>', "geometry/box.size: must be positive, got '1 0 2'"),
        ("<box/>", "geometry/box.size: missing attribute"),
        ('<sphere radius="-0.1"/>', "geometry/sphere.radius: must be positive, got -0.1"),
        ('<sphere radius="big"/>', "geometry/sphere.radius: expected a number, got 'big'"),
        ('<cylinder radius="1"/>', "geometry/cylinder.length: missing attribute"),
        (
            '<capsule radius="1" length="0"/>',
            "geometry/capsule.length: must be positive, got 0",
        ),
        ("<mesh/>", "geometry/mesh.filename: missing attribute"),
        (
            '<mesh filename="m.stl" scale="1 0 1"/>',
            "geometry/mesh.scale: must be at least 1e-08 in magnitude, got '1 0 1'",
        ),
        (
            "<cone/>",
            "geometry: expected one of box, sphere, cylinder, capsule, mesh, drake:capsule, "
            "drake:ellipsoid, got <cone>",
        ),
        (
            "",
            "geometry: expected one of box, sphere, cylinder, capsule, mesh, drake:capsule, "
            "drake:ellipsoid, got nothing",
        ),
    ],
)
def test_shapes_are_refused_with_their_place(shape, message):
    """Each wrong shape is named with line, element, attribute and value."""
    text = chain(link=f"<collision>\n<geometry>{shape}</geometry></collision>")
    assert error_of(text).startswith(f"<text>:3: link['a']/collision/{message}")


@pytest.mark.parametrize(
    ("joint", "message"),
    [
        ('<axis xyz="0 0 0"/>', "4: joint['j']/axis.xyz: must not be zero, got '0 0 0'"),
        ('<origin rpy="0 0"/>', "4: joint['j']/origin.rpy: expected 3 numbers, got '0 0'"),
        ('<limit lower="low"/>', "4: joint['j']/limit.lower: expected a number, got 'low'"),
        ("<mimic/>", "4: joint['j']/mimic.joint: missing attribute"),
        ('<mimic joint="j"/>', "3: joint['j']/mimic: joints mimic each other: j -> j"),
        ('<parent link="b"/>', "4: joint['j']/parent[1]: second <parent>, the first is in line 3"),
    ],
)
def test_joints_are_refused_with_their_place(joint, message):
    """Each wrong joint is named with line, element, attribute and value."""
    assert error_of(chain(joint=joint)).startswith(f"<text>:{message}")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("<sdf/>", "<text>:1: expected <robot>, got <sdf>"),
        ("<robot/>", "<text>:1: no <link>"),
        ("<robot>\n<link/></robot>", "<text>:2: link.name: missing attribute"),
        (
            '<robot><link name="a"/>\n<link name="a"/></robot>',
            "<text>:2: link['a']: the name is taken by line 1",
        ),
        (
            '<robot><link name="a"/><link name="b"/></robot>',
            "<text>:1: expected one root link, got 'a', 'b'",
        ),
        (
            chain().replace('type="revolute"', 'type="hinge"'),
            "<text>:3: joint['j'].type: expected one of fixed, revolute, continuous, prismatic,"
            " planar, floating, got 'hinge'",
        ),
        (
            chain().replace('<child link="b"/>', ""),
            "<text>:3: joint['j']: missing <child>",
        ),
        (
            chain().replace('parent link="a"', 'parent link="arm_base"'),
            "<text>:3: joint['j']/parent: no link 'arm_base'",
        ),
        (
            chain(tail='<joint name="k" type="fixed"><parent link="a"/><child link="b"/></joint>'),
            "<text>:5: joint['k']/child: link 'b' is already moved by joint 'j' in line 3",
        ),
        (
            chain(tail='<joint name="k" type="fixed"><parent link="b"/><child link="a"/></joint>'),
            "<text>:1: expected one root link, got none: the joints form a loop",
        ),
        (
            chain(
                tail='<link name="c"/><link name="d"/>'
                '<joint name="k" type="fixed"><parent link="c"/><child link="d"/></joint>'
                '<joint name="l" type="fixed"><parent link="d"/><child link="c"/></joint>'
            ),
            "<text>:5: joint['k']: is part of a loop of joints",
        ),
        (
            '<robot>\n<material name="m"><color rgba="0 0 2 1"/></material></robot>',
            "<text>:2: material['m']/color.rgba: must be between 0 and 1, got '0 0 2 1'",
        ),
    ],
)
def test_robots_are_refused_with_their_place(text, message):
    """What is wrong with the robot as a whole is named with its line and names."""
    assert error_of(text).startswith(message)


def test_mimic_chain_through_a_joint_without_position():
    """A joint cannot follow one that does not move."""
    tail = """<link name="c"/>
      <joint name="k" type="prismatic"><parent link="b"/><child link="c"/>
      <mimic joint="j"/></joint>"""
    text = chain(tail=tail).replace('name="j" type="revolute"', 'name="j" type="fixed"')
    assert "joint['k']/mimic: joint 'j' is fixed and has no position to mimic" in error_of(text)


def test_near_names_are_suggested():
    """A misspelt link is answered with the one that was probably meant."""
    text = chain().replace('name="a"', 'name="shoulder"').replace('link="a"', 'link="sholder"')
    assert error_of(text).endswith("no link 'sholder'; did you mean 'shoulder'?")


def test_meaningless_mimic_and_unknown_material_are_warnings():
    """What changes nothing is said, not refused."""
    text = chain(
        joint='<mimic joint="k"/>',
        link='<visual><geometry><sphere radius="1"/></geometry><material name="x"/></visual>',
    ).replace('type="revolute"', 'type="fixed"')
    warnings = load_urdf(text).warnings
    assert warnings == (
        "<text>:2: link['a']/visual/material['x']: no material of this name has a color",
        "<text>:4: joint['j']/mimic: ignored, as a fixed joint has no position",
    )


def test_mimicry_of_a_joint_that_is_gone_is_a_warning():
    """A joint that mimics one that was cut away moves on its own, and a near name is offered."""
    robot = load_urdf(chain(joint='<mimic joint="jj"/>'))
    assert robot.joints["j"].mimic is None
    expected = "<text>:3: joint['j']/mimic: ignored, as there is no joint 'jj'; did you mean 'j'?"
    assert robot.warnings == (expected,)


def test_long_chains_of_mimicry_take_no_time():
    """Three thousand joints that mimic the next one are checked one by one, not in all pairs."""
    count = 3000
    joints = [
        f'<link name="l{i}"/><joint name="j{i}" type="prismatic"><parent link="base"/>'
        f'<child link="l{i}"/><mimic joint="j{i + 1}"/></joint>'
        for i in range(count)
    ]
    text = f'<robot name="r"><link name="base"/>{"".join(joints)}</robot>'
    robot = load_urdf(text)
    assert len(robot.warnings) == 1
    assert robot.joints["j0"].mimic.joint == "j1"


def test_missing_file_is_named():
    """A path that leads nowhere is quoted as given."""
    with pytest.raises(SceneFileError, match=r"'nowhere/robot\.urdf': no such file"):
        load_urdf("nowhere/robot.urdf")


def test_angles_are_radians_about_fixed_axes():
    """Rpy = (a, b, c) means Rz(c) Ry(b) Rx(a), checked on the image of z."""
    a, b, c = 0.3, -0.7, 1.1
    text = chain(joint=f'<origin rpy="{a} {b} {c}"/>')
    R = load_urdf(text).joints["j"].X_PC[:3, :3]
    # Rx(a) z = (0, -sin a, cos a); Ry(b) and Rz(c) then turn that by hand.
    x, y, z = 0.0, -math.sin(a), math.cos(a)
    x, z = math.cos(b) * x + math.sin(b) * z, -math.sin(b) * x + math.cos(b) * z
    x, y = math.cos(c) * x - math.sin(c) * y, math.sin(c) * x + math.cos(c) * y
    np.testing.assert_allclose(R[:, 2], [x, y, z], atol=1e-15)


INERTIAL = """<inertial><origin xyz="1 2 3" rpy="0 0 1.5707963267948966"/><mass value="2"/>
<inertia ixx="1" ixy="0.1" ixz="0.2" iyy="3" iyz="0.3" izz="5"/></inertial>"""


def test_a_links_inertia_is_given_in_its_own_axes():
    """A quarter turn about z swaps x and y, and turns the signs of what is mixed with one."""
    inertial = load_urdf(chain(link=INERTIAL)).links["a"].inertial
    assert inertial.mass == 2.0
    assert inertial.p_LI.tolist() == [1.0, 2.0, 3.0]
    wanted = [[3.0, -0.1, -0.3], [-0.1, 1.0, 0.2], [-0.3, 0.2, 5.0]]
    np.testing.assert_allclose(inertial.I_L, wanted, atol=1e-15)


@pytest.mark.parametrize(
    ("bad", "words"),
    [
        (('<mass value="2"/>', ""), "missing <mass>"),
        (('value="2"', 'value="-2"'), "mass.value: must not be negative, got -2"),
        (('ixy="0.1"', ""), "inertia.ixy: missing attribute"),
    ],
)
def test_an_inertia_that_cannot_be_is_a_warning(bad, words):
    """Who asks for geometry is not stopped: the link has no inertia then."""
    robot = load_urdf(chain(link=INERTIAL.replace(*bad)))
    assert robot.links["a"].inertial is None
    assert robot.links["b"].inertial is None
    assert any(words in warning for warning in robot.warnings)
