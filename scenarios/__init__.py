"""Cells and scenarios that ship with Regrasp (YAML)."""
