"""Studies: many runs or scenes, counted."""
