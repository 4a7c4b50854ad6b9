"""Scenario and cell files: read, checked, varied, and drawn from a seed."""
