"""Contact of deformable geometries; loaded when a query first asks for it."""
