"""What the arms must not touch."""
