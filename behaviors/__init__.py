"""py_trees leaves, one module per state of the task."""
