"""The closed form of a pendulum's best motion, segment by segment, in one compiled pass.

`pendulum_optimum` says what is computed, and has the names.
"""

import cmath

from scene_graph_ros.geometry.compiled.kernel import lean_kernel

__all__ = ["plan_motion"]


@lean_kernel
def _differentiate(points, derivatives, width, count):
    """Write the derivatives' Bézier points of one degree, ``(count, count)``, order by order.

    ``derivatives[0]`` are the points themselves.
    """
    for i in range(count):
        derivatives[0, i] = points[i]
    degree = count - 1
    for order in range(1, count):
        for i in range(count):
            value = 0.0
            if i < degree:
                value += (degree - i) * (derivatives[order - 1, i + 1] - derivatives[order - 1, i])
            if i > 0:
                value += i * (derivatives[order - 1, i] - derivatives[order - 1, i - 1])
            derivatives[order, i] = value / width


@lean_kernel
def _write_polynomials(series, derivatives, axis, k, s2, x):
    """Write the polynomial parts of s2 and of the state of one axis and segment k."""
    count = len(derivatives)
    for i in range(count):
        for which in range(2):
            gradient, state = 0.0, 0.0
            for order in range(count):
                gradient += derivatives[order, i] * series[which, order, axis]
                state += derivatives[order, i] * series[2 + which, order, axis]
            s2[which, k, i, axis], x[which, k, i, axis] = gradient, state


@lean_kernel
def _write_growing(p, first, axis, widths, s2, fades, beta):
    """Write the coefficients of s2's mode, from the last segment to the first."""
    segments, after, fade = len(widths), 0.0j, 0.0j
    ahead, ahead_rate = 0.0, 0.0
    for back in range(segments):
        k = segments - 1 - back
        jump = ahead - s2[0, k, -1, axis]
        jump_rate = ahead_rate - s2[1, k, -1, axis]
        # The left eigenvector of s2's equation is (1, -p), the right one (K1, p).
        after = (jump - p * jump_rate) / (first - p * p) + fade * after
        beta[k, axis] = after
        fade = fades[k]
        ahead, ahead_rate = s2[0, k, 0, axis], s2[1, k, 0, axis]


@lean_kernel
def _write_fading(p, carried, axis, start, x, fades, beta, alpha):
    """Write the coefficients of the state's own mode, from the first segment to the last."""
    before, before_rate = start[0], start[1]
    mode, fade = 0.0j, 0.0j
    for k in range(len(beta)):
        at_end = carried * beta[k, axis]
        at_start = at_end * fades[k]
        jump = before - x[0, k, 0, axis] - 2.0 * at_start.real
        jump_rate = before_rate - x[1, k, 0, axis] - 2.0 * (p * at_start).real
        # The left eigenvector of the closed loop is (K2 - p, 1), the right one (1, -p).
        mode = (p.conjugate() * jump + jump_rate) / (-2.0j * p.imag) + fade * mode
        alpha[k, axis] = mode
        fade = fades[k]
        before = x[0, k, -1, axis] + 2.0 * at_end.real
        before_rate = x[1, k, -1, axis] + 2.0 * (p * at_end).real


@lean_kernel
def plan_motion(axes, optimum, wanted, scratch, motion):
    """Write the best motion after wanted points.

    Args:
        axes: T and its inverse ``(2, 2, 2)``.
        optimum: the modes, the gains of positions, what carries the state, and the series
            ``(4, k, 2)``.
        wanted: points ``(p, k, 2)``, segments' widths ``(p,)``, the final point ``(2,)`` and the
            state ``(4,)`` at the start.
        scratch: eta ``(k,)``, derivatives ``(k, k)`` and fades ``(p,)``.
        motion: written are s2 and x ``(2, p, k, 2)``, beta and alpha ``(p, 2)``, twice the modes
            ``(p, 4, 2)``, and the points ``(p, k, 2)`` of the centre of mass.

    """
    rates, firsts, carries, series = optimum
    points, widths, final, x0 = wanted
    eta, derivatives, fades = scratch
    s2, x, beta, alpha, modes, com = motion
    T, inverse = axes[0], axes[1]
    segments, count = len(widths), points.shape[1]
    for axis in range(2):
        a, b = inverse[axis, 0], inverse[axis, 1]
        p = rates[axis]
        for k in range(segments):
            for i in range(count):
                eta[i] = a * (points[k, i, 0] - final[0]) + b * (points[k, i, 1] - final[1])
            _differentiate(eta, derivatives, widths[k], count)
            _write_polynomials(series, derivatives, axis, k, s2, x)
            fades[k] = cmath.exp(-p * widths[k])
        _write_growing(p, firsts[axis], axis, widths, s2, fades, beta)
        start = (
            a * (x0[0] - final[0]) + b * (x0[1] - final[1]),
            a * x0[2] + b * x0[3],
        )
        _write_fading(p, carries[axis], axis, start, x, fades, beta, alpha)
    for k in range(segments):
        for j in range(2):
            for axis in range(2):
                modes[k, axis, j] = 2.0 * alpha[k, axis] * T[j, axis]
                modes[k, 2 + axis, j] = 2.0 * carries[axis] * beta[k, axis] * T[j, axis]
            for i in range(count):
                com[k, i, j] = final[j] + T[j, 0] * x[0, k, i, 0] + T[j, 1] * x[0, k, i, 1]
