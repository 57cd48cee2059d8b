"""One file for each kind of convex set."""
