"""OMPL's planners, to which our proofs say which motions are free."""
