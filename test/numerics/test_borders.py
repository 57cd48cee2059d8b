"""A face, a side or an edge that ends just beside the end of another: no answer is left open."""

from hard_corpus.adversarial import violations
from hard_corpus.borders import border_cases
import pytest
from searching import times


@pytest.mark.search
def test_borders_beside_borders():
    """Cylinders beside what is parallel, which share a strip or a corner of any width.

    6000 queries: witnesses on both surfaces, bounds from both sides, symmetry.
    """
    for seed in range(100, 100 + times(1)):
        assert violations(border_cases(2000, seed)) == []
