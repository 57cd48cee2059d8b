"""Numbers in pictures of contacts do not cover each other."""

from pathlib import Path

ROOT = Path(__file__).parents[2]


def test_numbers_that_would_overlap_are_put_below_each_other(monkeypatch):
    """Each 20 pixels from all others, in one direction at least; alone they stay."""
    monkeypatch.syspath_prepend(str(ROOT / "examples"))
    from common.picture import free_place

    taken = []
    places = [free_place(x, y, taken) for x, y in ((0, 0), (5, 3), (100, 0), (10, 22), (0, 0))]
    assert places[0] == (0, 0) and places[2] == (100, 0)
    for k, (x, y) in enumerate(places):
        assert all(max(abs(x - a), abs(y - b)) >= 20 for a, b in places[:k])
