"""The planning scene: what the arms must not touch."""
