"""The benchmark of reading and uniting: its medians and its table."""

from benchmarks.solids_speed import medians, table_of


def test_medians_leave_out_the_first_run():
    """What runs elsewhere tells its own seconds."""
    told = iter([100.0, 3.0, 1.0, 2.0])
    found = medians({"here": lambda: None}, 3, {"there": lambda: next(told)})
    assert found["there"] == 2.0
    assert 0.0 <= found["here"] < 1.0


def test_the_table_compares_with_the_library_and_with_an_earlier_version():
    """Uniting by what it takes more, reading by how many times as long."""
    unite = {"`manifold3d` alone": 0.3, "reading and uniting them": 0.7}
    read = {"reading it": 0.12, "without the search for crossings": 0.09}
    lines = table_of(unite, {**read, "before repairs": 0.1})
    assert [line.count("|") for line in lines] == [4] * 7
    assert lines[3].endswith("| 700 | 400 ms more |")
    assert lines[-1].endswith("| 120 | 1.20 times |")
    assert table_of(unite, read)[-1].endswith("| 120 |  |")
