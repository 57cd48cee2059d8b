"""Polygons and tetrahedra cut by planes, and the tree walks that find overlaps."""
