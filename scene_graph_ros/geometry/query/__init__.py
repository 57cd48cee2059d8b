"""Questions to a scene: penetration, distance, points, candidates."""
