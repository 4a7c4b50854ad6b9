"""The arms: kinematics, shape, and the check of their encoders."""
