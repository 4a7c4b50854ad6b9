"""The cable task's part of a cell, and its faults."""
