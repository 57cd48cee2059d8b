"""Contact surfaces: how hard do bodies press on each other, and where."""
