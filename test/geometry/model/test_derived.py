"""What is derived holds as long as the parts that it names, and no longer."""

import threading

from interrupting import instruction_count, interrupted_at
import pytest

from scene_graph_ros.geometry.model.derived import (
    derived,
    derived_of_constant,
    DerivedValues,
    Part,
    renewed,
)
from scene_graph_ros.geometry.model.memory import Memory
from scene_graph_ros.geometry.model.roles import Role


class Model:
    """A model with one number."""

    def __init__(self, number=1):
        self.number = number
        self.derived = DerivedValues()


@pytest.fixture
def made():
    """Collect what is computed, in order."""
    return []


@pytest.mark.parametrize(
    ("changed", "is_kept"),
    [
        ((), True),
        ((Part.FILTERS,), True),
        ((Role.ILLUSTRATION, Role.PERCEPTION), True),
        ((Part.FRAMES,), False),
        ((Role.ILLUSTRATION, Role.PROXIMITY), False),
    ],
)
def test_a_value_is_forgotten_with_a_part_it_depends_on(made, changed, is_kept):
    """And with no other part."""

    @derived(Part.FRAMES, Role.PROXIMITY)
    def double(model):
        made.append(model.number)
        return 2 * model.number

    model = Model()
    assert double(model) == double(model) == 2
    model.number = 5
    model.derived = model.derived.without(changed)
    assert double(model) == (2 if is_kept else 10)
    assert made == ([1] if is_kept else [1, 5])


def test_arguments_have_values_of_their_own_also_none(made):
    """Each is computed once, also where it is None."""

    @derived(Part.FRAMES)
    def times(model, factor):
        made.append(factor)
        return model.number * factor if factor else None

    model = Model(3)
    assert [times(model, k) for k in (2, 0, 2, 0, 4)] == [6, None, 6, None, 12]
    assert made == [2, 0, 4]


def test_a_copy_goes_its_own_way():
    """It has what was derived before; what it forgets, the original keeps."""

    @derived(Part.FRAMES)
    def token(model):
        return object()

    model, copy = Model(), Model()
    first = token(model)
    copy.derived = model.derived.copy()
    assert token(copy) is first
    copy.derived = copy.derived.without((Part.FRAMES,))
    assert token(copy) is not first
    assert token(model) is first


def test_an_interrupt_leaves_nothing_of_a_computation():
    """Wherever it comes, what this thread then asks depends on nothing that it was about."""
    model = Model()

    @derived(Part.FRAMES)
    def inner(model):
        return model.number

    @derived(Part.FRAMES, Part.FILTERS)
    def outer(model):
        return inner(model)

    @derived(Part.FILTERS)
    def other(model):
        return model.number

    for at in range(instruction_count(lambda: outer(Model()))):
        model = Model()
        interrupted_at(lambda model=model: outer(model), at)
        assert outer(model) == other(model) == inner(model) == 1


def test_what_is_renewed_gets_the_value_of_before_once():
    """Of two changes in a row the value before both; None after a failure took it."""

    @renewed(Role.PROXIMITY)
    def history(model, before):
        if model.number < 0:
            raise ValueError(model.number)
        return [*(before or []), model.number]

    model = Model()
    assert history(model) == [1]
    for _ in range(2):
        model.derived = model.derived.without((Role.PROXIMITY,))
    model.number = 2
    assert history(model) == [1, 2]
    model.derived = model.derived.without((Role.PROXIMITY,))
    model.number = -1
    with pytest.raises(ValueError, match="-1"):
        history(model)
    model.number = 3
    assert history(model) == [3]


def test_what_reads_more_than_it_says_is_refused():
    """A value could go stale with one that it reads, also with one that was computed before."""

    @derived(Part.FRAMES, Role.PROXIMITY)
    def inner(model):
        return model.number

    @derived(Role.PROXIMITY)
    def outer(model):
        return inner(model)

    @derived(Role.PROXIMITY, Part.FILTERS, Part.FRAMES)
    def careful(model):
        return inner(model)

    model = Model()
    for _ in range(2):
        with pytest.raises(AssertionError, match=r"outer reads inner.*FRAMES"):
            outer(model)
        assert careful(model) == inner(model) == 1


def test_one_thread_computes_and_others_wait():
    """Whoever asks at the same time gets the same object."""
    begun, go = threading.Event(), threading.Event()

    @derived(Part.FRAMES)
    def token(model):
        begun.set()
        assert go.wait(60)
        return object()

    model, seen = Model(), []
    threads = [threading.Thread(target=lambda: seen.append(token(model))) for _ in range(3)]
    for thread in threads:
        thread.start()
    assert begun.wait(60)
    go.set()
    for thread in threads:
        thread.join()
    assert len(seen) == 3
    assert len(set(seen)) == 1


def test_of_what_never_changes_a_value_is_kept_for_good():
    """Once for each argument."""

    class Constant:
        def __init__(self):
            self.derived_for_good = DerivedValues()

    @derived_of_constant
    def token(constant, name):
        return object()

    constant = Constant()
    assert token(constant, "a") is token(constant, "a")
    assert token(constant, "a") is not token(constant, "b")
    assert token(constant, "a") is not token(Constant(), "a")


def test_a_context_remembers_what_is_about_the_same_object(made):
    """Another object begins anew, also an equal one; names tell apart what is begun alike."""

    def begin(about):
        made.append(about)
        return [about]

    memory, about, equal = Memory(), [1, 2], [1, 2]
    first = memory.of(begin, about)
    assert memory.of(begin, about) is first
    assert memory.of(begin, about, "other") is not first
    assert memory.of(begin, equal) is not first
    assert made == [[1, 2]] * 3
