"""What a certificate holds: one number changed is found, and so is what only looks right."""

from dataclasses import replace
from fractions import Fraction

from certified_arm import arm_between_posts, free_box
import numpy as np
import pytest

from scene_graph_ros.planning.certified.exact_matrices import ExactStack, is_positive_semidefinite


@pytest.fixture(scope="module")
def proven(tmp_path_factory):
    """A box of tangents in which an arm of two joints is free."""
    return free_box(arm_between_posts(tmp_path_factory.mktemp("arm")))


def changed(certificate, place):
    """Return a certificate with one number changed by a millionth."""
    tiny = Fraction(1, 10**6)
    if place == "clearance":
        return replace(certificate, clearance=certificate.clearance + tiny)
    if place == "plane":
        (first, *rest), *rows = certificate.plane
        return replace(certificate, plane=((first + tiny, *rest), *rows))
    if place == "normal":
        grams = lines(certificate.normal_grams)
        grams[0][0][0] += tiny
        return replace(certificate, normal_grams=tuple(grams))
    grams = [lines(point) for point in certificate.grams]
    if place == "bound":
        grams[0][1][0][0] += tiny
    elif place == "beside the diagonal":
        grams[0][0][0][1] += tiny
        grams[0][0][1][0] += tiny
    elif place == "not symmetric":
        grams[0][0][0][1] += tiny
        grams[0][0][1][0] -= tiny
    else:
        grams[-1][0][0][0] += tiny
    return replace(certificate, grams=tuple(map(tuple, grams)))


def lines(stack):
    """Return matrices as lists of lists of fractions."""
    return [[list(row) for row in gram] for gram in stack]


@pytest.mark.parametrize(
    "place",
    ["clearance", "plane", "normal", "gram", "bound", "beside the diagonal", "not symmetric"],
)
def test_a_changed_number_is_found(proven, place):
    """No certificate survives a change of one of its numbers."""
    pair, certificate = next(iter(proven.certificates.items()))
    assert certificate.verify()
    other = changed(certificate, place)
    assert not other.verify()
    assert not replace(proven, certificates={**proven.certificates, pair: other}).verify()


def test_a_matrix_that_is_not_semidefinite_is_found(proven):
    """Also where the identity holds: what one matrix has less, those of two bounds have more."""
    certificate = next(iter(proven.certificates.values()))
    for much, is_right in ((Fraction(0), True), (Fraction(10), False)):
        grams = [lines(point) for point in certificate.grams]
        for k in range(len(grams[0][0])):
            grams[0][0][k][k] -= much
            grams[0][1][k][k] += much / 2
            grams[0][2][k][k] += much / 2
        other = replace(certificate, grams=tuple(map(tuple, grams)))
        assert other.verify() == is_right
        assert is_right or "not semidefinite" in other.failure()


def test_missing_matrices_are_found(proven):
    """Of a row, of a point, and of another order."""
    certificate = next(iter(proven.certificates.values()))
    grams = [lines(point) for point in certificate.grams]
    for other, reason in (
        (grams[1:], "points are missing"),
        ([grams[0][1:], *grams[1:]], "has other matrices"),
        ([[[[Fraction(1)]] for _ in grams[0]], *grams[1:]], "do not show its clearance"),
    ):
        assert reason in replace(certificate, grams=tuple(map(tuple, other))).failure()
    normal = lines(certificate.normal_grams)
    assert "normal has other" in replace(certificate, normal_grams=normal[1:]).failure()


def test_what_only_looks_like_whole_numbers_is_found(proven):
    """Floats, short words that overflow, and a denominator below zero prove nothing."""
    certificate = next(iter(proven.certificates.values()))
    first, *rest = certificate.grams
    assert replace(certificate, grams=(ExactStack(first.whole, first.common), *rest)).verify()
    for other in (
        ExactStack(first.whole.astype(np.float64), first.common),
        ExactStack(first.whole.astype(np.float64).astype(object), first.common),
        ExactStack(first.whole.astype(np.int32), first.common),
        ExactStack(-first.whole, -first.common),
        ExactStack(first.whole, float(first.common)),
    ):
        assert not replace(certificate, grams=(other, *rest)).verify()


def test_numbers_of_any_size_are_proven(proven):
    """A certificate of fractions with odd denominators, too large for machine words, holds."""
    certificate = next(iter(proven.certificates.values()))
    third, huge = Fraction(1, 3 * 2**70), Fraction(2**40)
    grams = [lines(point) for point in certificate.grams]
    for point in grams:  # what both bounds have more in one place the constant has less, doubled
        point[1][0][0] += third
        point[2][0][0] += third
        point[0][0][0] -= 2 * third
    other = replace(certificate, grams=tuple(map(tuple, grams)))
    assert other.verify()
    grams[0][1][0][0] += huge
    assert not replace(certificate, grams=tuple(map(tuple, grams))).verify()


def test_a_certificate_is_of_its_own_region(proven):
    """It shows nothing of a larger region, nor of all pairs when one is left out."""
    wider = replace(proven.region, upper=proven.region.upper + 1e-6)
    assert not replace(proven, region=wider).verify()
    fewer = dict(list(proven.certificates.items())[1:])
    assert not replace(proven, certificates=fewer).verify()


def test_exact_matrices():
    """Semidefinite is decided exactly, for singular matrices, too."""
    tiny = Fraction(1, 2**200)
    assert is_positive_semidefinite([[Fraction(1), Fraction(1)], [Fraction(1), Fraction(1)]])
    assert not is_positive_semidefinite(
        [[Fraction(1), Fraction(1)], [Fraction(1), Fraction(1) - tiny]]
    )
    assert is_positive_semidefinite(
        [[Fraction(0)] * 2, [Fraction(0), Fraction(1)]]
    ) and not is_positive_semidefinite([[Fraction(0)] * 2, [Fraction(0), -tiny]])
    assert not is_positive_semidefinite([[Fraction(0), tiny], [tiny, Fraction(1)]])
    assert not is_positive_semidefinite([[Fraction(1), tiny], [Fraction(0), Fraction(1)]])
