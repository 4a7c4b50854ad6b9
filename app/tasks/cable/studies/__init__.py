"""Studies of the cable task."""
