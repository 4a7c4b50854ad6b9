"""Planning in a hierarchical task network, and the node of a tree that does what was planned."""
