"""The arms: their model, servos and jaws."""
