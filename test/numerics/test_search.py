"""Random and adversarial pairs: a short search, and every counterexample that one ever found."""

import json

from hard_corpus.adversarial import (
    adversarial_cases,
    case_from_text,
    KEPT,
    mesh_cases,
    violations,
)
import numpy as np
import pytest
from searching import times

TEXTS = [json.loads(line) for line in KEPT.read_text().splitlines()]
OPEN = {text["label"] for text in TEXTS if text.get("open")}


def _parameter(text):
    reason = text.get("open")
    marks = [pytest.mark.xfail(strict=True, reason=reason)] if reason else []
    return pytest.param(text, id=text["label"], marks=marks)


@pytest.mark.parametrize("text", [_parameter(text) for text in TEXTS])
def test_counterexample_stays_fixed(text):
    """A pair that broke an invariant once no longer does."""
    assert violations([case_from_text(text)]) == []


@pytest.mark.search
@pytest.mark.parametrize("first", [100_000, 200_000])
def test_search_finds_nothing_new(first):
    """6000 queries: unit normals, witnesses on surfaces, bounds from both sides, symmetry."""
    for seed in range(first, first + times(1)):
        cases = [case for case in adversarial_cases(2000, seed) if case.label not in OPEN]
        assert violations(cases) == []


@pytest.mark.search
def test_search_among_meshes_finds_nothing_new():
    """3000 queries with triangles on features that meet: hulls, ridges, pits, other sizes."""
    for seed in range(100_000, 100_000 + times(1)):
        cases = [case for case in mesh_cases(1000, seed) if case.label not in OPEN]
        assert violations(cases) == []


def test_text_of_a_case_is_exact():
    """A case that is written and read again is the same, bit for bit."""
    for text in TEXTS:
        case = case_from_text(text)
        X = np.array([float.fromhex(x) for x in text["X_WB"]]).reshape(3, 4)
        assert np.array_equal(case.X_WB[:3], X)
        if text["B"]["kind"] == "Box":
            assert case.B.width.hex() == text["B"]["sizes"][0]


def test_the_search_covers_all_pairs():
    """A search meets all 35 pairs of the eight shapes, apart and overlapping."""
    kinds = {
        tuple(sorted((case.A.type_name, case.B.type_name)))
        for case in adversarial_cases(2000, 100_000)
    }
    assert len(kinds) == 35
