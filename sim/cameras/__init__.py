"""Cameras and their errors."""
