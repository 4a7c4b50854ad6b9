"""Leaves of the cable task."""
