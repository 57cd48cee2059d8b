"""The benchmark of gaps of trajectories through regions: more work leaves no larger gap."""

from itertools import pairwise
import re

import numpy as np
from PIL import Image

from benchmarks import gcs_gaps


def test_gaps_are_measured_and_drawn(capsys, tmp_path):
    """Bounds are below costs, the search ends with the least gap, and there is a picture."""
    output = tmp_path / "gaps.png"
    arguments = ["--sizes", "4", "--orders", "1", "2", "--most-programs", "100"]
    assert gcs_gaps.main([*arguments, "--output", str(output)]) == 0
    rows = re.findall(
        r"^ *4x4 +(\d) (.{22}) +(\d+) +\S+ +(\S+) +(\S+) +\S+$", capsys.readouterr().out, re.M
    )
    assert {order for order, *_ in rows} == {"1", "2"}
    for order in "12":
        found = [
            (way.strip(), float(cost), float(bound))
            for of, way, _, cost, bound in rows
            if of == order
        ]
        best = min(cost for _, cost, _ in found)
        assert all(bound <= best + 1e-5 for _, _, bound in found)
        by_search = [cost - bound for way, cost, bound in found if way == "branch and bound"]
        assert all(after <= before + 1e-5 for before, after in pairwise(by_search))
        assert by_search[-1] <= 1e-4
        loose, tight = (
            next(bound for way, _, bound in found if way == name)
            for name in ("loose relaxation", "relaxation")
        )
        assert loose <= tight + 1e-5
    pixels = np.asarray(Image.open(output).convert("RGB"), dtype=int).reshape(-1, 3)
    for color in ((0x1F, 0x6F, 0xB4), (0xD1, 0x49, 0x5B)):
        assert (np.abs(pixels - color).max(axis=1) < 8).any()
