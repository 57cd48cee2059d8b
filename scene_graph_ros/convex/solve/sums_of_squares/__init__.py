"""Weighted sums of squares: an interior-point method on small Gram matrices."""
