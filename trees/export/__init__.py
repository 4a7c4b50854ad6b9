"""Exports trees: as pictures, as text for other programs, and as files of other editors."""

from regrasp.trees.export.formats import FORMAT_OF_SUFFIX, FORMATS, export_tree
from regrasp.trees.export.themes import THEMES

__all__ = ["FORMATS", "FORMAT_OF_SUFFIX", "THEMES", "export_tree"]
