"""The command that checks files, run as a user runs it."""

import json
import os
from pathlib import Path
import subprocess
import sys

from checking import check, write
import pytest

from scene_graph_ros.check import main

ROOT = Path(__file__).parents[2]
CELL = ROOT / "config" / "scenes" / "panda_cell.yaml"
ROBOTS = "package://example-robot-data/robots"
URDF = '<robot name="r"><link name="a"/><link name="b"/>{}</robot>'
JOINT = '<joint name="j" type="fixed"><parent link="a"/><child link="b"/></joint>'


def test_as_a_process_without_ros():
    """The module runs as a command, prints a summary, and imports no ROS."""
    code = (
        "import runpy, sys\n"
        "try:\n"
        "    runpy.run_module('scene_graph_ros.check', run_name='__main__', alter_sys=True)\n"
        "finally:\n"
        "    assert 'rclpy' not in sys.modules\n"
    )
    command = [sys.executable, "-c", code, str(CELL)]
    done = subprocess.run(command, capture_output=True, text=True, cwd=ROOT, check=False)
    # 14 anchored geometries and 9 on 8 frames; the Panda has 17 collision and 11 visual
    # elements on 11 links with geometry.
    assert (done.returncode, done.stderr) == (0, "")
    assert "scene ok: 3 sources, 19 frames, 51 geometries (40 with proximity role)" in done.stdout


def test_several_files_and_an_srdf_after_its_urdf(capsys):
    """Each file gets a line; the SRDF is read with the URDF before it."""
    urdf = f"{ROBOTS}/panda_description/urdf/panda.urdf"
    srdf = f"{ROBOTS}/panda_description/srdf/panda.srdf"
    status, out, err = check(capsys, CELL, urdf, srdf)
    assert (status, err) == (0, [])
    assert out[1].startswith(f"{urdf}: URDF ok: robot 'panda', 13 links, 9 movable joints, ")
    assert (
        out[2] == f"{srdf}: SRDF ok: for robot 'panda', 35 filtered pairs of links, 1 group state"
    )


def test_filtered_pairs_are_counted_by_geometry(capsys, tmp_path):
    """Two shapes on one link and one on the other make two filtered pairs."""
    sphere = '<collision><geometry><sphere radius="1"/></geometry></collision>'
    text = URDF.format(JOINT).replace('name="a"/>', f'name="a">{sphere * 2}</link>', 1)
    text = text.replace('name="b"/>', f'name="b">{sphere}</link>', 1)
    write(tmp_path, "r.urdf", text)
    pair = '<disable_collisions link1="a" link2="b"/>'
    write(tmp_path, "r.srdf", f"<robot>{pair}</robot>")
    scene = "version: 1\nrobots: [{name: r, urdf: r.urdf, srdf: r.srdf}]\n"
    status, (line,), _ = check(capsys, write(tmp_path, "s.yaml", scene))
    assert status == 0
    assert line.endswith(
        "1 source, 2 frames, 3 geometries (3 with proximity role), 2 filtered pairs"
    )


def test_mistakes_go_to_stderr_and_the_status(capsys, tmp_path):
    """One bad file of two gives status 1, all its problems, and still the other's summary."""
    bad = write(tmp_path, "bad.yaml", "version: 1\nsources: [{nam: a}]\nx: 1\n")
    status, out, err = check(capsys, bad, CELL)
    assert status == 1
    assert err == [
        f"error: {bad}:2: sources[0].name: missing",
        f"error: {bad}:2: sources[0].nam: unknown key",
        f"error: {bad}:3: x: unknown key",
    ]
    assert out[0] == f"{bad}: scene not usable: 3 errors"
    assert "scene ok" in out[1]


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("r.urdf", URDF.format(""), ":1: expected one root link, got 'a', 'b'"),
        ("r.srdf", "<robot/>", ": name the robot's URDF before its SRDF"),
        ("r.urdf", "<robot>", ":1: not well-formed XML: no element found"),
        ("r.txt", "v 0 0 0", ": is neither YAML (named .yaml or .yml) nor a URDF or SRDF"),
        ("r.yaml", "a: [", ":1: not YAML: "),
        (
            "r.yaml",
            "version: 1\neffects:\n  point_contacts: off\n",
            ":3: effects.point_contacts: no effect 'point_contacts'; did you mean 'point_con",
        ),
    ],
)
def test_places_of_mistakes(capsys, tmp_path, name, text, message):
    """Each kind of file has its mistakes named with their line."""
    file = write(tmp_path, name, text)
    status, _, err = check(capsys, file)
    assert status == 1
    assert err[0].startswith(f"error: {file}{message}")


