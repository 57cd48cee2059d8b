"""SRDF: which pairs are filtered, and what is said about names that fit nothing."""

import itertools

from hypothesis import given, settings
from hypothesis import strategies as st
import pytest

from scene_graph_ros.geometry import Role, SceneGraph
from scene_graph_ros.robots.adjacency import adjacent_pairs
from scene_graph_ros.scene_files import (
    load_srdf,
    load_urdf,
    register_robot,
    SceneFileError,
)

LINKS = ("a", "b", "c", "d", "e")


def chain(types="rrrr", solid=LINKS):
    """Return a robot of five links in a row; ``types`` are r or f per joint, in order."""
    words = {"r": "revolute", "f": "fixed"}
    geometry = '<collision><geometry><sphere radius="0.1"/></geometry></collision>'
    links = "".join(f'<link name="{n}">{geometry if n in solid else ""}</link>' for n in LINKS)
    joints = "".join(
        f'<joint name="{p}{c}" type="{words[t]}"><parent link="{p}"/><child link="{c}"/></joint>'
        for (p, c), t in zip(itertools.pairwise(LINKS), types, strict=True)
    )
    return load_urdf(f'<robot name="chain">{links}{joints}</robot>')


def srdf(*lines):
    """Return an SRDF whose elements start in line 2, one a line."""
    return "\n".join(['<robot name="chain">', *lines, "</robot>"])


def disable(link1, link2):
    """Return the element that disables a pair."""
    return f'<disable_collisions link1="{link1}" link2="{link2}" reason="Never"/>'


def error_of(text):
    """Return the message with which an SRDF is refused."""
    with pytest.raises(SceneFileError) as caught:
        load_srdf(text, chain())
    return str(caught.value)


def test_disabled_pairs_keep_reason_and_place():
    """A pair is sorted; its reason and line are kept, a repetition is dropped."""
    model = load_srdf(srdf(disable("c", "a"), disable("a", "c"), disable("b", "c")), chain())
    assert [(p.link_A, p.link_B, p.reason) for p in model.disabled_pairs] == [
        ("a", "c", "Never"),
        ("b", "c", "Never"),
    ]
    assert model.disabled_pairs[0].location.line == 2
    assert model.filtered_pairs(LINKS) == {("a", "c"), ("b", "c")}


def test_default_disabled_link_with_exception_and_final_word():
    """Default, then enabled, then disabled pairs: the order in which MoveIt applies them."""
    model = load_srdf(
        srdf(
            '<disable_default_collisions link="c"/>',
            '<enable_collisions link1="c" link2="a"/>',
            '<enable_collisions link1="e" link2="c"/>',
            disable("c", "e"),
        ),
        chain(),
    )
    assert model.filtered_pairs(LINKS) == {("b", "c"), ("c", "d"), ("c", "e")}


def test_unknown_names_are_warnings_with_place():
    """A link or joint of another variant is named, and the rest of the file holds."""
    model = load_srdf(
        srdf(
            disable("a", "bb"),
            disable("a", "b"),
            '<group_state name="up" group="g">',
            '<joint name="ax" value="1"/><joint name="ab" value="2"/>',
            "</group_state>",
        ),
        chain(),
    )
    assert model.warnings == (
        "<text>:2: disable_collisions.link2: robot 'chain' has no link 'bb'; did you mean 'b'?",
        "<text>:5: group_state['up']/joint['ax'].name: robot 'chain' has no joint 'ax'",
    )
    assert model.filtered_pairs(LINKS) == {("a", "b")}
    assert model.group_state("up").positions == {"ab": 2.0}


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (srdf(disable("x", "y")), "<text>:2: disable_collisions: no link of this file is a link"),
        (srdf(disable("a", "a")), "<text>:2: disable_collisions: names link 'a' twice"),
        (
            srdf('<disable_collisions link1="a"/>'),
            "<text>:2: disable_collisions.link2: missing attribute",
        ),
        (
            srdf('<disable_default_collisions name="a"/>'),
            "<text>:2: disable_default_collisions['a'].link: missing attribute",
        ),
        (
            srdf('<group_state name="s"><joint name="ab" value="x"/></group_state>'),
            "<text>:2: group_state['s']/joint['ab'].value: expected a number, got 'x'",
        ),
        ("<urdf/>", "<text>:1: expected <robot>, got <urdf>"),
    ],
)
def test_wrong_files_are_refused_with_their_place(text, message):
    """Each mistake is named with line, element, attribute and value."""
    assert error_of(text).startswith(message)


