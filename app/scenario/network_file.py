"""Reads and checks the files of task networks, and which of them a tree names."""

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from regrasp.app.files.findings import Finding, Findings, catch_findings, shown
from regrasp.app.files.resources import read_text, resolve
from regrasp.interfaces.quote import nearest, quoted
from regrasp.trees.element import Element
from regrasp.trees.task_networks import network_nodes

if TYPE_CHECKING:
    from regrasp.app.files.yaml_lines import Path as KeyPath
    from regrasp.app.files.yaml_lines import Place
    from regrasp.interfaces.task_network import TaskNetwork


def load_network(path: Path, where: "Place | None" = None) -> "TaskNetwork":
    """Read and check a network. Raises `Findings`; if there is no such file, at `where`, which names it."""
    from regrasp.app.files.validation import validated  # late: a tree without networks needs no models
    from regrasp.app.files.yaml_lines import parse
    from regrasp.interfaces.task_network import TaskNetwork

    document = parse(read_text(path, where), shown(path))
    network = validated(document, TaskNetwork)
    found = [Finding(*document.place(at), message) for at, message in _wrong(network)]
    if not found and (why := network.contradiction(network.start())) is not None:
        found = [Finding(*document.place(("state",)), f"the state at the start contradicts itself: {why}")]
    if found:
        raise Findings(found)
    return network


def check_networks(tree: Path) -> None:
    """Raises `Findings` for what is wrong in a tree's networks, and where its nodes lack an action's child."""
    found: list[Finding] = []
    for element in _nodes(tree):
        network, wrong = catch_findings(_named, tree, element)
        found += wrong
        if network is not None:
            found += [Finding(shown(tree), line, message) for line, message in _unlike(element, network)]
    if found:
        raise Findings(found)


def _named(tree: Path, element: Element) -> "TaskNetwork":
    return load_network(_path(tree, element), (shown(tree), element.line))


def _nodes(tree: Path) -> list[Element]:
    """The nodes of a tree that plan in a network. The name of each is a literal: its children depend on it."""
    found = network_nodes(tree)
    for element in found:
        if "{" in element.attributes.get("network", ""):
            message = f"{element.label}: network is a key; write the network's name, which decides what children it has"
            raise Findings([Finding(shown(tree), element.line, message)])
    return found


def _path(tree: Path, element: Element) -> Path:
    return resolve("network", element.attributes["network"], tree.parent, (shown(tree), element.line))


def _unlike(element: Element, network: "TaskNetwork") -> Iterator[tuple[int, str]]:
    """Actions of the network that no child of the node does, and children that are no actions."""
    children = {child.name: child.line for child in element.children}
    for name, line in children.items():
        if name not in network.actions:
            yield line, f"the network has no action {quoted(name)}; {nearest(name, network.actions)}"
    for name in network.actions:
        if name not in children:
            yield element.line, f"{element.label} has no child for the action {quoted(name)}; add one of this name"
    task = element.attributes.get("task", "")
    if task and "{" not in task and task not in network.tasks:
        yield element.line, f"the network has no task {quoted(task)}; {nearest(task, network.tasks)}"


def _wrong(network: "TaskNetwork") -> "Iterator[tuple[KeyPath, str]]":
    """What contradicts itself in a network whose values are right one by one, with its place."""
    for name, variable in network.state.items():
        if variable.starts not in variable.values:
            yield (
                ("state", name, "starts"),
                f"state.{name} cannot be {quoted(variable.starts)}; " + nearest(variable.starts, variable.values),
            )
    for name in network.actions.keys() & network.tasks.keys():
        yield ("tasks", name), f"{quoted(name)} is a task and an action; rename one"
    if network.goal not in network.tasks:
        yield ("goal",), f"no task {quoted(network.goal)}; {nearest(network.goal, network.tasks)}"
    for place, condition in _conditions(network):
        for name, wanted in condition.items():
            if name not in network.state:
                yield (*place, name), f"no variable {quoted(name)} in the state; {nearest(name, network.state)}"
                continue
            values = network.state[name].values
            for value in [wanted] if isinstance(wanted, str) else wanted:
                if value not in values:
                    yield (*place, name), f"{name} cannot be {quoted(value)}; {nearest(value, values)}"
    known = [*network.tasks, *network.actions]
    for task, methods in network.tasks.items():
        for i, method in enumerate(methods):
            for j, name in enumerate(method.do):
                if name not in known:
                    yield ("tasks", task, i, "do", j), f"no task or action {quoted(name)}; {nearest(name, known)}"


def _conditions(network: "TaskNetwork") -> "Iterator[tuple[KeyPath, dict[str, str | list[str]]]]":
    """Every condition and change of a network with its place."""
    for name, action in network.actions.items():
        yield ("actions", name, "needs"), dict(action.needs)
        yield ("actions", name, "gives"), dict(action.gives)
        for cause, change in action.failed.items():
            yield ("actions", name, "failed", cause), dict(change)
    for task, methods in network.tasks.items():
        for i, method in enumerate(methods):
            yield ("tasks", task, i, "when"), dict(method.when)
    for i, one in enumerate(network.impossible):
        yield ("impossible", i, "state"), dict(one.state)
