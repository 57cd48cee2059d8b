"""Identifiers are hashable, ordered values of their own types."""

import copy
import itertools
import pickle
import threading

import pytest

from scene_graph_ros.geometry import FilterId, FrameId, GeometryId, SourceId

TYPES = [SourceId, FrameId, GeometryId, FilterId]


@pytest.mark.parametrize("id_type", TYPES)
def test_new_ids_are_valid_different_and_ascending(id_type):
    """Each new id is larger than the one before."""
    first, second = id_type.get_new_id(), id_type.get_new_id()
    assert first.is_valid()
    assert first != second
    assert first < second <= second
    assert second > first >= first
    assert sorted([second, first]) == [first, second]


@pytest.mark.parametrize("id_type", TYPES)
def test_value_makes_the_id(id_type):
    """An id is its value: equal, hashed, copied and pickled by it."""
    new = id_type.get_new_id()
    for same in (id_type(new.get_value()), copy.deepcopy(new), pickle.loads(pickle.dumps(new))):
        assert same == new
        assert len({same, new}) == 1
    assert int(new) == new.get_value()
    assert repr(new) == f"{id_type.__name__}({new.get_value()})"


@pytest.mark.parametrize("id_type", TYPES)
def test_default_id_is_invalid(id_type):
    """An id without a value names nothing and has no value."""
    assert not id_type().is_valid()
    with pytest.raises(ValueError, match="invalid"):
        id_type().get_value()


@pytest.mark.parametrize(("a", "b"), list(itertools.permutations(TYPES, 2)))
def test_ids_of_different_types_do_not_mix(a, b):
    """The same number is another thing in another type, and cannot be ordered with it."""
    assert a(7) != b(7)
    assert len({a(7), b(7)}) == 2
    for compare in ("__lt__", "__le__", "__gt__", "__ge__"):
        assert getattr(a(7), compare)(b(8)) is NotImplemented
    with pytest.raises(TypeError):
        sorted([a(7), b(8)])


@pytest.mark.parametrize("value", [-1, 1.0, "1", True, None])
def test_bad_value_is_refused(value):
    """Only non-negative integers are values."""
    with pytest.raises(ValueError, match="FrameId"):
        FrameId(value)


def test_ids_are_immutable():
    """Nothing can be set on an id."""
    with pytest.raises(AttributeError, match="immutable"):
        FrameId.get_new_id()._value = 3


def test_threads_get_different_ids():
    """Ids drawn by several threads at once are all different."""
    drawn: list[GeometryId] = []
    threads = [
        threading.Thread(target=lambda: drawn.extend(GeometryId.get_new_id() for _ in range(2000)))
        for _ in range(4)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(set(drawn)) == 8000
