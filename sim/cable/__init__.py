"""Objects of the cable task: the cable, its socket and clip, and the phases of the task."""