HEAD = "version: 1\nsources:\n"
FRAME = "frames: [{name: f, source: s}]\n"
PLANES = """
geometries:
  - {name: floor, source: s, shape: {type: half_space}}
  - {name: wall, source: s, frame: f, shape: {type: half_space}}
"""


@pytest.mark.parametrize(
    ("text", "place", "message"),
    [
        (HEAD + " - {name: two words}\nframes: [{name: f, source: two words}]", 3, "'two words'"),
        (HEAD + " - name: s\n   poses: {topic: two words!}\n" + FRAME, 4, "'two words!'"),
        (HEAD + " - name: s\n   poses: {topic: ~/contacts}\n" + FRAME, 4, "the node itself"),
        (
            HEAD + " - name: s\n   configurations: {topic: a b}\ngeometries:\n - {name: g, source:"
            " s, shape: {type: box, size: [1, 1, 1]}, deformable: {}}",
            4,
            "'a b'",
        ),
        (
            HEAD + " - {name: a, poses: {topic: t}}\n - name: b\n   poses: {topic: t, type:"
            " geometry_msgs/msg/PoseStamped}\n" + FRAME.replace("source: s", "source: a"),
            5,
            "source 'a' uses it for sensor_msgs/msg/MultiDOFJointState",
        ),
        (HEAD + " - {name: s}\n" + FRAME + PLANES, 6, "'s/f/wall' and geometry 's/world/floor'"),
        (HEAD + ' - {name: "a\\nb"}', 3, "printable"),
    ],
)
def test_what_would_harm_others_in_a_node_is_found(capsys, tmp_path, text, place, message):
    """Topics that can't be subscribed to, and pairs that have no answer, with their line."""
    status, _, err = check(capsys, write(tmp_path, "s.yaml", text))
    assert status == 1
    (line,) = [line for line in err if line.startswith("error:")]
    assert f"s.yaml:{place}: " in line
    assert message in line


def test_a_name_that_makes_no_topic_is_fine_with_one(capsys, tmp_path):
    """With a topic of its own, or where no poses are read; a filtered pair is fine, too."""
    text = HEAD + " - {name: Robot 1, poses: {topic: r}}\n - {name: table-top}\n - {name: s}\n"
    text += "frames: [{name: f, source: s}, {name: f, source: Robot 1}]" + PLANES
    text += "collision_filters: [{between: [[s/f], [s/world]]}]\n"
    status, _, err = check(capsys, write(tmp_path, "s.yaml", text))
    assert (status, err) == (0, [])


def test_missing_file(capsys):
    """A file that is not there is an error, not a crash."""
    status, _, err = check(capsys, "/no/such/scene.yaml")
    assert status == 1
    assert err == ["error: '/no/such/scene.yaml': no such file"]


PARAMETERS = """\
/**:
  ros__parameters:
    use_sim_time: true
    qos_overrides./tf.subscription.depth: 3
cell:
  scene_graph:
    ros__parameters:
      {}
other_node:
  ros__parameters:
    anything: 1
"""


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("marker_rate: -3.0", "marker_rate: must be at least 0.01, not -3.0"),
        ("marker_rate: fast", "marker_rate: must be a number, not 'fast'"),
    ],
)
def test_parameters_of_the_node(capsys, tmp_path, line, message):
    """Values are checked against the node's own table, at their line."""
    file = write(tmp_path, "p.yaml", PARAMETERS.format(line))
    status, _, err = check(capsys, file)
    assert status == 1
    assert err[0].startswith(f"error: {file}:8: cell.scene_graph.ros__parameters.{message}")
    assert err[1] == f"warning: {file}:10: other_node.ros__parameters: another node's, not checked"


