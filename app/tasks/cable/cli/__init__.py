"""Commands of the cable task."""
