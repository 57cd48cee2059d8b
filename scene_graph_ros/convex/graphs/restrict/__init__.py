"""The program along one given path."""
