"""Query requests to arguments, result tables to responses."""

from collections.abc import Callable
import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from msg_adapters import queries
from msg_adapters.errors import MessageError
from msg_adapters.stamps import duration_to_msg, stamp_to_msg
from scene_graph_msgs.msg import GeometryNames, QueryOptions, WhatIf
from scene_graph_ros.geometry.errors import InvalidPoseError, NameConflictError, UnknownIdError
from scene_graph_ros.geometry.spatial.poses import pose_from_xyz_rpy

# A quarter turn about z takes x to y.
TURN = (0.0, 0.0, math.sqrt(0.5), math.sqrt(0.5))


def table(count: int = 2, first: int = 0, **columns: Any) -> Any:
    """Return an object with columns of ``count`` rows of distinct numbers, and a length."""

    class Columns(SimpleNamespace):
        def __len__(self) -> int:
            return count

    def numbers(width: int, offset: float) -> np.ndarray:
        return offset + first + np.arange(float(width * count)).reshape(count, width)

    return Columns(
        id_A=np.arange(first, first + count),
        id_B=np.arange(first, first + count) + 10,
        distance=numbers(1, 0.5).ravel(),
        p_ACa=numbers(3, 100.0),
        p_BCb=numbers(3, 200.0),
        nhat_BA_W=numbers(3, 300.0),
        is_nhat_BA_W_unique=np.arange(count) % 2 == 0,
        p_WCa=numbers(3, 600.0),
        p_WCb=numbers(3, 700.0),
        depth=numbers(1, 800.0).ravel(),
        point=np.arange(count)[::-1],
        id_G=np.arange(first, first + count) + 20,
        p_GN=numbers(3, 400.0),
        grad_W=numbers(3, 500.0),
        is_grad_W_unique=np.arange(count) % 2 == 1,
        **columns,
    )


def test_options_left_as_they_are_ask_for_now_and_names(scene: SimpleNamespace) -> None:
    """One configuration without changes, any stamp, no waiting, with a legend."""
    assert queries.options_from_msg(QueryOptions(), scene.names) == queries.Options(
        configurations=({},),
        minimal_stamp_ns=0,
        minimal_stamp_sources=(),
        timeout_ns=0,
        with_names=True,
    )


def test_options_survive_the_wire(
    scene: SimpleNamespace, over_the_wire: Callable[[Any], Any]
) -> None:
    """Each field lands in its own place."""
    msg = QueryOptions(
        minimal_stamp=stamp_to_msg(3_000_000_004),
        minimal_stamp_sources=["cell", "arm"],
        timeout=duration_to_msg(250_000_000),
        with_names=False,
    )
    options = queries.options_from_msg(over_the_wire(msg), scene.names)
    assert options.minimal_stamp_ns == 3_000_000_004
    assert options.minimal_stamp_sources == ("cell", "arm")
    assert options.timeout_ns == 250_000_000
    assert options.with_names is False


def test_joints_are_waited_for_by_name(scene: SimpleNamespace) -> None:
    """Of a robot's joint or frame; what is neither is refused."""
    msg = QueryOptions(minimal_stamp_sources=["/arm/elbow"])
    options = queries.options_from_msg(msg, scene.names, is_joint=lambda path: path == "arm/elbow")
    assert options.minimal_stamp_sources == ("arm/elbow",)
    with pytest.raises(UnknownIdError, match="'arm/elbow'"):
        queries.options_from_msg(msg, scene.names)


def test_options_that_can_not_be_met_are_refused(scene: SimpleNamespace) -> None:
    """A source that is not there, and waiting backwards."""
    with pytest.raises(UnknownIdError, match="'leg'"):
        queries.options_from_msg(QueryOptions(minimal_stamp_sources=["leg"]), scene.names)
    with pytest.raises(MessageError, match="negative"):
        queries.options_from_msg(QueryOptions(timeout=duration_to_msg(-1)), scene.names)


def test_what_if_places_frames_in_each_configuration(
    scene: SimpleNamespace, over_the_wire: Callable[[Any], Any]
) -> None:
    """Two configurations of two frames: position and turn of each land where they belong."""
    components = np.zeros((2, 2, 7))
    components[..., 3:] = TURN
    components[..., :3] = np.arange(12.0).reshape(2, 2, 3)
    msg = over_the_wire(queries.what_if_to_msg(["arm/hand", "cell/base"], components))
    configurations = queries.what_if_from_msg(msg, scene.names)
    assert len(configurations) == 2
    for k, configuration in enumerate(configurations):
        assert list(configuration) == [scene.hand, scene.other_base]
        for i, X_PF in enumerate(configuration.values()):
            expected = pose_from_xyz_rpy(components[k, i, :3], (0.0, 0.0, math.pi / 2.0))
            np.testing.assert_allclose(X_PF, expected, rtol=0, atol=1e-15)


