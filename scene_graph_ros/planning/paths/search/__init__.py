"""The search for a path by two trees of proven edges, and for a shorter one."""
