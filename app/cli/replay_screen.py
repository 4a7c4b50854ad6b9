"""`regrasp replay` on a terminal: shows the tree after a change; keys go from change to change."""

import re
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from rich.console import Console, Group
from rich.live import Live
from rich.text import Text

from regrasp.app.cli.keys import keyboard
from regrasp.interfaces.quote import printable, quoted

if TYPE_CHECKING:
    from regrasp.app.records.replay import Replay

PAGE_CHANGES = 10  # changes that PgDn and PgUp go
HELP = (  # the first that fits is shown
    "right/left step  PgDn/PgUp 10  Home/End  n next failure  g go to a time  / filter  q quit",
    "right/left step  PgDn/PgUp 10  Home/End  n failure  g time  / filter  q quit",
    "arrows  n failure  g time  / q quit",
    "q quit",
)
STATUS_WIDTH = 7  # of each of the four
COLORS = {"RUNNING": "yellow", "SUCCESS": "green", "FAILURE": "bold red", "INVALID": "dim"}
KEY_STEPS = {
    "forward": 1,
    " ": 1,
    "l": 1,
    "back": -1,
    "h": -1,
    "page forward": PAGE_CHANGES,
    "page back": -PAGE_CHANGES,
}
PROMPTS = {"g": "go to second: ", "/": "only paths with: "}


@dataclass(frozen=True)
class View:
    """What is shown: the change's index, the filter, the open prompt ('' for none) with what was typed, a note."""

    index: int = 0
    part: str = ""
    prompt: str = ""
    typed: str = ""
    note: str = ""


def replay_on_screen(replay: "Replay", part: str, start: float) -> None:
    """Step through the record until q."""
    view: View | None = View(replay.at(start), part)
    console = Console(highlight=False, markup=False)
    with keyboard() as read, Live(console=console, screen=True, auto_refresh=False) as live:
        drawn = None
        while view is not None:
            if drawn != (drawn := (view, console.size)):  # a screen that stands still can be copied from
                live.update(draw(replay, view, *console.size), refresh=True)
            key = read()
            view = None if key is None else pressed(replay, view, key)


def pressed(replay: "Replay", view: View, key: str) -> View | None:
    """The view after a key; None to quit."""
    if view.prompt:
        return _typed(replay, view, key)
    last = len(replay.changes) - 1
    view = replace(view, note="") if key else view
    if key in KEY_STEPS:
        return replace(view, index=min(max(view.index + KEY_STEPS[key], 0), last))
    if key in ("home", "end"):
        return replace(view, index=0 if key == "home" else last)
    if key == "n":
        found = replay.next_failure(view.index, view.part)
        return replace(view, note="no failure after this") if found is None else replace(view, index=found)
    if key in PROMPTS:
        return replace(view, prompt=key, typed="")
    return None if key in ("q", "\x04") else view


def _typed(replay: "Replay", view: View, key: str) -> View:
    closed = replace(view, prompt="", typed="")
    if key == "escape":
        return closed
    if key == "delete":
        return replace(view, typed=view.typed[:-1])
    if key != "enter":
        return replace(view, typed=view.typed + key) if len(key) == 1 and key.isprintable() else view
    if view.prompt == "/":
        known = replay.known(view.typed)
        return replace(closed, part=view.typed) if known else replace(closed, note=f"no node has {quoted(view.typed)}")
    if not re.fullmatch(r"\d*\.?\d+", view.typed):
        return replace(closed, note=f"{view.typed!r} is no number of seconds")
    return replace(closed, index=replay.at(float(view.typed)))


def draw(replay: "Replay", view: View, width: int, height: int) -> Group:
    """The screen: a line with the position, the tree, the change's events, and a line of keys."""
    from regrasp.app.records.timeline import event_text

    change = replay.changes[view.index]
    events = [
        f"{_own_name(event.node) or '-'}  {event_text(event)}" for event in change.events if view.part in event.node
    ]
    events = events[: max(1, height // 4)]
    head = f"{change.t:8.2f} s   change {view.index + 1} of {len(replay.changes)}"
    head += f"   only paths with {view.part!r}" if view.part else ""
    foot = PROMPTS[view.prompt] + view.typed + "_" if view.prompt else view.note or _help(width)
    tree = _tree(replay, view, width, max(1, height - len(events) - 3))
    lines = [Text(head, "bold"), *tree, *(Text(printable(text), "cyan") for text in events), Text(foot, "reverse")]
    for line in lines:
        line.no_wrap, line.overflow = True, "ellipsis"
        line.truncate(width, overflow="ellipsis")
    return Group(*lines)


def _help(width: int) -> str:
    return next((text for text in HELP if len(text) <= width), HELP[-1])


def _tree(replay: "Replay", view: View, width: int, height: int) -> list[Text]:
    """As many lines of the tree as fit, around the first node that changed."""
    nodes = [node for node in replay.rows if view.part in node.path]
    changed = {tick.path for tick in replay.changes[view.index].nodes}
    focus = next((i for i, node in enumerate(nodes) if node.path in changed), 0)
    top = max(0, min(focus - height // 3, len(nodes) - height))
    names = [printable(node.path if view.part else "  " * node.depth + _own_name(node.path)) for node in nodes]
    column = min(max(map(len, names), default=0), max(width - STATUS_WIDTH - 4, 1))
    lines = []
    for node, name in zip(nodes[top : top + height], names[top : top + height], strict=True):
        status = replay.status(node.path, view.index)
        line = Text()
        line.append("* " if node.path in changed else "  ", "bold")
        line.append(f"{_shortened(name, column):<{column}}  ", COLORS[status])
        line.append(f"{status:<{STATUS_WIDTH}}", COLORS[status] + (" reverse" if node.path in changed else ""))
        if len(line) + 2 + len(node.type) <= width:
            line.append(printable(f"  {node.type}"), "dim")
        lines.append(line)
    return lines


def _shortened(name: str, width: int) -> str:
    """The indented name, cut in its middle to `width` columns; at most half of them are indent."""
    if len(name) <= width:
        return name
    own = name.lstrip()
    indent = min(len(name) - len(own), width // 2)
    room = width - indent
    if len(own) > room:
        tail = (room - 1) // 2
        own = own[: room - 1 - tail] + "…" + own[len(own) - tail :]
    return " " * indent + own


def _own_name(path: str) -> str:
    return path.rsplit("/", 1)[-1]
