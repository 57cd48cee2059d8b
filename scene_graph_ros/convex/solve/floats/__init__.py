"""Decisions about rows in floats, each with a bound of its rounding."""
