"""Tables of one concern: each kind of shape has an answer, or the import fails."""

import pytest

from scene_graph_ros.geometry.shapes.every_kind import every_kind
from scene_graph_ros.geometry.shapes.kinds import ShapeKind


def test_a_table_with_all_kinds_is_taken_as_it_is():
    """Its order stays, too: kernels are written from it."""
    table = {kind: kind.name for kind in reversed(ShapeKind)}
    assert list(every_kind("names", table).items()) == list(table.items())


@pytest.mark.parametrize("kind", ShapeKind)
def test_a_kind_without_an_answer_is_an_error_with_the_concern(kind):
    """Not an answer of another kind, when a shape of it comes."""
    table = {each: each.name for each in ShapeKind if each is not kind}
    with pytest.raises(TypeError, match=f"^names: no answer for shapes of kind {kind.name}$"):
        every_kind("names", table)
