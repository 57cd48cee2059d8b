"""Volumes of sets, and samples in them."""
