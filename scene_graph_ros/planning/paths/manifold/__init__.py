"""Paths along which conditions on links hold."""
