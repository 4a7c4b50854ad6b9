"""The motion study: retrieval queries to the planner in cluttered cells."""
