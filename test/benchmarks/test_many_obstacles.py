"""The benchmark of many obstacles prints a row with the tree and one without."""

import re

from benchmarks.many_obstacles import main


def test_each_number_of_boxes_has_two_rows(capsys):
    """Of times that are positive."""
    main(["--boxes", "40", "80", "--count", "60"])
    rows = re.findall(
        r"^ +(\d+) (by tree|all pairs) +([\d.]+) +([\d.]+) +([\d.]+)$",
        capsys.readouterr().out,
        re.M,
    )
    assert [row[:2] for row in rows] == [
        ("40", "by tree"),
        ("40", "all pairs"),
        ("80", "by tree"),
        ("80", "all pairs"),
    ]
    assert all(float(each) > 0.0 for row in rows for each in row[2:])
