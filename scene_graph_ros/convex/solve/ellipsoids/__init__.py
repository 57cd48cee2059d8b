"""Ellipsoids inscribed in rows and circumscribed about points."""
