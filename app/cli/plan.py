"""`regrasp plan`: how a task of a network would be done."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from regrasp.app.cli.options import EXIT_UNMET
from regrasp.app.files.findings import Finding, Findings, shown
from regrasp.app.files.json_text import json_text
from regrasp.app.files.resources import resolve, shipped
from regrasp.app.files.whole_file import write_whole
from regrasp.app.records.folders import file_findings
from regrasp.interfaces.quote import nearest, printable, quoted

if TYPE_CHECKING:
    from regrasp.behaviors.network.planner import Plan
    from regrasp.interfaces.task_network import TaskNetwork

FORMATS = ("text", "json", "tree", "svg", "png", "dot", "mermaid")
_OF_SUFFIX = {".txt": "text", ".json": "json", ".xml": "tree", ".svg": "svg", ".png": "png", ".dot": "dot"}
_OF_SUFFIX |= {".mmd": "mermaid"}


def add_to(app: typer.Typer) -> None:
    """Add the command."""
    app.command("plan")(plan_task)


def plan_task(
    network: Annotated[
        str | None, typer.Argument(help="A shipped network's name, or a path to a .yaml file; none: list them.")
    ] = None,
    task: Annotated[str | None, typer.Option(help="The task; by default the network's goal.")] = None,
    state: Annotated[
        list[str] | None, typer.Option(metavar="NAME=VALUE,...", help="What is the case otherwise than at the start.")
    ] = None,
    form: Annotated[
        str | None, typer.Option("--format", help=f"{', '.join(FORMATS)}; by default as FILE's name ends, else text.")
    ] = None,
    out: Annotated[
        Path | None, typer.Option("-o", "--out", metavar="FILE", help="Write here; by default to standard output.")
    ] = None,
    tree: Annotated[
        str | None, typer.Option(help="For a tree: the one whose DoTask does the network's actions; see below.")
    ] = None,
) -> None:
    """Plan a task of a task network.

    Prints how the task is broken down, and the actions that it comes to.

    \b
    Examples:
      regrasp plan print_and_place
      regrasp plan print_and_place --state door=open,plate=clamp
      regrasp plan print_and_place -o network.svg
      regrasp plan print_and_place --tree printer_part -o my_plan.xml

    A tree (FILE.xml) is that of --tree with the plan in the place of its DoTask:
    it can be shown, changed and run like any other, but does not plan again.

    Exit code: 0 there is a plan, 1 there is none from this state, 2 bad input.
    """
    if network is None:
        for name in shipped("network"):
            typer.echo(name)
        return
    made = _Planned(network, task, state or [], form, out, tree)
    content = made.content()
    if out is None:
        sys.stdout.buffer.write(content)
        sys.stdout.flush()
    else:
        write_whole(out, content)


class _Planned:
    """The request as it was typed, checked, and the plan."""

    def __init__(
        self, name: str, task: str | None, state: list[str], form: str | None, out: Path | None, tree: str | None
    ) -> None:
        from regrasp.app.scenario.network_file import load_network

        self._form = form or ("text" if out is None else _OF_SUFFIX.get(out.suffix.lower(), ""))
        found = [] if out is None else file_findings(out)
        if self._form not in FORMATS:
            where = ("--format", form) if form else (shown(out or Path()), "")
            what = (
                f"no format {quoted(form)}; {nearest(form, FORMATS)}" if form else f"end it in {', '.join(_OF_SUFFIX)}"
            )
            found.append(Finding(where[0], 0, what))
        if (self._form == "tree") != (tree is not None):
            found.append(Finding("--tree", 0, "goes with a tree (-o FILE.xml); give both, or none"))
        if found:
            raise Findings(found)
        self._tree = None if tree is None else resolve("tree", tree, Path(), ("--tree", 0))
        path = resolve("network", name, Path())
        self._network = load_network(path)
        if task is not None and task not in self._network.tasks:
            raise Findings([Finding("--task", 0, f"no task {quoted(task)}; {nearest(task, self._network.tasks)}")])
        self._state = self._network.start() | _given(self._network, state)
        self._plan = self._made(shown(path), task)

    def _made(self, where: str, task: str | None) -> "Plan":
        from regrasp.behaviors.network.planner import EndlessError, NoPlanError, plan

        try:
            return plan(self._network, self._state, task)
        except EndlessError as error:
            raise Findings([Finding(where, 0, str(error))]) from None
        except NoPlanError as error:
            typer.echo(printable(str(error)), err=True)
            raise typer.Exit(EXIT_UNMET) from None
        except ValueError as error:
            raise Findings([Finding("--state", 0, str(error))]) from None

    def content(self) -> bytes:
        """The plan in the format asked for."""
        root, actions = self._plan.root, self._plan.actions
        if self._form == "text":
            count = f"{len(actions)} action{'s' if len(actions) > 1 else ''}"
            doing = f"{count}: {', '.join(actions)}" if actions else "nothing is left to do"
            return "\n".join([*root.lines(), doing, ""]).encode()
        if self._form == "json":
            answer: dict[str, Any] = {"state": self._state, "actions": [*actions], "network": _as_json(root)}
            return f"{json_text(answer)}\n".encode()
        if self._form == "tree":
            return self._as_tree()
        from regrasp.trees.export import export_tree
        from regrasp.trees.plan_tree import plan_graph

        return export_tree(plan_graph(root), self._form)

    def _as_tree(self) -> bytes:
        from regrasp.app.scenario.tree_file import check_tree_file
        from regrasp.trees.plan_tree import plan_tree

        assert self._tree is not None
        check_tree_file(self._tree)
        if not self._plan.actions:
            raise Findings([Finding("--state", 0, "nothing is left to do: a tree needs an action; leave --tree out")])
        known = ", ".join(f"{name} is {value}" for name, value in self._state.items())
        try:
            return plan_tree(self._tree, self._plan.root, f"Planned by `regrasp plan` where {known}.").encode()
        except ValueError as error:
            raise Findings([Finding(shown(self._tree), 0, str(error))]) from None
        except KeyError as error:
            raise Findings([Finding("--tree", 0, f"its DoTask has no child {quoted(error.args[0])}")]) from None


def _given(network: "TaskNetwork", texts: list[str]) -> dict[str, str]:
    """The values that --state gives. Raises `Findings`."""
    given: dict[str, str] = {}
    found: list[Finding] = []
    for text in ",".join(texts).split(",") if texts else []:
        name, equals, value = (word.strip() for word in text.partition("="))
        if not equals:
            found.append(Finding("--state", 0, f"{quoted(text)} is no NAME=VALUE; write door=open, say"))
        elif name not in network.state:
            found.append(Finding("--state", 0, f"no variable {quoted(name)}; {nearest(name, network.state)}"))
        elif value not in (values := network.state[name].values):
            found.append(Finding("--state", 0, f"{name} cannot be {quoted(value)}; {nearest(value, values)}"))
        given[name] = value
    if found:
        raise Findings(found)
    return given


def _as_json(step: Any) -> dict[str, Any]:
    if step.method is None:
        return {"action": step.name}
    return {"task": step.name, "method": step.method, "steps": [_as_json(child) for child in step.steps]}
