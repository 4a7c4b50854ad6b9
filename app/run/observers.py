"""Callbacks while an episode runs."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from regrasp.app.records.record import OnEvent, Progress
    from regrasp.app.run.compose import Episode  # brings the planner, the compiler and the physics: seconds


def _ignore(*_: object) -> None:
    """Do nothing."""


@dataclass(frozen=True)
class Observers:
    """What `run_episode` calls: nothing by default.

    `assembled` gets the episode before its first tick, `tick` the simulated second and the active leaf after each tick,
    `event` each event of the run's log.
    """

    assembled: "Callable[[Episode], None]" = _ignore
    tick: "Progress" = _ignore
    event: "OnEvent" = _ignore
