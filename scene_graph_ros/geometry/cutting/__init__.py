"""Polygons and tetrahedra cut by planes, and the walks that find what meets."""
