"""Edges between configurations, straight or curved, and proofs that they are free."""
