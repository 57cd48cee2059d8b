"""Queries about shapes of many elements; imported when a scene with one is first asked about."""
