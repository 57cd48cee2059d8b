from collections.abc import Sequence
import pickle

import numpy as np
import pytest

from scene_graph_ros.geometry.model.ids import GeometryId
from scene_graph_ros.geometry.query.results import (
    LateColumns,
    PenetrationAsPointPair,
    Penetrations,
    PointDistances,
)


@pytest.fixture(name="table")
def _table():
    return Penetrations(
        {
            "id_A": np.array([3, 3, 5]),
            "id_B": np.array([4, 9, 7]),
            "p_WCa": np.arange(9.0).reshape(3, 3),
            "p_WCb": np.arange(9.0, 18.0).reshape(3, 3),
            "nhat_BA_W": np.eye(3),
            "depth": np.array([0.1, 0.2, 0.3]),
        }
    )


def test_records_carry_ids_and_numbers(table):
    """A record has GeometryIds, Python floats and rows of the columns."""
    record = table[1]
    assert isinstance(record, PenetrationAsPointPair)
    assert (record.id_A, record.id_B) == (GeometryId(3), GeometryId(9))
    assert type(record.depth) is float
    assert record.depth == 0.2
    assert record.p_WCb.tolist() == [12.0, 13.0, 14.0]
    assert record.ddistance_dX_WA is None
    with pytest.raises(AttributeError):
        record.depth = 1.0


def test_columns_are_arrays_of_the_same_names_and_read_only(table):
    """Ids are integers in columns; nothing can be written."""
    assert table.id_A.dtype == np.int64
    assert table.p_WCa.shape == (3, 3)
    assert table.columns["depth"] is table.depth
    with pytest.raises(ValueError, match="read-only"):
        table.depth[0] = 1.0
    with pytest.raises(ValueError, match="read-only"):
        table[0].p_WCa[0] = 1.0
    with pytest.raises(AttributeError, match="Penetrations has no column 'distance'"):
        table.distance  # noqa: B018
    with pytest.raises(AttributeError):
        table.depth = np.zeros(3)


def test_table_is_a_sequence(table):
    """Length, iteration, negative indices, slices and errors are those of a list."""
    assert isinstance(table, Sequence)
    assert len(table) == 3
    assert [record.depth for record in table] == [0.1, 0.2, 0.3]
    assert [record.depth for record in reversed(table)] == [0.3, 0.2, 0.1]
    assert table[-1].id_A == GeometryId(5)
    assert table[:2].depth.tolist() == [0.1, 0.2]
    assert table[::-1].id_B.tolist() == [7, 9, 4]
    assert len(table[5:]) == 0
    assert not table[3:]
    with pytest.raises(IndexError):
        table[3]


def test_slice_shares_memory(table):
    """A slice copies nothing."""
    assert np.shares_memory(table[1:].p_WCa, table.p_WCa)


def test_repr_and_pickle(table):
    """The text names type, size and columns; a copy through pickle is equal and read-only."""
    assert repr(table).startswith("<Penetrations: 3 x (id_A, id_B, p_WCa")
    copy = pickle.loads(pickle.dumps(table))
    assert np.array_equal(copy.p_WCa, table.p_WCa)
    assert not copy.p_WCa.flags.writeable


def test_late_columns_are_made_once_when_looked_at():
    """A column may be given as what makes it: it is made at the first look, once, read-only."""
    made = []

    def make(source):
        made.append(source)
        return np.array([4, 7, 9])

    recipes = {
        "point": lambda source: np.zeros(3, np.int64),
        "id_G": make,
        "p_GN": lambda source: np.eye(3),
        "distance": lambda source: np.array([0.1, 0.2, 0.3]),
        "grad_W": lambda source: np.eye(3),
        "is_grad_W_unique": lambda source: np.ones(3, np.bool_),
    }
    table = PointDistances(LateColumns(recipes, 1, 3))
    assert len(table) == 3
    assert list(table.columns)[:2] == ["point", "id_G"]
    assert not made
    assert table.id_G is table.columns["id_G"]
    assert table[1].id_G == GeometryId(7)
    assert table[1:].id_G.tolist() == [7, 9]
    assert made == [1]
    with pytest.raises(ValueError, match="read-only"):
        table.id_G[0] = 1
    with pytest.raises(AttributeError, match="has no column"):
        table.nothing  # noqa: B018
    assert len(table.columns) == 6
    copy = pickle.loads(pickle.dumps(table))
    assert copy.id_G.tolist() == [4, 7, 9]
