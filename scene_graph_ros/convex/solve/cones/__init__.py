"""Programs over cones, and the solvers that take them."""
