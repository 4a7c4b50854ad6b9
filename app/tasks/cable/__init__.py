"""The cable task: its judge, and the robot's belief for the record."""
