"""Affine expressions and atoms of costs and constraints."""
