"""Paths, and paths in time."""
