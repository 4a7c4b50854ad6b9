"""Obstacles from depth images."""