def test_a_parameter_that_nothing_declares_is_a_warning(capsys, tmp_path):
    """And an error with --strict; the others are checked all the same."""
    file = write(tmp_path, "p.yaml", PARAMETERS.format("{marker_rat: 3.0, max_update_rate: 10.0}"))
    status, _, err = check(capsys, file)
    assert status == 0
    assert err[0].startswith(
        f"warning: {file}:8: cell.scene_graph.ros__parameters.marker_rat: nothing declares this"
        " parameter; did you mean 'marker_r"
    )
    assert check(capsys, "--strict", file)[0] == 1


def test_parameters_that_contradict_each_other(capsys, tmp_path):
    """Values that are fine one by one are checked together."""
    values = "{min_update_rate: 100.0, max_update_rate: 50.0}"
    text = PARAMETERS.format("").replace(
        "ros__parameters:\n      \n", f"ros__parameters: {values}\n"
    )
    status, _, err = check(capsys, write(tmp_path, "p.yaml", text))
    assert status == 1
    assert ":7: cell.scene_graph.ros__parameters: min_update_rate 100.0 must not be gr" in err[0]


def test_scene_named_by_parameters_is_checked_too(capsys, tmp_path):
    """A mistake in the scene is reported with both places."""
    scene = write(tmp_path, "s.yaml", "version: 3\n")
    file = write(tmp_path, "p.yaml", PARAMETERS.format(f"scene: {scene}"))
    status, _, err = check(capsys, file)
    assert status == 1
    place = f"{file}:8: cell.scene_graph.ros__parameters.scene"
    assert err[0] == f"error: {place}: {scene}:1: version: must be 1, got 3"


def test_strict_and_quiet(capsys, tmp_path):
    """A warning fails only under --strict; --quiet prints nothing where all is well."""
    file = write(tmp_path, "r.urdf", URDF.format(JOINT.replace("</j", '<mimic joint="k"/></j')))
    assert check(capsys, file)[0] == 0
    assert check(capsys, "--quiet", file) == (0, [], [])
    status, out, err = check(capsys, "--strict", file)
    assert status == 1
    assert out == [f"{file}: URDF not usable: 0 errors, 1 warning"]
    assert err[0].startswith(f"warning: {file}:1: joint['j']/mimic: ignored")


def test_packages_on_the_command_line(capsys, tmp_path):
    """A package can be mapped, or searched in a folder."""
    (tmp_path / "stock").mkdir()
    write(tmp_path / "stock", "r.urdf", URDF.format(JOINT))
    address = "package://stock/r.urdf"
    assert check(capsys, address)[0] == 1
    assert check(capsys, "--package", f"stock={tmp_path / 'stock'}", address)[0] == 0
    assert check(capsys, "--package-path", tmp_path, address)[0] == 0


MERGES = "\n".join(
    [
        "a0: &a0 {k: 0}",
        *(f"a{i}: &a{i} {{<<: [{', '.join([f'*a{i - 1}'] * 10)}]}}" for i in range(1, 11)),
    ]
)


@pytest.mark.parametrize(
    ("name", "contents", "message"),
    [
        ("s.yaml", MERGES.encode(), "s.yaml:1: version: missing"),
        ("s.yaml", b"[" * 2000, "s.yaml:1: not YAML: nested more than 100 deep"),
        ("r.urdf", b"<robot>" + b"\n<a>" * 60_000, "r.urdf:101: <a>: nested more than 100 deep"),
        (
            "r.urdf",
            b"<?xml version='1.0' encoding='nosuch'?><robot/>",
            "r.urdf: cannot be read as XML: unknown encoding",
        ),
    ],
)
def test_files_that_explode_are_refused_without_a_traceback(
    capsys, tmp_path, name, contents, message
):
    """Each is refused with its place and the limit, and the command ends with 1."""
    (tmp_path / name).write_bytes(contents)
    status, out, err = check(capsys, tmp_path / name)
    assert status == 1
    assert len(out) == 1
    assert message in err[0]


def test_files_that_never_end_are_refused(capsys, tmp_path):
    """A pipe, a device and a file of 40 GB are named with what is wrong with them."""
    os.mkfifo(tmp_path / "pipe.yaml")
    with (tmp_path / "sparse.yaml").open("wb") as file:
        file.truncate(40 * 2**30)
    files = [tmp_path / "pipe.yaml", "/dev/zero", tmp_path / "sparse.yaml"]
    status, _, err = check(capsys, *files)
    assert status == 1
    assert [line.rpartition(": ")[2] for line in err] == [
        "is no regular file",
        "is no regular file",
        "has 42949672960 bytes, the limit is 33554432",
    ]


