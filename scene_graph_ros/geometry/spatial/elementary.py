"""Sines, cosines and arcs in our own arithmetic, which has the same bits on every processor.

A C library has one code for each kind of processor, and another in its next version; their last
bits differ. Here a result is off by a unit in the last place or two.
"""

from __future__ import annotations

from fractions import Fraction
import math

import numpy as np

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, kernel, lean_kernel
from scene_graph_ros.geometry.compiled.lanes import (
    all_of,
    LANES,
    load_lanes,
    magnitude,
    select,
    store_lanes,
)

__all__ = [
    "arc_sine",
    "arc_sines",
    "arc_tangent",
    "arc_tangents",
    "binary_logarithm",
    "sine_cosine",
    "sines_and_cosines",
    "sines_cosines",
]

_PI = Fraction(314159265358979323846264338327950288419716939937510582097494, 10**59)


def _in_parts(value: Fraction) -> tuple[float, float, float]:
    """Return three floats that add up to a number; multiples of the first two are exact."""
    first = float(Fraction(math.floor(value * 2**32), 2**32))
    second = float(Fraction(math.floor((value - Fraction(first)) * 2**66), 2**66))
    return first, second, float(value - Fraction(first) - Fraction(second))


_TURN_1, _TURN_2, _TURN_3 = _in_parts(_PI / 2)
_TURNS = float(2 / _PI)
_TO_WHOLE = 1.5 * 2.0**52  # Added and taken away again it leaves a whole number.
_FAR = 1e5  # rad. Farther away quarter turns have too many digits for the parts above.
_FULL = float(2 * _PI)
_BEYOND_FULL = float(2 * _PI - Fraction(_FULL))

_S3, _S5, _S7, _S9 = (
    float(Fraction(s, math.factorial(n))) for s, n in ((-1, 3), (1, 5), (-1, 7), (1, 9))
)
_S11, _S13, _S15, _S17 = (
    float(Fraction(s, math.factorial(n))) for s, n in ((-1, 11), (1, 13), (-1, 15), (1, 17))
)
_C4, _C6, _C8, _C10 = (
    float(Fraction(s, math.factorial(n))) for s, n in ((1, 4), (-1, 6), (1, 8), (-1, 10))
)
_C12, _C14, _C16, _C18 = (
    float(Fraction(s, math.factorial(n))) for s, n in ((1, 12), (-1, 14), (1, 16), (-1, 18))
)


@inlined_kernel
def _series(angle):
    """Return the sine and cosine of an angle's remainder, and the number of quarter turns.

    Of one angle, or of one in each lane. Quarter turns are taken off in three parts (Cody and
    Waite, *Software Manual for the Elementary Functions*, 1980); the remainder is at most an
    eighth of a turn, for which Taylor's series need eight terms.
    """
    turns = (angle * _TURNS + _TO_WHOLE) - _TO_WHOLE
    x = ((angle - turns * _TURN_1) - turns * _TURN_2) - turns * _TURN_3
    y = x * x
    s = _S11 + y * (_S13 + y * (_S15 + y * _S17))
    s = _S3 + y * (_S5 + y * (_S7 + y * (_S9 + y * s)))
    c = _C12 + y * (_C14 + y * (_C16 + y * _C18))
    c = _C4 + y * (_C6 + y * (_C8 + y * (_C10 + y * c)))
    s = x + x * (y * s)
    half = 0.5 * y
    base = 1.0 - half
    c = base + (((1.0 - base) - half) + y * (y * c))
    return s, c, turns - 4.0 * ((0.25 * turns + _TO_WHOLE) - _TO_WHOLE)


@lean_kernel
def sine_cosine(angle):
    """Return the sine and cosine of an angle, rad.

    Beyond 1e5 rad they are right to 1e-15; beyond 1e16, where floats are turns apart, they are
    those of some angle.
    """
    if abs(angle) > _FAR:
        # The remainder by a turn as a float is exact, what a turn is longer than that is known.
        far = abs(angle)
        rest = far % _FULL
        rest = (rest - (far - rest) / _FULL * _BEYOND_FULL) % _FULL
        angle = math.copysign(rest, angle)
    s, c, quarter = _series(angle)
    if quarter == 1.0:
        return c, -s
    if quarter == -1.0:
        return -c, s
    if abs(quarter) == 2.0:
        return -s, -c
    return s, c


@kernel
def sines_and_cosines(angles):
    """Return the sines and cosines ``(n,)`` of angles ``(n,)``, rad; see ``sine_cosine``."""
    sines, cosines = np.empty(len(angles)), np.empty(len(angles))
    for i in range(len(angles)):
        sines[i], cosines[i] = sine_cosine(angles[i])
    return sines, cosines


