"""Names in messages to ids and back."""

from collections.abc import Callable
import re
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from msg_adapters.names import SceneNames
from scene_graph_msgs.msg import GeometryName, GeometryNames, GeometryReference
from scene_graph_ros import geometry as core
from scene_graph_ros.geometry.errors import NameConflictError, UnknownIdError


def test_a_geometry_is_found_by_id_by_path_and_by_a_name_of_its_own(
    scene: SimpleNamespace,
) -> None:
    """Each way of naming it leads to the same id."""
    names = scene.names
    for reference in (
        int(scene.tip),
        scene.tip,
        "tip",
        "arm/hand/tip",
        GeometryReference(id=int(scene.tip)),
        GeometryReference(name="arm/hand/tip"),
        GeometryReference(id=int(scene.tip), name="ignored where there is an id"),
    ):
        assert names.geometry_id(reference) == scene.tip
    assert names.geometry_id("cell/world/floor") == scene.floor


def test_a_path_tells_apart_what_a_bare_name_does_not(scene: SimpleNamespace) -> None:
    """Two balls need their paths; the bare name is refused with both of them listed."""
    assert scene.names.geometry_id("arm/base/ball") == scene.ball
    assert scene.names.geometry_id("cell/base/ball") == scene.other_ball
    with pytest.raises(NameConflictError, match="ambiguous") as error:
        scene.names.geometry_id("ball")
    assert "arm/base/ball" in str(error.value) and "cell/base/ball" in str(error.value)


@pytest.mark.parametrize("reference", ["", "nobody", "arm/hand/ball", "arm/tip", 10**9, -1])
def test_an_unknown_geometry_is_refused_by_its_name(
    scene: SimpleNamespace, reference: str | int
) -> None:
    """The error quotes what was asked for."""
    with pytest.raises(UnknownIdError, match=re.escape(repr(reference))):
        scene.names.geometry_id(reference)


def test_an_empty_reference_names_nothing(scene: SimpleNamespace) -> None:
    """A message left as it is does not happen to be a geometry."""
    with pytest.raises(UnknownIdError):
        scene.names.geometry_id(GeometryReference())


def test_a_frame_is_found_like_a_geometry(scene: SimpleNamespace) -> None:
    """By path, by a name of its own, and by its name within a source."""
    names = scene.names
    assert names.frame_id("arm/base") == scene.base
    assert names.frame_id("cell/base") == scene.other_base
    assert names.frame_id("hand") == scene.hand
    assert names.frame_id("world") == scene.graph.world_frame_id()
    assert names.frame_id("base", "arm") == scene.base
    assert names.frame_id("base", source="cell") == scene.other_base
    with pytest.raises(NameConflictError, match=r"arm/base.*cell/base"):
        names.frame_id("base")
    with pytest.raises(UnknownIdError, match="'elbow'"):
        names.frame_id("elbow")
    with pytest.raises(UnknownIdError, match="'cell' has no frame 'hand'"):
        names.frame_id("hand", "cell")
    with pytest.raises(UnknownIdError, match="no source 'leg'"):
        names.frame_id("hand", "leg")


def test_sources_and_paths_go_both_ways(scene: SimpleNamespace) -> None:
    """Names of sources lead to ids, ids to paths."""
    names = scene.names
    assert names.source_id("arm") == scene.arm
    with pytest.raises(UnknownIdError, match="'leg'"):
        names.source_id("leg")
    assert names.frame_path(scene.hand) == "arm/hand"
    assert names.frame_path(scene.graph.world_frame_id()) == "world"
    assert names.geometry_path(scene.tip) == "arm/hand/tip"


def test_a_geometry_name_message_says_who_and_where(scene: SimpleNamespace) -> None:
    """Ids, source, frame and name of a moving and of an anchored geometry."""
    assert scene.names.geometry_name(scene.ball) == GeometryName(
        id=int(scene.ball), frame_id=int(scene.base), source="arm", frame="base", name="ball"
    )
    floor = scene.names.geometry_name(int(scene.floor))
    assert (floor.source, floor.frame, floor.name) == ("cell", "world", "floor")
    assert scene.names.geometry_name(scene.ball) is scene.names.geometry_name(int(scene.ball))
    with pytest.raises(UnknownIdError, match="123456"):
        scene.names.geometry_name(123456)