@pytest.mark.parametrize(
    ("frames", "count", "words"),
    [
        (["hand"], 0, "0 numbers of poses for 1 frames"),
        (["hand"], 8, "7 per configuration"),
        (["arm/base", "hand"], 7, "14 per configuration"),
        ([], 7, "no frames"),
        (["hand", "arm/hand"], 14, "more than once"),
    ],
)
def test_what_if_whose_lengths_do_not_fit_is_refused(
    scene: SimpleNamespace, frames: list[str], count: int, words: str
) -> None:
    """The error says how many numbers there are and how many it takes."""
    with pytest.raises(MessageError, match=words):
        queries.what_if_from_msg(WhatIf(frames=frames, poses=[0.0] * count), scene.names)


def test_what_if_of_unknown_or_ambiguous_frames_is_refused(scene: SimpleNamespace) -> None:
    """As everywhere where frames are named."""
    for frame, error in (("elbow", UnknownIdError), ("base", NameConflictError)):
        with pytest.raises(error, match=frame):
            queries.what_if_from_msg(WhatIf(frames=[frame], poses=[0.0] * 7), scene.names)


def test_a_bad_pose_in_what_if_is_named_with_its_configuration(scene: SimpleNamespace) -> None:
    """Row 3 of two frames is the second frame in configuration 1."""
    components = np.zeros((2, 2, 7))
    components[..., 6] = 1.0
    components[1, 1, 0] = math.nan
    msg = queries.what_if_to_msg(["arm/base", "hand"], components)
    with pytest.raises(InvalidPoseError, match=r"hand in configuration 1.*finite"):
        queries.what_if_from_msg(msg, scene.names)
    with pytest.raises(MessageError, match=r"\(k, 1, 7\)"):
        queries.what_if_to_msg(["hand"], components)


def test_a_limit_that_is_not_given_is_infinite() -> None:
    """Zero means zero; not a number means nothing."""
    assert queries.limit_from_msg([], "threshold") == math.inf
    assert queries.limit_from_msg([0.0], "threshold") == 0.0
    assert queries.limit_from_msg([-0.25], "threshold") == -0.25
    with pytest.raises(MessageError, match="threshold"):
        queries.limit_from_msg([math.nan], "threshold")


def test_points_come_three_numbers_each() -> None:
    """Rows in their order; half a point and a point nowhere are refused by their place."""
    points = queries.points_from_msg([1.0, 2.0, 3.0, 4.0, 5.0, 6.0])
    np.testing.assert_array_equal(points, [(1.0, 2.0, 3.0), (4.0, 5.0, 6.0)])
    assert queries.points_from_msg([]).shape == (0, 3)
    with pytest.raises(MessageError, match="4 numbers"):
        queries.points_from_msg([1.0, 2.0, 3.0, 4.0])
    with pytest.raises(MessageError, match="row 1"):
        queries.points_from_msg([1.0, 2.0, 3.0, 4.0, math.inf, 6.0])


def test_signed_distances_of_two_configurations_are_put_behind_one_another(
    over_the_wire: Callable[[Any], Any],
) -> None:
    """Each column keeps its numbers; the starts tell the configurations apart."""
    first, second = table(2), table(3, first=5)
    msg = over_the_wire(queries.signed_distances_to_msg([first, second], None))
    assert list(msg.configuration_start) == [0, 2, 5]
    for field, column in (
        ("id_a", "id_A"),
        ("id_b", "id_B"),
        ("distance", "distance"),
        ("points_a_in_a", "p_ACa"),
        ("points_b_in_b", "p_BCb"),
        ("normals", "nhat_BA_W"),
        ("is_normal_unique", "is_nhat_BA_W_unique"),
    ):
        expected = np.concatenate([getattr(first, column), getattr(second, column)])
        np.testing.assert_array_equal(getattr(msg, field), expected.ravel(), err_msg=field)
    assert msg.geometries == GeometryNames()


