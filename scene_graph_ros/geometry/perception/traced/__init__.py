"""A renderer of light and shadows: colour by path tracing, depth and label those of ``exact``."""
