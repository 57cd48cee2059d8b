"""The memory of answers is used again only when nobody can see it."""

import numpy as np

from scene_graph_ros.geometry.query.point.ask import AnswerMemory

COUNT = 1 << 15


def address(answers):
    """Return where the first column is."""
    return answers[0].ctypes.data


def test_dropped_memory_is_used_again():
    """Who drops one answer before, or just after, the next always gets the same memory."""
    memory = AnswerMemory()
    seen = set()
    for _ in range(5):
        kept = memory.take(COUNT)
        seen.add(address(kept))
    assert len(seen) == 2
    del kept
    assert address(memory.take(COUNT)) in seen


def test_seen_memory_is_left_alone():
    """A view of a column, of any kind, keeps its memory from being used again."""
    memory = AnswerMemory()
    views = []
    for look in (
        lambda a: a[0][5:],
        lambda a: a[1].reshape(-1, 3)[7],
        lambda a: memoryview(a[2]),
        lambda a: a[3][::-1],
    ):
        for _ in range(2):
            answers = memory.take(COUNT)
            for column in answers:
                column[:] = len(views)
            views.append(look(answers))
            del answers
    for _ in range(4):
        for column in memory.take(COUNT):
            column[:] = 100
    for k, view in enumerate(views):
        assert (np.asarray(view) == (k if k < 6 else bool(k))).all()


def test_memory_fits_what_is_asked():
    """Columns are as long as asked; memory much too large or too small is not used."""
    memory = AnswerMemory()
    large = address(memory.take(2 * COUNT))
    columns = memory.take(COUNT + 1)
    assert address(columns) == large
    assert [len(column) for column in columns] == [
        COUNT + 1,
        3 * COUNT + 3,
        3 * COUNT + 3,
        COUNT + 1,
    ]
    del columns
    assert address(memory.take(COUNT - 1)) != large
    longer = memory.take(3 * COUNT)
    assert len(longer[0]) == 3 * COUNT
    assert [len(column) for column in memory.take(0)] == [0, 0, 0, 0]
