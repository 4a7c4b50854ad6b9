"""Small value types that all packages share, device protocols, and the models of cell files and faults."""
