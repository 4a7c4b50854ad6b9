"""Records of runs: written, read, compared, replayed and explained."""
