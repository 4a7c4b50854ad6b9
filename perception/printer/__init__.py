"""What a camera sees of the printer."""