def test_point_contacts_of_two_configurations_are_put_behind_one_another(
    over_the_wire: Callable[[Any], Any],
) -> None:
    """Likewise of penetrations."""
    first, second = table(2), table(1, first=5)
    msg = over_the_wire(queries.point_contacts_to_msg([first, second], None))
    assert list(msg.configuration_start) == [0, 2, 3]
    for field, column in (
        ("id_a", "id_A"),
        ("id_b", "id_B"),
        ("points_a", "p_WCa"),
        ("points_b", "p_WCb"),
        ("normals", "nhat_BA_W"),
        ("depth", "depth"),
    ):
        expected = np.concatenate([getattr(first, column), getattr(second, column)])
        np.testing.assert_array_equal(getattr(msg, field), expected.ravel(), err_msg=field)
    assert msg.geometries == GeometryNames()


def test_point_distances_keep_their_columns(over_the_wire: Callable[[Any], Any]) -> None:
    """Point, geometry, distance, nearest point, gradient and its uniqueness."""
    given = table(3)
    msg = over_the_wire(queries.point_distances_to_msg([given], None))
    assert list(msg.configuration_start) == [0, 3]
    for field, column in (
        ("point", "point"),
        ("id", "id_G"),
        ("distance", "distance"),
        ("nearest", "p_GN"),
        ("gradients", "grad_W"),
        ("is_gradient_unique", "is_grad_W_unique"),
    ):
        np.testing.assert_array_equal(
            getattr(msg, field), getattr(given, column).ravel(), err_msg=field
        )


def test_tables_have_a_legend_when_asked(scene: SimpleNamespace) -> None:
    """The legend names the ids of both columns, sorted, once each."""
    ball, tip, floor = (int(i) for i in (scene.ball, scene.tip, scene.floor))
    given = table(2)
    given.id_A, given.id_B = np.array([ball, ball]), np.array([tip, floor])
    given.id_G = np.array([floor, ball])
    for msg in (
        queries.signed_distances_to_msg([given], scene.names),
        queries.candidates_to_msg([given], scene.names),
        queries.point_contacts_to_msg([given], scene.names),
    ):
        assert msg.geometries.name == ["ball", "tip", "floor"]
    points = queries.point_distances_to_msg([given], scene.names)
    assert list(points.geometries.id) == [ball, floor]


def test_candidates_keep_their_pairs(over_the_wire: Callable[[Any], Any]) -> None:
    """Two columns of ids, also when a configuration has none."""
    msg = over_the_wire(queries.candidates_to_msg([table(0), table(2), table(0)], None))
    assert list(msg.configuration_start) == [0, 0, 2, 2]
    assert (list(msg.id_a), list(msg.id_b)) == ([0, 1], [10, 11])


def test_a_signed_distance_is_told_in_the_world_and_in_both_geometries(
    scene: SimpleNamespace, over_the_wire: Callable[[Any], Any]
) -> None:
    """Witnesses (1,0,0) and (2,0,0), A turned to y and moved, B moved: (1,3,3) and (6,5,6)."""
    X_WA = pose_from_xyz_rpy((1.0, 2.0, 3.0), (0.0, 0.0, math.pi / 2.0))
    X_WB = pose_from_xyz_rpy((4.0, 5.0, 6.0))
    record = SimpleNamespace(
        id_A=scene.ball,
        id_B=scene.tip,
        distance=np.float64(-0.5),
        p_ACa=np.array([1.0, 0.0, 0.0]),
        p_BCb=np.array([2.0, 0.0, 0.0]),
        nhat_BA_W=np.array([0.0, 0.6, 0.8]),
        is_nhat_BA_W_unique=np.bool_(True),
    )
    msg = over_the_wire(queries.signed_distance_pair_to_msg(record, scene.names, X_WA, X_WB))
    assert (msg.status.code, msg.geometry_a.name, msg.geometry_b.name) == (0, "ball", "tip")
    assert (msg.distance, msg.is_normal_unique) == (-0.5, True)

    def numbers(v: Any) -> tuple[float, float, float]:
        return (v.x, v.y, v.z)

    assert numbers(msg.point_a) == pytest.approx((1.0, 3.0, 3.0), abs=1e-15)
    assert numbers(msg.point_b) == (6.0, 5.0, 6.0)
    assert numbers(msg.point_a_in_a) == (1.0, 0.0, 0.0)
    assert numbers(msg.point_b_in_b) == (2.0, 0.0, 0.0)
    assert numbers(msg.normal) == (0.0, 0.6, 0.8)


def test_flags_are_zeros_and_ones() -> None:
    """Also those that numpy made."""
    assert list(queries.flags_to_msg([True, np.bool_(False), np.True_])) == [1, 0, 1]
