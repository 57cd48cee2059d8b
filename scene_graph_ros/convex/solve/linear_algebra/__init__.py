"""Linear systems in kernels, and sums in doubled precision."""
