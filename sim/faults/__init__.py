"""Faults: when they begin, and what they do."""
