"""How to take hold of things."""
