"""How summaries and explanations tell of a cable task."""

from collections.abc import Iterator, Mapping
from typing import Any

from regrasp.app.task.words import Words, numbers, place, robot_lines


def _slip_lines(measured: Mapping[str, Any]) -> Iterator[str]:
    """Each loss of the connector, and how it was noticed."""
    for slip in measured["slips"]:
        noticed, by = slip["detected_at"], slip["detected_by"]
        seen = "not noticed" if noticed is None else f"noticed at {noticed:.2f} s by {by}"
        yield f"lost at {slip['released_at']:.2f} s, {seen}"


def _slip_moments(measured: Mapping[str, Any]) -> Iterator[tuple[float, str]]:
    """When the connector was lost, and when that was noticed."""
    for slip in measured["slips"]:
        yield slip["released_at"], "slip: the connector is lost"
        if slip["detected_at"] is not None:
            yield slip["detected_at"], f"the slip is noticed by {slip['detected_by']}"


def _belief_lines(belief: Mapping[str, Any]) -> Iterator[str]:
    yield f"the hand holds {'the connector' if belief['held'] else 'nothing'}"
    if belief["connector"]:
        sure = "all of it seen" if belief["sure"] else "a part of it seen"
        yield f"connector found by the {belief['found_by'] or 'unknown'} camera at {place(belief['connector'])}, {sure}"
    else:
        yield "no estimate of the connector for a grasp: it was never lost, or not found since"
    if seen := belief["last_seen"]:
        at, where = f"{seen['at']:.2f} s", numbers(seen["position"])
        yield f"connector seen last at {at} by the {seen['camera']} camera at {where} m"
    yield f"searches in vain since then: {belief['vain_searches']}"
    yield from robot_lines(belief)
    for at, by in belief["notices"]:
        yield f"noticed a loss at {at:.2f} s by {by}"


WORDS = Words(
    measured="slip",
    measured_title="Losses of the connector, by ground truth",
    measured_lines=_slip_lines,
    belief_lines=_belief_lines,
    measured_moments=_slip_moments,
    limits={"slips": "at least {}, all noticed"},
    units={"detection_delay": "s", "pose_error.position": "m", "pose_error.angle_deg": "degrees"},
)
