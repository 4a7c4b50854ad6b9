"""The technique `fused`: all the evidence at once."""
