"""What the robot sees of the cable."""
