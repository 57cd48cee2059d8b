"""The best motion of a system, by nonlinear programs on CasADi, which is imported on demand."""
