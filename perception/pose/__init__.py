"""The connector's pose from a frame: the techniques, and how their estimates are fused."""
