"""Trajectories through graphs of convex sets: a Bézier curve in each region on the way."""
