"""Velocities that are asked for, and the nearest ones that a robot may have."""
