"""An edit that is interrupted anywhere leaves the world before it or the one after it."""

from edited_worlds import answers_of, EDITS, PREPARATIONS, World
from interrupting import instruction_count, interrupted_at, places
import pytest


def made(name, own):
    """Return a world in which an edit can be made."""
    return World(own=own, prepare=PREPARATIONS.get(name, lambda world: None))


@pytest.mark.search
@pytest.mark.parametrize("own", [False, True], ids=["shared", "own"])
@pytest.mark.parametrize("name", EDITS)
def test_an_interrupted_edit_is_done_or_not(name, own):
    """All answers are those of one of the two worlds, and the edit can then be made."""
    edit = EDITS[name]
    before = answers_of(made(name, own))
    world = made(name, own)
    count = instruction_count(lambda: edit(world))
    after = answers_of(world)
    wrong = []
    for at in places(count, f"{name} {own}"):
        world = made(name, own)
        if not interrupted_at(lambda world=world: edit(world), at):
            continue
        found = answers_of(world)
        if found == before:
            edit(world)
            found = answers_of(world)
        if found != after:
            wrong.append((at, [key for key in found if found[key] != after.get(key)]))
    assert not wrong, f"of {count} instructions {len(wrong)} leave a third world: {wrong[:5]}"
