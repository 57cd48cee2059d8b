"""The benchmark of certified regions prints what both ways say of the same boxes."""

import re

from benchmarks import certified_regions


def test_both_ways_certify_the_same_boxes(capsys, monkeypatch):
    """A narrow box is proven by both, with what is kept; one that is too wide by none.

    Without Drake there are no times and ratios of it.
    """
    monkeypatch.setattr(certified_regions, "_has_drake", lambda: False)
    options = ["--joints", "2", "--widths", "0.05", "0.2", "--runs", "1", "--grow", "1"]
    certified_regions.main(options)
    text = capsys.readouterr().out
    assert "pydrake is not installed" in text
    narrow, wide = re.findall(r"^ +2 +4 .*$", text, re.M)
    assert narrow.endswith("1 proven") and narrow.count("nan") == 3
    assert wide.endswith("collision") and wide.count("nan") == 8
    assert float(narrow.split("|")[1].split()[2]) > 60.0
    first, second = re.findall(r"^ +[01] +[^|]*\|[^|]*$", text, re.M)
    volumes = [float(line.split()[2]) for line in (first, second)]
    assert volumes[0] == 0.04 and volumes[1] > 0.08


def test_some_pairs_of_a_panda_are_certified(capsys):
    """All that are looked at, and the clearance that they keep, without distances."""
    certified_regions.panda([0.02], every=40)
    (line,) = re.findall(r"^ +0\.020 .*$", capsys.readouterr().out, re.M)
    _, pairs, planes, check, _, _, kept, _, distances = line.split()
    assert int(pairs) == 11 and float(planes) > 0.0 and float(check) > 0.0
    assert float(kept) > 1.0 and distances == "nan"