@inlined_kernel
def sines_cosines(angles, sines, cosines):
    """Write sines and cosines of LANES angles, rad: those of ``sine_cosine``, bit for bit."""
    angle = load_lanes(angles, 0)
    s, c, quarter = _series(angle)
    is_odd, is_half = magnitude(quarter) == 1.0, magnitude(quarter) == 2.0
    sine, cosine = select(is_odd, c, s), select(is_odd, s, c)
    store_lanes(sines, 0, select((quarter == -1.0) | is_half, -sine, sine))
    store_lanes(cosines, 0, select((quarter == 1.0) | is_half, -cosine, cosine))
    if not all_of(magnitude(angle) <= _FAR):
        for k in range(LANES):
            if not abs(angles[k]) <= _FAR:
                sines[k], cosines[k] = sine_cosine(angles[k])


_STEPS = 16
_DIGITS = 2**160
_LARGE, _SHIFT = 1e200, 2.0**500
"""What is larger, or smaller than its inverse, is shifted: products stay among the numbers."""


def _arc(tangent: Fraction) -> Fraction:
    """Return an arc of a tangent of at most 1, to 140 digits of the binary system.

    By Euler's series, whose terms shrink by half or more.
    """
    square = tangent * tangent / (1 + tangent * tangent)
    term = total = round(tangent / (1 + tangent * tangent) * _DIGITS)
    for n in range(1, 170):
        term = term * 2 * n * square.numerator // ((2 * n + 1) * square.denominator)
        total += term
    return Fraction(total, _DIGITS)


def _in_two(value: Fraction) -> tuple[float, float]:
    return float(value), float(value - Fraction(float(value)))


_ARCS = np.array([_in_two(_arc(Fraction(k, _STEPS))) for k in range(_STEPS + 1)])
"""Arcs of the tangents k / 16, each as a float and what that is off."""
_QUARTER_1, _QUARTER_2 = _in_two(_PI / 2)
_HALF_1, _HALF_2 = _in_two(_PI)
_A3, _A5, _A7, _A9, _A11, _A13 = (
    float(Fraction(s, n)) for s, n in ((-1, 3), (1, 5), (-1, 7), (1, 9), (-1, 11), (1, 13))
)


@lean_kernel
def _arc_below(near, far):
    """Return the arc of the tangent near / far, at most 1, as a float and its error.

    The tangent of the difference to the nearest of 17 known arcs is at most 1/30, for which the
    series needs seven terms.
    """
    if not near <= far:
        return math.nan, 0.0
    if far == 0.0 or far == math.inf:
        return (0.5 * _QUARTER_1 if near == math.inf else 0.0), 0.0
    if far > _LARGE:
        near, far = near / _SHIFT, far / _SHIFT
    elif far < 1.0 / _LARGE:
        near, far = near * _SHIFT, far * _SHIFT
    k = int(near / far * _STEPS + 0.5)
    tangent = k / _STEPS
    rest = (near - tangent * far) / (far + tangent * near)
    z = rest * rest
    series = _A3 + z * (_A5 + z * (_A7 + z * (_A9 + z * (_A11 + z * _A13))))
    return _ARCS[k, 0], rest + (_ARCS[k, 1] + rest * (z * series))


@lean_kernel
def arc_tangent(y, x):
    """Return the angle in [-pi, pi], rad, of the direction (x, y), as ``math.atan2`` does."""
    far, near = abs(x), abs(y)
    if near > far:
        arc, off = _arc_below(far, near)
        turned = _QUARTER_1 - arc
        arc, off = turned, ((_QUARTER_1 - turned) - arc) + (_QUARTER_2 - off)
    else:
        arc, off = _arc_below(near, far)
    if math.copysign(1.0, x) < 0.0:
        turned = _HALF_1 - arc
        arc, off = turned, ((_HALF_1 - turned) - arc) + (_HALF_2 - off)
    return math.copysign(arc + off, y)


@kernel
def arc_tangents(y, x):
    """Return the angles ``(n,)`` of directions, rad; see ``arc_tangent``."""
    result = np.empty(len(y))
    for i in range(len(y)):
        result[i] = arc_tangent(y[i], x[i])
    return result


@lean_kernel
def arc_sine(sine):
    """Return the angle in [-pi/2, pi/2], rad, of a sine in [-1, 1]."""
    return arc_tangent(sine, math.sqrt((1.0 - sine) * (1.0 + sine)))


@kernel
def arc_sines(sines):
    """Return the angles ``(n,)`` of sines ``(n,)``; see ``arc_sine``."""
    result = np.empty(len(sines))
    for i in range(len(sines)):
        result[i] = arc_sine(sines[i])
    return result


_PER_LOGARITHM = 2.0 / 0.6931471805599453  # 2 / log(2)
_ROOT_OF_HALF = 0.7071067811865476


@lean_kernel
def binary_logarithm(x):
    """Return the logarithm to base 2 of a positive number, to 2e-16 of the larger of it and 1.

    By the series of the inverse hyperbolic tangent of the quotient by a power of two, which is
    at most 1/5.8.
    """
    fraction, exponent = math.frexp(x)
    if fraction < _ROOT_OF_HALF:
        fraction, exponent = 2.0 * fraction, exponent - 1
    t = (fraction - 1.0) / (fraction + 1.0)
    z, total = t * t, 0.0
    for n in range(21, 0, -2):
        total = total * z + 1.0 / n
    return exponent + _PER_LOGARITHM * (t * total)
