"""A person's own frames: pictures and calibrations as files, and what is done with them."""
