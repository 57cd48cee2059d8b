"""Trajectories from start to goal in one call: searched, shortened, timed and proven."""
