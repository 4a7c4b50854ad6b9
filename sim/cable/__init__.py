"""The cable task's objects: cable, socket, clip, and how far the job is."""
