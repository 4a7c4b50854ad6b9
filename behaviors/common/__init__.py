"""Leaves of no task in particular."""
