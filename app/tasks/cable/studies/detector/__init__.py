"""The detector's training data, its training, and its evaluation."""
