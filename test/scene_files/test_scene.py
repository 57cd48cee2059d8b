"""Scene files: every mistake is named with file, line, path and value."""

import textwrap

import pytest

from scene_graph_ros.scene_files import load_scene, load_scene_text, SceneFileError

HEAD = "version: 1\nsources: [{name: cell}]\n"
GEOMETRY = HEAD + "geometries:\n  - {name: g, source: cell, shape: {type: sphere, radius: 1}}\n"


def problems_of(text):
    """Return the lines with which a scene is refused."""
    with pytest.raises(SceneFileError) as caught:
        load_scene_text(textwrap.dedent(text), label="f")
    return caught.value.problems


def shape(body):
    """Return a scene whose only shape is in line 4."""
    return f"{HEAD}geometries:\n  - {{name: g, source: cell, shape: {{{body}}}}}\n"


@pytest.mark.parametrize(
    ("body", "message"),
    [
        ("type: sphere, radius: -0.1", "shape.radius: must be positive, got -0.1"),
        ("type: sphere, radius: 0", "shape.radius: must be positive, got 0"),
        ("type: sphere, radius: .nan", "shape.radius: must be finite, got nan"),
        ("type: sphere, radius: 1e10", "shape.radius: must be at most 1e+09, got 10000000000.0"),
        ("type: sphere, radius: big", "shape.radius: must be a number, got 'big'"),
        ("type: sphere, radius: true", "shape.radius: must be a number, got True"),
        ("type: sphere", "shape.radius: missing"),
        ("type: sphere, radius: 1, length: 2", "shape.length: unknown key"),
        ("type: box, size: [1, 2]", "shape.size: must have at least 3 entries, got 2"),
        ("type: box, size: [1, 2, 3, 4]", "shape.size: must have at most 3 entries, got 4"),
        ("type: box, size: [1, 0, 3]", "shape.size[1]: must be positive, got 0"),
        ("type: box, size: 1", "shape.size: must be a list, got 1"),
        ("type: capsule, radius: 1", "shape.length: missing"),
        ("type: cylinder, length: 1", "shape.radius: missing"),
        ("type: ellipsoid, semi_axes: [1, -2, 3]", "shape.semi_axes[1]: must be positive, got -2"),
        ("type: half_space, radius: 1", "shape.radius: unknown key"),
        ("type: convex", "shape: give file or vertices, and only one of them"),
        ("type: convex, vertices: []", "shape.vertices: must have at least 1 entries, got 0"),
        ("type: convex, vertices: [[1, 2]]", "shape.vertices[0]: must have at least 3 entries"),
        ("type: mesh, vertices: [[0,0,0],[1,0,0],[0,1,0]]", "shape: vertices and faces come"),
        ("type: mesh, file: a, vertices: [[0,0,0],[1,0,0],[0,1,0]]", "shape: give file, or vert"),
        ("type: mesh, file: ''", "shape.file: must not be empty, got ''"),
        ("type: cone", "shape.type: must be one of 'sphere', 'box', 'capsule', 'cylinder',"),
        ("radius: 1", "shape.type: missing"),
    ],
)
def test_shapes(body, message):
    """Each wrong shape is one problem, at its line and key."""
    (problem,) = problems_of(shape(body))
    assert problem.startswith(f"f:4: geometries[0].{message}")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "f: a scene is a mapping, got NoneType"),
        ("[1]", "f:1: a scene is a mapping, got list"),
        ("sources: []", "f:1: version: missing"),
        ("version: 2", "f:1: version: must be 1, got 2"),
        (HEAD + "geometry: []", "f:3: geometry: unknown key"),
        (HEAD + "frames: {}", "f:3: frames: must be a list, got {}"),
        (HEAD + "frames: [f]", "f:3: frames[0]: must be a mapping, got 'f'"),
        ("version: 1\nsources:\n - {name: a/b}", "f:3: sources[0].name: must not contain a slash"),
        ("version: 1\nsources:\n - {name: ' '}", "f:3: sources[0].name: must not be empty"),
        (
            "version: 1\nsources:\n - {name: a, poses: {type: nav_msgs/msg/Odometry}}",
            "f:3: sources[0].poses.type: must be 'sensor_msgs/msg/MultiDOFJointState', ",
        ),
        (HEAD + "robots:\n - {name: r}", "f:4: robots[0].urdf: missing"),
        (
            HEAD + "robots:\n - {name: r, urdf: a, group_state: home}",
            "f:4: robots[0]: group_state needs an srdf",
        ),
        (
            HEAD + "robots:\n - {name: r, urdf: a,\n    positions: {j: x}}",
            "f:5: robots[0].positions.j: must be a number, got 'x'",
        ),
        (
            HEAD + "effects: {contacts: on}",
            "f:3: effects.contacts: must be 'auto' or 'off', go",
        ),
        (
            HEAD + "collision_filters:\n - {within: [cell], between: [[cell], [cell]]}",
            "f:4: collision_filters[0]: give within or between, and only one of them",
        ),
        (
            HEAD + "collision_filters:\n - {within: []}",
            "f:4: collision_filters[0].within: must ",
        ),
        (
            HEAD + "collision_filters:\n - {between: [[cell]]}",
            "f:4: collision_filters[0].between: must have at least 2 entries, got 1",
        ),
        (
            HEAD + "collision_filters:\n - {action: forbid, within: [cell]}",
            "f:4: collision_filters[0].action: must be 'exclude' or 'allow', got 'forbid'",
        ),
    ],
)
def test_schema(text, message):
    """What the schema does not allow is one problem, at its line and key."""
    (problem,) = problems_of(text)
    assert problem.startswith(message)


