"""A user's own frames: images and calibrations as files, calibration and pose estimation from them."""
