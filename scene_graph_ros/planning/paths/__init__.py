"""Paths between configurations, each of whose edges is proven free."""
