"""The cable task: expectations, the judge of them by ground truth, and the robot's belief for the record."""
