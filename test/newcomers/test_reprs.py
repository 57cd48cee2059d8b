"""Every public class shows itself in one line of at most 200 characters, without an address."""

import enum
import importlib
import inspect
import re

import numpy as np

from scene_graph_ros.geometry import (
    Box,
    Capsule,
    CollisionFilterDeclaration,
    Convex,
    Cylinder,
    Ellipsoid,
    FilterId,
    FrameId,
    GeometryFrame,
    GeometryId,
    GeometryInstance,
    GeometryPair,
    GeometrySet,
    HalfSpace,
    Mesh,
    one_line,
    ProximityProperties,
    SceneGraph,
    SourceId,
    Sphere,
)
from scene_graph_ros.planning import RobotDiagram, SceneGraphCollisionChecker
from scene_graph_ros.robots import KinematicTree
from tools.site.public import PUBLIC

LONG = "n" * 255
MANY = np.random.default_rng(0).random((1000, 3))


def _public_classes() -> dict[str, type]:
    found = {}
    for name in PUBLIC:
        module = importlib.import_module(name)
        for each in dir(module):
            value = getattr(module, each)
            if inspect.isclass(value) and not each.startswith("_") and each in _public(module):
                found[f"{value.__module__}.{value.__qualname__}"] = value
    return found


def _public(module) -> set[str]:
    return {*module.__all__, *getattr(module, "_ON_DEMAND", ())}


def _instances() -> list[object]:
    """One of each class that has a ``__repr__`` of its own, as long as it can be."""
    scene_graph = SceneGraph()
    source = scene_graph.register_source(LONG)
    link = scene_graph.register_frame(source, GeometryFrame(LONG))
    properties = ProximityProperties()
    for k in range(50):
        properties.add_property("group", f"property {k}", LONG)
    instance = GeometryInstance(
        np.eye(4), Convex(vertices=MANY - 0.5, scale=(1.0, 2.0, 3.0)), LONG
    )
    ball = scene_graph.register_geometry(source, link, instance)
    scene_graph.assign_role(source, ball, properties)
    floor = GeometryInstance(np.eye(4), HalfSpace(), "floor")
    floor_id = scene_graph.register_anchored_geometry(source, floor)
    scene_graph.assign_role(source, floor_id, ProximityProperties())
    context = scene_graph.create_default_context()
    query = scene_graph.query_object(context)
    hull_shape = instance.shape()
    ids = GeometrySet([GeometryId(k) for k in range(1, 500)])
    tables = [
        query.find_collision_candidates(),
        query.compute_point_pair_penetration(derivatives=True, certificate=True),
        query.compute_signed_distance_pairwise_closest_points(derivatives=True),
        query.compute_signed_distance_to_points(MANY),
    ]
    return [
        *(scene_graph, context, query, scene_graph.model_inspector(), instance, properties, ids),
        *(CollisionFilterDeclaration().exclude_within(ids), GeometryFrame(LONG)),
        *(GeometryPair(ball, floor_id, *(scene_graph.model_inspector().get_path(ball),) * 2),),
        hull_shape,
        Mesh(vertices=MANY, faces=np.arange(999).reshape(-1, 3)),
        *(SourceId(10**15), FrameId(), GeometryId(3), FilterId(2)),
        *(Box(1 / 3, 2 / 3, 1e-5), Capsule(1 / 3, 1e5 / 7), Cylinder(1 / 3, 1 / 7)),
        *(Ellipsoid(1 / 3, 1 / 7, 1 / 9), Sphere(1 / 3), HalfSpace()),
        *tables,
        *(table[0] for table in tables),
    ]


def _is_good(text: str) -> bool:
    return len(text) <= 200 and "\n" not in text and not re.search(r"0x[0-9a-f]{6}", text)


def test_each_public_class_shows_itself_by_the_one_rule():
    """A class without it, as what is added next may be, shows an address or all of its arrays."""
    known = {type(each) for each in _instances()}
    classes = _public_classes()
    assert len(classes) > 150
    bad = [
        name
        for name, shown in classes.items()
        if not issubclass(shown, (BaseException, enum.Enum))
        and not inspect.isabstract(shown)
        and not getattr(shown, "_is_protocol", False)
        and getattr(shown.__repr__, "__module__", "") != one_line.__name__
        and not any(issubclass(each, shown) for each in known)
        and shown.__repr__.__qualname__ not in CHECKED_ELSEWHERE
    ]
    assert not bad


CHECKED_ELSEWHERE = {
    "GeometryProperties.__repr__": "of all three kinds, one is shown",
    "ResultTable.__repr__": "of all kinds, some are shown",
    "RenderLabel.__repr__": "a number",
    "ContactParticipation.__repr__": "numbers",
    "PointCloud.__repr__": "numbers",
    "HeightField.__repr__": "numbers",
    "VoxelGrid.__repr__": "numbers",
    "DeformableContact.__repr__": "a number",
    "DeformableContactSurface.__repr__": "ids and a number",
    "ContactSurface.__repr__": "ids and numbers",
    "SurfaceMesh.__repr__": "numbers",
    "VolumeMesh.__repr__": "numbers",
    "SceneGraphNode.__repr__": "a name of ROS",
    "World.__repr__": "a name of ROS, cut",
    "Source.__repr__": "a name, cut",
    "Table.__repr__": "names of columns, cut",
    "FoundPlan.__repr__": "numbers, or a sentence that is cut",
    "Execution.__repr__": "numbers",
    "Costly.__repr__": "a name, cut",
}
"""What has no array or text of any length in it, with the reason."""


def test_what_is_as_long_as_can_be():
    """Long names, many members and many properties are cut."""
    assert not [text for text in map(repr, _instances()) if not _is_good(text)]


def test_robots_and_checkers(small_robot):
    """What had 60 lines of matrices, or an address, has one line with what it is called."""
    diagram, checker = small_robot
    for shown in (diagram, checker, diagram.tree, diagram.tree.joints[0], checker.bodies[0]):
        assert _is_good(repr(shown)), repr(shown)
    assert "KinematicTree(name='arm'" in repr(diagram.tree)
    assert "num_pairs=" in repr(checker)


def test_what_is_half_made_shows_itself():
    """A debugger shows objects whose attributes are not there yet."""
    assert repr(object.__new__(KinematicTree)) == "KinematicTree()"
    assert repr(object.__new__(SceneGraphCollisionChecker)).startswith("SceneGraphColl")
    assert repr(object.__new__(RobotDiagram)) == "RobotDiagram()"


def test_values_are_said_in_few_words():
    """Numbers are rounded, arrays and collections counted, texts cut: derived by hand."""

    @one_line.one_line()
    class Kept(tuple):
        _fields = ("third", "small", "large", "names", "many", "text", "nothing")
        third, small = 1 / 3, np.array([1.0, 0.25])
        large, names = np.zeros((4, 4)), ("a", "b")
        many, text, nothing = list(range(9)), "x\ny" * 40, None

    text = repr(Kept())
    assert text.startswith(
        "Kept(third=0.333333, small=[1, 0.25], large=(4, 4) array, names=['a', 'b'], "
        "many=9 entries, text='x"
    )
    assert text.endswith("nothing=None)")
    assert len(text) <= 200
