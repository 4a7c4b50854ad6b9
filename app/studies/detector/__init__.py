"""What the detectors' trainings and their evaluations share."""
