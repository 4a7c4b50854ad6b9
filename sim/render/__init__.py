"""What the cameras see: shapes, and the two renderers."""
