"""Grasps of a cylinder, approaches to them, and whether a jaw holds what it closed on."""
