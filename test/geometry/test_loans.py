"""Memory is lent again when nobody can see it, and never before."""

import gc
import sys
import threading

import numpy as np
import pytest

from scene_graph_ros.geometry.loans import Block, Lender, Loan, RoomLender

SHAPE = (5, 4)


def address(array):
    """Return where an array is."""
    return array.ctypes.data


def leave(array):
    """Leave a new array as it is."""


def test_what_was_begun_by_nobody_is_not_lent_again():
    """Who is interrupted before a new array is written leaves none that counts as written."""
    lender, begun = Lender(SHAPE), []

    def interrupted(array):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        lender.take(interrupted)
    array = lender.take(lambda new: begun.append(new.fill(3.0)))
    assert len(begun) == 1
    assert (array == 3.0).all()


def test_what_was_dropped_is_lent_again_as_it_was_left():
    """The same memory, with the same content; and the lender says that it is not new."""
    lender, new = Lender(SHAPE), []
    array = lender.take(new.append)
    assert new.pop() is array
    assert type(array) is np.ndarray
    assert array.shape == SHAPE
    assert array.dtype == np.float64
    array[:] = 7.0
    place = address(array)
    del array
    again = lender.take(new.append)
    assert not new
    assert address(again) == place
    assert (again == 7.0).all()


@pytest.mark.parametrize(
    "look",
    [
        lambda a: a,
        lambda a: a[1:],
        lambda a: a[1:][1:],
        lambda a: a.reshape(-1)[3:].view(np.uint8)[::2],
        lambda a: a.T,
        memoryview,
        lambda a: np.frombuffer(memoryview(a.reshape(-1)[2:])),
        lambda a: np.lib.stride_tricks.as_strided(a, (2,), (8,)),
        lambda a: np.broadcast_to(a[0], (3, 4)),
        lambda a: np.asarray(a)[..., None],
        lambda a: iter(a[2:]),
        lambda a: a.flat,
    ],
)
def test_whatever_looks_at_an_array_keeps_it(look):
    """A view of a view, or of another kind, keeps the memory from being lent; then it is free."""
    lender = Lender(SHAPE)
    array = lender.take(leave)
    place, view = address(array), look(array)
    del array
    other = lender.take(leave)
    assert address(other) != place
    del view
    gc.collect()
    assert address(lender.take(leave)) == place


def test_two_are_kept():
    """A lender remembers two arrays: the last is often dropped only after the next has come."""
    lender = Lender(SHAPE)
    seen = set()
    for _ in range(6):
        kept = lender.take(leave)
        seen.add(address(kept))
    assert len(seen) == 2
    held = [lender.take(leave) for _ in range(4)]
    assert len({address(array) for array in held}) == 4


def test_a_part_of_a_block_is_lent_too():
    """Of another type, and from where the borrower wants it; the loan is over when it is gone."""
    block = Block((9,), np.uint8)
    loan = Loan(block[1:].view(np.bool_))
    assert loan.is_over()
    array = loan.lend()
    assert array.dtype == np.bool_
    assert address(array) == address(block) + 1
    tail = array[4:]
    del array
    assert not loan.is_over()
    del tail
    assert loan.is_over()


def test_threads_never_share():
    """Each thread sees only what it wrote itself, whoever else asks the same lender."""
    lender = Lender((64,))
    strangers, start = [], threading.Barrier(4)

    def work(number):
        start.wait()
        for _ in range(2000):
            array = lender.take(leave)
            array[:] = number
            if not (array == number).all():
                strangers.append(number)

    interval = sys.getswitchinterval()
    sys.setswitchinterval(1e-5)
    try:
        threads = [threading.Thread(target=work, args=(number,)) for number in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    finally:
        sys.setswitchinterval(interval)
    assert not strangers


def test_memory_of_another_size_is_let_go_first():
    """Answers of one size alternate between two places, whatever was asked for before."""
    made = []

    def new(count, memory):
        made.append(count)
        return (memory(count),)

    lender = RoomLender(new, 1, 1000)
    lender.take(10)
    lender.take(100)
    last = None
    for _ in range(6):
        last = lender.take(10)
    assert last is not None
    assert made == [10, 100, 10]
