"""A face, a side or an edge that ends just beside the end of another: no answer is left open."""

from hard_corpus.adversarial import violations
from hard_corpus.borders import border_cases, tent_cases
import pytest
from searching import times


@pytest.mark.search
def test_borders_beside_borders():
    """Cylinders beside what is parallel, which share a strip or a corner of any width.

    6000 queries: witnesses on both surfaces, bounds from both sides, symmetry.
    """
    for seed in range(100, 100 + times(1)):
        assert violations(border_cases(2000, seed)) == []


@pytest.mark.search
def test_bases_beside_bases():
    """Hulls on each other with faces that are parallel but for 1e-7 rad or less.

    6000 queries: the corner after the next may be far from there, along a normal turned by as
    little.
    """
    for seed in range(100, 100 + times(1)):
        assert violations(tent_cases(2000, seed)) == []
