"""What `make docs` runs: the pages of docs/ and an API reference as files that a browser opens."""
