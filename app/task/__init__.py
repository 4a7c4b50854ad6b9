"""A task: what is put in, and how it is found."""
