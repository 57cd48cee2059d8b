"""How many independent samples chains of dependent ones are worth."""

from __future__ import annotations

import numpy as np

__all__ = ["effective_sample_size"]


def effective_sample_size(chains: np.ndarray) -> float:
    """Return the least effective number of samples of all coordinates of ``(c, s, n)`` chains.

    c chains of s samples each. Variances within and between chains are compared, and correlations
    added up in pairs while they are positive (Geyer 1992; Vehtari, Gelman, Simpson, Carpenter and
    Buerkner, "Rank-normalization, folding, and localization: an improved R-hat", 2021, section 3).
    """
    count, length, _ = chains.shape
    if length < 4:
        return float("nan")
    means = chains.mean(axis=1, keepdims=True)
    spread = chains - means
    size = 1 << (2 * length - 1).bit_length()
    spectrum = np.fft.rfft(spread, size, axis=1)
    products = np.fft.irfft(np.abs(spectrum) ** 2, size, axis=1)[:, :length] / length
    within = products[:, 0].mean(axis=0) * length / (length - 1)
    between = means[:, 0].var(axis=0, ddof=1) if count > 1 else np.zeros(chains.shape[2])
    total = within * (length - 1) / length + between
    worth = [
        _worth(1.0 - (w - p) / t, count * length)
        for w, p, t in zip(within, products.mean(axis=0).T, total, strict=True)
        if t > 0.0
    ]
    return float(min(worth, default=float("nan")))


def _worth(correlations: np.ndarray, count: int) -> float:
    """Return the effective number of samples of a coordinate's correlations ``(s,)``."""
    total, last = 0.0, np.inf
    for k in range(0, len(correlations) - 1, 2):
        pair = (1.0 if k == 0 else correlations[k]) + correlations[k + 1]
        if pair < 0.0:
            break
        last = min(last, pair)
        total += last
    return count / max(2.0 * total - 1.0, 1.0 / np.log10(max(count, 10)))
