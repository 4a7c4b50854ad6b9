"""Per task: what counts as success, and what the record tells of the robot's belief."""
