"""Studies of the printer task."""