@pytest.mark.parametrize("arguments", [[], ["--package", "a", "f"], ["--nonsense"]])
def test_wrong_calls(capsys, arguments):
    """A wrong call ends with 2 and says how to call."""
    with pytest.raises(SystemExit) as caught:
        main(arguments)
    assert caught.value.code == 2
    assert "usage: python -m scene_graph_ros.check" in capsys.readouterr().err


def test_help(capsys):
    """--help ends with 0 and names all options."""
    with pytest.raises(SystemExit) as caught:
        main(["--help"])
    assert caught.value.code == 0
    text = capsys.readouterr().out
    for option in ("--package", "--package-path", "--strict", "--quiet", "--schema"):
        assert option in text


def test_schema(capsys):
    """--schema prints JSON that knows the keys of a scene and its ten shapes."""
    assert main(["--schema"]) == 0
    schema = json.loads(capsys.readouterr().out)
    assert schema["required"] == ["version"]
    assert {"sources", "robots", "geometries"} <= set(schema["properties"])
    mapping = schema["$defs"]["GeometrySpec"]["properties"]["shape"]["discriminator"]["mapping"]
    assert len(mapping) == 11


PROPERTIES = """version: 1
sources: [{name: s}]
geometries:
  - name: g
    source: s
    shape: {type: sphere, radius: 1}
    roles:
      proximity:
        mesh: {represntation: triangles}
        hydroelastc: {margin: 0}
        material: {colour: 3}
        own: {anything: 1}
      illustration: {phong: {difuse: [1, 0, 0]}}
"""


def test_properties_that_nothing_reads_are_named(capsys, tmp_path):
    """Of known groups, and groups that are nearly called so; errors where that is asked for."""
    scene = write(tmp_path, "scene.yaml", PROPERTIES)
    place = "geometries[0].roles"
    told = [
        f"{scene}:9: {place}.proximity.mesh.represntation: group 'mesh' has no property"
        " 'represntation'; did you mean 'representation'?",
        f"{scene}:10: {place}.proximity.hydroelastc: no group of properties that anything reads;"
        " did you mean 'hydroelastic'?",
        f"{scene}:11: {place}.proximity.material.colour: group 'material' has no property"
        " 'colour'; it has dynamic_friction, hunt_crossley_dissipation, point_contact_stiffness,"
        " relaxation_time, static_friction",
        f"{scene}:13: {place}.illustration.phong.difuse: group 'phong' has no property 'difuse';"
        " did you mean 'diffuse'?",
    ]
    status, _, err = check(capsys, scene)
    assert (status, err) == (0, [f"warning: {each}" for each in told])
    assert check(capsys, "--strict", scene)[0] == 1


OF_NODES = """/cell/scene_graph:
  ros__parameters: {marker_rate: 10}
/**:
  ros__parameters: {accuracy: quick}
scene_graph:
  ros__parameters: {min_update_rate: 5.0}
"""


def test_which_parameters_a_node_of_a_name_takes(capsys, tmp_path):
    """With its namespace; what is for others is named, too."""
    file = write(tmp_path, "parameters.yaml", OF_NODES)
    node = "/cell/scene_graph"
    status, out, err = check(capsys, "--node", node, file)
    assert status == 0
    assert [line.partition(": ")[2].partition(": ")[2] for line in out[:2]] == [
        f"/cell/scene_graph.ros__parameters: {node} takes marker_rate",
        f"/**.ros__parameters: {node} takes accuracy",
    ]
    assert out[2] == f"{file}: parameters ok: 2 parameters, 1 warning"
    assert len(err) == 1
    assert err[0].endswith(f"{node} takes none of these, which are for /scene_graph")
    assert check(capsys, "--strict", "--node", node, file)[0] == 1
    other = write(tmp_path, "other.yaml", "a: {ros__parameters: {scene: x}}")
    _, _, err = check(capsys, "--node", "cell/scene_graph", other)
    assert err[-1] == f"warning: {other}: {node} takes nothing of this file"
