"""How summaries and explanations tell of a printer task."""

from regrasp.app.task.words import Words

WORDS = Words(
    measured="printer",
    measured_title="The printer, by ground truth",
    limits={"door_open": "at least {} m"},
    units={"door_open": "m"},
)
