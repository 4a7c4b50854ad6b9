"""The arms: kinematics, shape, and how they follow."""
