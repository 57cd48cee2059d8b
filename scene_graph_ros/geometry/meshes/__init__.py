"""Triangle meshes and hulls: reading, checking, bounding volumes, tables for kernels."""
