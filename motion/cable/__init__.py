"""Motions with the cable in the hand."""
