"""Faults: when they begin, and their effects."""
