"""What `make wheels` runs: wheels with compiled kernels and messages, for each Python."""
