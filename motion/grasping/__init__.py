"""Grasps of the connector, and approaches to them."""
