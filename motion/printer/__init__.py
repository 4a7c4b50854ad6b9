"""Motions of the printer task."""
