"""Random pictures for the detector."""
