"""Where the contact of two cores may be: GJK, and the expanding polytope algorithm."""
