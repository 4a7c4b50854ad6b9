"""The detector's pictures, its training, and its score."""
