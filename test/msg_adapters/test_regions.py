"""Regions and what reaches into them to messages and back; what is drawn of them."""

from __future__ import annotations

import numpy as np
import pytest
from visualization_msgs.msg import Marker

from msg_adapters.errors import MessageError
from msg_adapters.region_markers import region_form, region_markers_to_msg
from msg_adapters.regions import (
    outcome_of,
    region_cuts_to_msg,
    region_from_msg,
    region_to_msg,
)
from scene_graph_msgs.msg import RegionArray
from scene_graph_ros.geometry.model.ids import GeometryId
from scene_graph_ros.geometry.optimization import HPolyhedron, RegionCut

CORNERS = np.array([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 3.0, 0.0], [0.0, 0.0, 5.0]])


def test_regions_go_there_and_back():
    """Each number as it was."""
    region = HPolyhedron([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]], [7.0, 8.0])
    message = region_to_msg("name", region)
    assert (message.name, list(message.a), list(message.b)) == (
        "name",
        [1.0, 2.0, 3.0, 4.0, 5.0, 6.0],
        [7.0, 8.0],
    )
    found = region_from_msg(message.a, message.b, "a", "b")
    assert (found.A == region.A).all()
    assert (found.b == region.b).all()


@pytest.mark.parametrize(
    ("a", "b", "words"),
    [
        ([1.0, 2.0], [1.0], "a has 2 numbers"),
        ([1.0, 2.0, 3.0], [], "a has 1 normals, b has 0"),
        ([1.0, np.nan, 3.0], [1.0], "not finite"),
        ([0.0, 0.0, 0.0], [1.0], "normal 0 must not be 0"),
        ([1e13, 0.0, 0.0], [1.0], "normal 0 must not be 0 and have numbers up to 1e"),
        ([1.0, 0.0, 0.0], [np.inf], r"b\[0\] must be a number"),
        ([1.0, 0.0, 0.0], [1e13], r"b\[0\] must be a number up to 1e"),
    ],
)
def test_what_is_no_region_is_refused(a, b, words):
    """With the field, and the face."""
    with pytest.raises(MessageError, match=words):
        region_from_msg(a, b, "a", "b")


def test_outcomes_and_rows_of_cuts():
    """Proven ones count more than others; rows are those that have some."""
    sure, unsure = (
        RegionCut(GeometryId(k), 0.1 * k, np.array([k, 2.0, 3.0]), k == 4) for k in (4, 5)
    )
    outcomes = [outcome_of(cuts) for cuts in ([], [unsure], [unsure, sure])]
    assert outcomes == [RegionArray.FREE, RegionArray.UNDECIDED, RegionArray.CUT]
    table = region_cuts_to_msg([[], [sure, unsure], [sure]], None)
    assert list(table.row) == [1, 1, 2]
    assert list(table.id) == [4, 5, 4]
    assert list(table.points) == [4.0, 2.0, 3.0, 5.0, 2.0, 3.0, 4.0, 2.0, 3.0]
    assert list(table.is_proven) == [1, 0, 1]


def test_forms_have_the_volume_that_they_show():
    """Of a tetrahedron the triangles enclose 5 m3, and there are six edges."""
    form = region_form(CORNERS)
    a, b, c = (form.triangles.vertices[form.triangles.triangles[:, k]] for k in range(3))
    assert np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0 == pytest.approx(5.0, rel=1e-12)
    assert len(form.edges) == 12


def test_flat_regions_are_sheets_and_thin_ones_words():
    """A polygon has two sides; without a form there is but a name."""
    flat = region_form(CORNERS[:3])
    assert len(flat.triangles.triangles) == 2
    for form, kinds in ((flat, [0, 0, 0, 2]), (None, [2, 2, 0, 2])):
        markers = region_markers_to_msg("a", form, "", [], stamp_ns=5, frame_id="w")
        assert [m.action for m in markers] == kinds
        assert {m.header.frame_id for m in markers} == {"w"}
    assert markers[2].action == Marker.ADD
