"""What is in the world of the printer task."""
