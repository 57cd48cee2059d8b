"""Signed distance from points to shapes: one file per shape, a dispatch and a batch form."""
