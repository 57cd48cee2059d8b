"""Tables of many shapes for kernels: arrays, row by row."""
