"""Nearest points of polyhedra and hulls: Goldfarb and Idnani, Wolfe."""
