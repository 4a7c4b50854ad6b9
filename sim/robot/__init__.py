"""The arms: robot model, servos and grippers."""
