"""Random scenes, whose pictures train and test the detector."""
