"""Checks of references between a scenario, its cell and its tree: inputs, obstacles and nodes that must exist."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pydantic import TypeAdapter

from regrasp.app.files.findings import Finding, Findings
from regrasp.app.files.schema_nodes import value_at
from regrasp.app.files.validation import validated_part
from regrasp.app.files.yaml_lines import Document
from regrasp.app.scenario.schema import TreeInput
from regrasp.app.scenario.tree_file import names_of
from regrasp.app.task.expect import CellName
from regrasp.behaviors.registry import Leaves, leaves_of
from regrasp.interfaces.cell import Cell
from regrasp.interfaces.fault import JawFault
from regrasp.interfaces.quote import cut, nearest, quoted
from regrasp.trees import TreeSyntaxError, check_inputs, read_graph

if TYPE_CHECKING:
    from regrasp.app.task.task import Task

_INPUT = TypeAdapter[TreeInput](TreeInput)


def tree_text(value: TreeInput) -> str:
    """An input's value in the form of a tree file."""
    return str(value).lower() if isinstance(value, bool) else str(value)


def check_tree_inputs(document: Document, tree: Path | None, cell: Cell | None, task: "Task | None") -> None:
    """Raises `Findings` for inputs that the tree does not have, and for values that it does not take."""
    written = value_at(document.value, ("inputs",))
    if tree is None or not isinstance(written, dict):
        return
    values = {key: validated_part(document, ("inputs", key), _INPUT) for key in written}
    given = {key: tree_text(value) for key, value in values.items() if value is not None}
    if found := [
        Finding(*document.place(("inputs", key)), f"inputs.{cut(key)}: {message}")
        for key, message in check_inputs(tree, given, _leaves(task), names_of(cell, task))
    ]:
        raise Findings(found)


def check_names(document: Document, tree: Path | None, cell: Cell | None, task: "Task | None") -> None:
    """Raises `Findings` if faults name obstacles, arms, cameras, or nodes of the tree, that do not exist.

    The same for what expectations name.
    """
    named = [*_obstacles(document), *_devices(document, cell), *_nodes(document, tree, task)]
    if found := [*named, *_expected(document, cell, task)]:
        raise Findings(found)


def _faults(document: Document) -> Iterator[tuple[int, Mapping[str, Any]]]:
    """Index and keys of each fault that is a mapping."""
    written = value_at(document.value, ("faults",))
    for i, fault in enumerate(written if isinstance(written, list) else []):
        if isinstance(fault, dict):
            yield i, fault


def _obstacles(document: Document) -> Iterator[Finding]:
    written = value_at(document.value, ("obstacles",))
    obstacles = written if isinstance(written, list) else []
    names = [name for i in range(len(obstacles)) if isinstance(name := value_at(obstacles, (i, "name")), str)]
    if len(names) < len(obstacles) or (written is not None and not isinstance(written, list)):
        return  # some names cannot be read: any name may be right
    for i, fault in _faults(document):
        name = fault.get("obstacle")
        if fault.get("type") == "obstacle_moves_in" and isinstance(name, str) and name not in names:
            message = f"no obstacle {quoted(name)}; {nearest(name, names)}"
            yield Finding(*document.place(("faults", i, "obstacle")), message)


def _devices(document: Document, cell: Cell | None) -> Iterator[Finding]:
    """Arms and cameras that faults name; a jaw's fault that leaves the arm out has a default."""
    if cell is None:
        return
    known = {"arm": [arm.name for arm in cell.known.arms], "camera": [camera.name for camera in cell.known.cameras]}
    for i, fault in _faults(document):
        jaw = {"arm": JawFault.model_fields["arm"].default} if str(fault.get("type")).startswith("jaw_") else {}
        given = {**jaw, **fault}
        for key, names in known.items():
            name = given.get(key)
            if isinstance(name, str) and name not in names:
                right = nearest(name, names) if names else "this cell has none"
                yield Finding(*document.place(("faults", i, key)), f"no {key} {quoted(name)}; {right}")
        arm, joint = given.get("arm"), given.get("joint")
        if isinstance(joint, str) and arm in known["arm"]:
            joints = cell.known.arm(str(arm)).robot.joint_names
            if joint not in joints:
                message = f"the {arm} arm has no joint {quoted(joint)}; {nearest(joint, joints)}"
                yield Finding(*document.place(("faults", i, "joint")), message)


def _nodes(document: Document, tree: Path | None, task: "Task | None") -> Iterator[Finding]:
    for i, _ in _faults(document):
        name = value_at(document.value, ("faults", i, "when", "node"))
        if tree and isinstance(name, str) and (names := _node_names(tree, task)) and name not in names:
            alike = [other for other in names if ("/" in other) == ("/" in name)]
            message = f"no node {quoted(name)} in {tree.name}; {nearest(name, alike)}"
            yield Finding(*document.place(("faults", i, "when", "node")), message)


def _expected(document: Document, cell: Cell | None, task: "Task | None") -> Iterator[Finding]:
    """Names of the cell that expectations hold."""
    names = names_of(cell, task)
    for key, field in ({} if task is None else task.expect().model_fields).items():
        name = value_at(document.value, ("expect", key))
        for kind in (mark.kind for mark in field.metadata if isinstance(mark, CellName)):
            known = names.get(kind)
            if known is None or not isinstance(name, str) or known.get(name) == "":
                continue
            wrong = f"{quoted(name)} {known[name]}" if name in known else f"no {quoted(name)}; {nearest(name, known)}"
            yield Finding(*document.place(("expect", key)), f"expect.{key}: {wrong}")


def _node_names(tree: Path, task: "Task | None") -> set[str]:
    """Every way to name a node of the tree: its path, or the end of it; none if the file is no valid tree."""
    try:
        nodes = read_graph(tree, _leaves(task)).walk()
    except (OSError, TreeSyntaxError, ValueError):  # a finding of the tree's own check
        return set()
    steps = [node.path.split("/") for node in nodes if node.kind != "subtree"]
    return {"/".join(names[i:]) for names in steps for i in range(len(names))}


def _leaves(task: "Task | None") -> Leaves | None:
    """The leaves that a tree of the task may name; None while the task is not known."""
    return None if task is None else leaves_of(task.name)
