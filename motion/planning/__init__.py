"""Joint paths and their timing, and viewpoints."""
