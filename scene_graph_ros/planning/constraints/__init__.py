"""Conditions on where links are, held at all times of a motion."""
