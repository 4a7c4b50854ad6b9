"""Running: an episode, its logs and its film; many at once."""
