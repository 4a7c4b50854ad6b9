"""Visual shapes, and the two renderers that draw them."""
