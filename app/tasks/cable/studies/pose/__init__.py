"""The pose study: the techniques compared on the same scenes."""
