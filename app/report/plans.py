"""The plans that a task network gave in a run, and what changed from one to the next."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from regrasp.app.records.reader import Event


@dataclass(frozen=True)
class Known:
    """A variable of the state, its value, and whether that differs from the plan before."""

    name: str
    value: str
    changed: bool


@dataclass(frozen=True)
class PlanMade:
    """A plan: when and why it was made, its actions, what was known, and how the task was broken down.

    `new` are the actions that the plan before did not have left. `actions` is None where there was no plan.
    """

    t: float
    why: str
    node: str
    actions: tuple[str, ...] | None
    new: frozenset[str]
    state: tuple[Known, ...]
    network: tuple[tuple[int, str], ...]  # depth and words of each line


def plans(events: Sequence[Event]) -> Iterator[PlanMade]:
    """Every plan, and every time that there was none."""
    actions: tuple[str, ...] = ()
    state: dict[str, str] = {}
    for event in events:
        if event.event == "no plan":
            yield PlanMade(event.t, str(event.values.get("why", "")), event.node, None, frozenset(), (), ())
        if event.event != "planned":
            continue
        made = tuple(str(event.values.get("actions", "")).split())
        told = event.values.get("state")
        known = {str(name): str(value) for name, value in told.items()} if isinstance(told, dict) else {}
        yield PlanMade(
            t=event.t,
            why=str(event.values.get("because", "")),
            node=event.node,
            actions=made,
            new=frozenset(set(made) - set(actions)) if actions else frozenset(),
            state=tuple(Known(name, value, bool(state) and state.get(name) != value) for name, value in known.items()),
            network=tuple(_lines(event.values.get("network"))),
        )
        actions, state = made, known


def _lines(value: object) -> Iterator[tuple[int, str]]:
    for line in value if isinstance(value, list) else ():
        words = str(line).lstrip()
        yield min((len(str(line)) - len(words)) // 2, 12), words
