"""Questions that each convex set answers, and the certificates of the answers."""
