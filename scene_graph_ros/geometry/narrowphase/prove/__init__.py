"""Is a depth the least of all directions? Proofs that it is."""
