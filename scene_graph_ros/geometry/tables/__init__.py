"""What kernels read of many shapes: arrays, row by row."""
