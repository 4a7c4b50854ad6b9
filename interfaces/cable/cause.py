"""Causes of failure of the cable task."""

from enum import StrEnum


class CableCause(StrEnum):
    """The causes that only leaves of the cable task give."""

    SLIPPED = "slipped"
    CONNECTOR_NOT_FOUND = "connector_not_found"
    SEARCH_EXHAUSTED = "search_exhausted"
    NOT_STOWED = "not_stowed"
    NOT_PLUGGED = "not_plugged"
    CABLE_TOO_SHORT = "cable_too_short"
    CABLE_TOO_LONG = "cable_too_long"
    NOT_STILL = "not_still"
