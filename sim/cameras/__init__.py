"""Simulated cameras, their calibration errors and depth noise."""