def test_a_legend_lists_each_geometry_once_sorted_by_id(
    scene: SimpleNamespace, over_the_wire: Callable[[Any], Any]
) -> None:
    """Ids that come several times, in several columns, give one entry."""
    ids = [int(scene.tip), int(scene.ball), int(scene.tip)]
    legend = over_the_wire(scene.names.legend(ids, [int(scene.other_ball)] * 3))
    assert list(legend.id) == sorted({*ids, int(scene.other_ball)})
    for row, geometry in enumerate(legend.id):
        assert scene.names.geometry_name(geometry) == GeometryName(
            id=geometry,
            frame_id=legend.frame_id[row],
            source=legend.source[row],
            frame=legend.frame[row],
            name=legend.name[row],
        )
    assert scene.names.legend([]) == GeometryNames()


def test_legends_do_not_depend_on_those_before(scene: SimpleNamespace) -> None:
    """Names are kept from legend to legend: what one asked for is in the next only if asked."""
    ball, tip = int(scene.ball), int(scene.tip)
    both = SceneNames(scene.graph.model_inspector()).legend([tip, ball])
    for ids in ([tip], [ball], [tip, ball], [tip]):
        legend = scene.names.legend(ids)
        assert sorted(legend.id) == sorted(ids)
        for row, geometry in enumerate(legend.id):
            expected = list(both.id).index(geometry)
            for column in ("frame_id", "source", "frame", "name"):
                assert getattr(legend, column)[row] == getattr(both, column)[expected]


def test_a_legend_holds_where_another_thread_comes_first_at_once(
    scene: SimpleNamespace,
    monkeypatch: pytest.MonkeyPatch,
    over_the_wire: Callable[[Any], Any],
) -> None:
    """Both make the columns: one's rows are not read among the other's."""
    names, kind = scene.names, type(scene.names._columns)
    rows = kind.rows

    def rows_beside_another(columns: Any, *arguments: Any) -> Any:
        found = rows(columns, *arguments)
        names.__dict__["_columns"] = kind(names._geometries)
        return found

    monkeypatch.setattr(kind, "rows", rows_beside_another)
    legend = over_the_wire(names.legend([int(scene.ball)]))
    assert (list(legend.source), list(legend.name)) == (["arm"], ["ball"])


@pytest.mark.parametrize("unknown", [-1, 0, 10**6, 2**62])
def test_a_legend_of_an_unknown_id_names_it(scene: SimpleNamespace, unknown: int) -> None:
    """Below, between and beyond the ids that there are, and known ones still have their names."""
    for ids in ([unknown], [int(scene.ball), unknown]):
        with pytest.raises(UnknownIdError, match=str(unknown)):
            scene.names.legend(ids)
    assert list(scene.names.legend([int(scene.ball)]).name) == ["ball"]


def test_a_path_wins_over_a_bare_name_that_looks_like_it(scene: SimpleNamespace) -> None:
    """Names may contain slashes: one that spells another's path does not hide the other."""
    imitation = core.GeometryInstance(np.eye(4), core.Sphere(1.0), "arm/hand/tip")
    imitation_id = scene.graph.register_geometry(scene.cell, scene.other_base, imitation)
    names = SceneNames(scene.inspector)
    assert names.geometry_id("arm/hand/tip") == scene.tip
    assert names.geometry_id("cell/base/arm/hand/tip") == imitation_id


def test_a_path_that_two_geometries_have_needs_their_ids(scene: SimpleNamespace) -> None:
    """One name in two roles on a frame is allowed, so a path can be ambiguous, an id never."""
    drawn = core.GeometryInstance(np.eye(4), core.Sphere(1.0), "ball")
    drawn.set_illustration_properties(core.IllustrationProperties())
    drawn_id = scene.graph.register_geometry(scene.arm, scene.base, drawn)
    names = SceneNames(scene.inspector)
    with pytest.raises(NameConflictError, match=f"id {int(drawn_id)}"):
        names.geometry_id("arm/base/ball")
    assert names.geometry_id(int(drawn_id)) == drawn_id
