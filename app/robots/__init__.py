"""Robot files: reading and checking them, and the spheres that cover their meshes."""
