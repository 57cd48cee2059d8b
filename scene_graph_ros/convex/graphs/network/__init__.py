"""The directed graph alone: paths, flows and rounding."""
