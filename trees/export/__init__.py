"""Trees in other forms: pictures, text for other programs, and what other editors open."""

from regrasp.trees.export.formats import FORMATS, SUFFIXES, export_tree
from regrasp.trees.export.themes import THEMES

__all__ = ["FORMATS", "SUFFIXES", "THEMES", "export_tree"]