def test_group_states_are_found_by_name_and_group():
    """Postures of the same name differ by group; a wrong name lists what there is."""
    states = [f'<group_state name="home" group="{g}"/>' for g in ("arm", "leg")]
    model = load_srdf(srdf(*states), chain())
    assert model.group_state("home", "leg").group == "leg"
    with pytest.raises(SceneFileError, match="more than one group state 'home'"):
        model.group_state("home")
    with pytest.raises(SceneFileError, match=r"no group state 'rest'; there are: home \(gro"):
        model.group_state("rest")


def test_virtual_joint_posture_is_passed_over():
    """A group state may place the robot's base by seven numbers, which is no joint of the URDF."""
    text = srdf(
        '<group_state name="s" group="g"><joint name="root" value="0 0 1 0 0 0 1"/></group_state>'
    )
    model = load_srdf(text, chain())
    assert model.warnings == ()
    assert model.group_state("s").positions == {}


def test_adjacent_links():
    """Neighbours in the chain are adjacent, others are not."""
    assert adjacent_pairs(chain()) == set(itertools.pairwise(LINKS))


def test_adjacency_passes_through_links_without_geometry():
    """With c and d empty, b and e are neighbours."""
    assert adjacent_pairs(chain(solid=("a", "b", "e"))) == {("a", "b"), ("b", "e")}


def test_welded_links_never_collide():
    """a, b and c are one body, so a and c are adjacent without a common joint."""
    expected = {("a", "b"), ("b", "c"), ("a", "c"), ("c", "d"), ("d", "e")}
    assert adjacent_pairs(chain("ffrr")) == expected


pair = st.tuples(st.sampled_from(LINKS), st.sampled_from(LINKS)).filter(lambda p: p[0] != p[1])


@settings(deadline=None)
@given(
    disabled=st.lists(pair, max_size=8),
    enabled=st.lists(pair, max_size=4),
    defaults=st.sets(st.sampled_from(LINKS), max_size=2),
    adjacent=st.booleans(),
)
def test_the_scene_graph_filters_what_the_rules_say(disabled, enabled, defaults, adjacent):
    """Of all pairs of links, candidates are those that no rule excludes, for any SRDF."""
    robot = chain()
    elements = [disable(*p) for p in disabled]
    elements += [f'<enable_collisions link1="{a}" link2="{b}"/>' for a, b in enabled]
    elements += [f'<disable_default_collisions link="{n}"/>' for n in sorted(defaults)]
    semantics = load_srdf(srdf(*elements), robot)
    scene_graph = SceneGraph()
    source = scene_graph.register_source("chain")
    frames = register_robot(
        robot, scene_graph, source, semantics=semantics, filter_adjacent=adjacent
    )
    inspector = scene_graph.model_inspector()
    (geometry,) = zip(*(inspector.get_geometries(frames[n]) for n in LINKS), strict=True)
    for (i, first), (j, second) in itertools.combinations(enumerate(LINKS), 2):
        named = {(first, second), (second, first)}
        by_default = bool({first, second} & defaults) and not named & set(enabled)
        expected = by_default or bool(named & set(disabled)) or (adjacent and j == i + 1)
        assert inspector.collision_filtered(geometry[i], geometry[j]) == expected
    assert inspector.num_geometries_with_role(Role.PROXIMITY) == len(LINKS)


def test_names_of_another_robot_are_not_all_looked_for(monkeypatch):
    """Of a hundred unknown links the first fifty are answered with a name that is near."""
    asked = []
    suggest = "scene_graph_ros.scene_files.srdf.suggestion"
    monkeypatch.setattr(suggest, lambda name, known: asked.append(name) or "")
    pairs = "".join(f'<disable_collisions link1="x{i}" link2="y{i}"/>' for i in range(100))
    good = '<disable_collisions link1="a" link2="b"/>'
    robot = load_urdf(
        '<robot name="r"><link name="a"/><link name="b"/><joint name="j" type="fixed">'
        '<parent link="a"/><child link="b"/></joint></robot>'
    )
    assert len(load_srdf(f"<robot>{pairs}{good}</robot>", robot).warnings) == 200
    assert len(asked) == 50
