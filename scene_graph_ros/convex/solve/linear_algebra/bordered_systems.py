"""Positive definite systems with a border: factored with the border beside them.

A system ``(k, k + extra)`` is line by line in a flat array, where it begins at ``at``.
"""

from __future__ import annotations

import numpy as np

from scene_graph_ros.geometry.compiled.kernel import lean_kernel

__all__ = ["add_border", "eliminate", "substitute_backward", "substitute_forward"]


@lean_kernel
def eliminate(k, width, at, systems):
    """Factor the first k columns as U' U, and replace the others by U'^-1 times them.

    False where they are not positive definite. Only entries on and above the diagonal are read.
    """
    for i in range(k):
        own = systems[at + i * width + i : at + (i + 1) * width]
        p = 0
        # Four lines at once, of which what is loaded is used four times.
        while p + 4 <= i:
            first = at + p * width
            line0 = systems[first + i : first + width]
            line1 = systems[first + width + i : first + 2 * width]
            line2 = systems[first + 2 * width + i : first + 3 * width]
            line3 = systems[first + 3 * width + i : first + 4 * width]
            f0, f1, f2, f3 = line0[0], line1[0], line2[0], line3[0]
            for j in range(len(own)):
                own[j] -= f0 * line0[j] + f1 * line1[j] + f2 * line2[j] + f3 * line3[j]
            p += 4
        while p < i:
            line0 = systems[at + p * width + i : at + (p + 1) * width]
            f0 = line0[0]
            for j in range(len(own)):
                own[j] -= f0 * line0[j]
            p += 1
        pivot = own[0]
        if not pivot > 0.0:
            return False
        factor = 1.0 / np.sqrt(pivot)
        for j in range(len(own)):
            own[j] *= factor
    return True


@lean_kernel
def add_border(k, f, at, systems, out):
    """Add to the upper triangle of ``out (f, f)`` V' V of a factored system's other columns V."""
    for e in range(k):
        first = at + e * (k + f) + k
        line = systems[first : first + f]
        for i in range(f):
            factor, own = line[i], out[i * f : (i + 1) * f]
            for j in range(i, f):
                own[j] += factor * line[j]


@lean_kernel
def substitute_forward(k, width, at, systems, first, x):
    """Solve ``U' z = x`` in place, of k numbers of x from ``first`` on."""
    for i in range(k):
        own = at + i * width
        value = x[first + i] / systems[own + i]
        x[first + i] = value
        for j in range(i + 1, k):
            x[first + j] -= systems[own + j] * value


@lean_kernel
def substitute_backward(k, width, at, systems, first, x):
    """Solve ``U z = x`` in place, of k numbers of x from ``first`` on."""
    for i in range(k - 1, -1, -1):
        own = at + i * width
        value = x[first + i]
        for j in range(i + 1, k):
            value -= systems[own + j] * x[first + j]
        x[first + i] = value / systems[own + i]