@pytest.mark.parametrize(
    ("pose", "message"),
    [
        ("{xyz: [0, .inf, 0]}", "pose.xyz[1]: must be finite, got inf"),
        ("{xyz: [0, 2e12, 0]}", "pose.xyz[1]: must be at most 1e+12, got 2000000000000.0"),
        ("{rpy: [0, 0]}", "pose.rpy: must have at least 3 entries, got 2"),
        ("{quaternion: [0, 0, 1]}", "pose.quaternion: must have at least 4 entries, got 3"),
        ("{rpy: [0, 0, 0], quaternion: [0, 0, 0, 1]}", "pose: give rpy or quaternion, not both"),
        ("{position: [0, 0, 0]}", "pose.position: unknown key"),
    ],
)
def test_poses(pose, message):
    """Each wrong pose is one problem, at its line and key."""
    (problem,) = problems_of(GEOMETRY.replace("name: g", f"name: g, pose: {pose}"))
    assert problem.startswith(f"f:4: geometries[0].{message}")


@pytest.mark.parametrize(
    ("extra", "message"),
    [
        ("color: [0, 2, 0]", "color[1]: must be at most 1, got 2"),
        ("color: [0, 0]", "color: must have at least 3 entries, got 2"),
        ("roles: {contact: {}}", "roles.contact: unknown key"),
        (
            "roles: {proximity: {material: {mu: [1, a]}}}",
            "roles.proximity.material.mu: must be",
        ),
        (
            "roles: {proximity: {material: {mu: .nan}}}",
            "roles.proximity.material.mu: must be fini",
        ),
        (
            "roles: {proximity: {material: 3}}",
            "roles.proximity.material: must be a mapping, g",
        ),
    ],
)
def test_colours_and_properties(extra, message):
    """Each wrong colour or property is one problem, at its line and key."""
    (problem,) = problems_of(GEOMETRY.replace("name: g", f"name: g, {extra}"))
    assert problem.startswith(f"f:4: geometries[0].{message}")


def test_all_mistakes_are_listed_in_the_order_of_the_file():
    """One run names everything that is wrong with the schema."""
    problems = problems_of(
        """\
        version: 1
        sources: [{}]
        geometries:
          - {name: a, source: s, shape: {type: sphere, radius: -1}}
          - {name: b, shape: {type: blob}}
        """
    )
    assert [problem.split(": must")[0] for problem in problems] == [
        "f:2: sources[0].name: missing",
        "f:4: geometries[0].shape.radius",
        "f:5: geometries[1].source: missing",
        "f:5: geometries[1].shape.type",
    ]


def test_names_that_mean_nothing_or_two_things():
    """Names are checked against the file: sources, frames, parents, loops and filters."""
    problems = problems_of(
        """\
        version: 1
        sources: [{name: cell}, {name: objects}]
        robots: [{name: cell, urdf: arm.urdf}]
        frames:
          - {name: ball, source: object}
          - {name: box, source: objects, parent: lid}
          - {name: box, source: objects}
          - {name: world, source: objects}
          - {name: p, source: objects, parent: q}
          - {name: q, source: objects, parent: p}
        geometries:
          - {name: g, source: objects, frame: bax, shape: {type: half_space}}
          - {name: h, source: objects, frame: box, shape: {type: half_space}}
          - {name: h, source: objects, frame: box, shape: {type: half_space}}
          - {name: h, source: objects, shape: {type: half_space}}
          - {name: h, source: cell, shape: {type: half_space}}
        collision_filters:
          - {between: [[objects], [objects/box, sell/world]]}
        """
    )
    assert problems == (
        "f:3: robots[0].name: the name 'cell' is taken by line 2",
        "f:5: frames[0].source: no source or robot 'object'; did you mean 'objects'?",
        "f:6: frames[1].parent: source 'objects' has no frame 'lid'",
        "f:7: frames[2].name: the name 'objects/box' is taken by line 6",
        "f:8: frames[3].name: the name 'world' means the world frame",
        "f:9: frames[4].parent: a frame cannot be its own ancestor: p -> q -> p",
        "f:10: frames[5].parent: a frame cannot be its own ancestor: q -> p -> q",
        "f:12: geometries[0].frame: source 'objects' has no frame 'bax'; did you mean 'box'?",
        "f:14: geometries[2].name: the name 'objects/box/h' is taken by line 13",
        "f:16: geometries[4].name: the name 'world/h' is taken by line 15",
        "f:18: collision_filters[0].between[1][1]: no source or robot 'sell';"
        " did you mean 'cell'?",
    )


def test_files_are_named_as_they_were_given(tmp_path):
    """The message starts with the path that the user gave."""
    file = tmp_path / "cell.yaml"
    file.write_text("version: 1\nnonsense: 2\n")
    with pytest.raises(SceneFileError) as caught:
        load_scene(file)
    assert str(caught.value) == f"{file}:2: nonsense: unknown key"
    with pytest.raises(SceneFileError, match=r"gone\.yaml': no such file"):
        load_scene(tmp_path / "gone.yaml")


def test_a_hundred_problems_are_enough():
    """A scene of another cell has thousands of wrong names: the first hundred are listed."""
    geometries = [
        f"- {{name: g{i}, source: t, shape: {{type: sphere, radius: 1}}}}" for i in range(300)
    ]
    text = "\n".join(["version: 1", "name: x", "sources: [{name: s}]", "geometries:", *geometries])
    with pytest.raises(SceneFileError) as caught:
        load_scene_text(text)
    assert len(caught.value.problems) == 101
    assert caught.value.problems[-1] == "<text>: there is more wrong"
