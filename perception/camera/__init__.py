"""The camera: its model, its health, its calibration, and where it really is."""
