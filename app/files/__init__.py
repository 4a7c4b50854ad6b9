"""Files that people write: read, checked against models, and told of by line."""
