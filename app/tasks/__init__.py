"""What each task brings to the door: its judge and its words."""
