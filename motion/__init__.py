"""Frames and joints in, trajectories out."""
