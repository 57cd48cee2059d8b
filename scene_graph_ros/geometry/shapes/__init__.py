"""What things are: one file per shape, without pose, role or picture."""
