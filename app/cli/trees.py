"""`regrasp trees`: list, check, show and export behaviour trees."""

from pathlib import Path
from typing import Annotated

import typer

from regrasp.app.files.findings import Finding, Findings
from regrasp.app.files.resources import resolve, shipped
from regrasp.interfaces.quote import nearest, printable, quoted

app = typer.Typer(no_args_is_help=True, rich_markup_mode=None, help="List, check, show and export behaviour trees.")


@app.command("list")
def list_trees() -> None:
    """List the shipped trees."""
    for name in shipped("tree"):
        typer.echo(name)


@app.command("show")
def show_tree_file(
    tree: Annotated[str, typer.Argument(help="A shipped tree's name, or a path to an .xml file.")],
) -> None:
    """Draw a tree as text.

    \b
    Example:
      regrasp trees show recovery
    """
    from regrasp.app.scenario.tree_file import check_tree_file

    path = resolve("tree", tree, Path())
    check_tree_file(path)
    from regrasp.trees import show_tree

    typer.echo(show_tree(path))


@app.command("export")
def export_tree_file(
    tree: Annotated[
        str | None,
        typer.Argument(help="A shipped tree's name, or a path to an .xml file; with --run, by default its own."),
    ] = None,
    form: Annotated[
        str | None,
        typer.Option("--format", help="dot, mermaid, svg, png, ascii, json or groot; by default as FILE's name ends."),
    ] = None,
    out: Annotated[
        Path | None, typer.Option("-o", "--out", metavar="FILE", help="Write here; - is standard output, the default.")
    ] = None,
    depth: Annotated[
        int | None,
        typer.Option(
            min=0,
            metavar="N",
            help="Expand SubTrees down to N levels; with 0 each SubTree of the main tree is a single node.",
        ),
    ] = None,
    theme: Annotated[str, typer.Option(help="Of dot, svg and png: light or dark.")] = "light",
    run: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Show what this recorded run did at each node.")
    ] = None,
) -> None:
    """Write a tree as a picture, or for another program.

    \b
    Examples:
      regrasp trees export recovery -o recovery.svg --theme dark
      regrasp trees export recovery --format mermaid --depth 0
      regrasp trees export --run runs/short_obstacle-0-1 -o what_happened.png

    ascii is what `trees show` draws; groot is BehaviorTree.CPP v4 XML, which Groot2 opens.

    Of a run: visits, results and
    simulated seconds of each node, and in red the path that failed; as a run logs changes of status only, a node that
    ends in the same way at tick after tick counts as one visit.
    """
    from regrasp.app.cli.tree_export import Request, exported  # late, like all that only this command needs

    out = None if out == Path("-") else out
    content = exported(Request(tree, form, out, depth, theme, run))
    if out is None:
        typer.echo(content, nl=False)


@app.command("check")
def check_trees(
    trees: Annotated[
        list[str] | None, typer.Argument(help="Shipped trees' names or paths to .xml files; without any, all shipped.")
    ] = None,
) -> None:
    """Check tree files, without a run.

    What a cell must have for them is checked with the scenario.

    \b
    Example:
      regrasp trees check my/tree.xml

    \b
    Exit code: 0 no findings, 2 findings, one a line:
      file:line: what is wrong; what would be right
    """
    from regrasp.app.scenario.tree_file import check_tree_file

    found: list[Finding] = []
    names = trees or list(shipped("tree"))
    for name in names:
        try:
            check_tree_file(resolve("tree", name, Path()))
        except Findings as error:
            found += error.items
    if found:
        raise Findings(found)
    typer.echo(f"{len(names)} tree{'s' if len(names) > 1 else ''}, no findings")


@app.command("leaves")
def list_leaves(name: Annotated[str | None, typer.Argument(help="One element, in full.")] = None) -> None:
    """List the elements that a tree file may hold.

    Leaves and built-in ones, each with its attributes.

    \b
    Example:
      regrasp trees leaves SpiralSearch
    """
    from regrasp.behaviors.registry import all_leaves
    from regrasp.trees.catalogue import all_elements, describe

    leaves = all_leaves()
    known = all_elements(leaves)
    if name is not None and name not in known:
        raise Findings([Finding(name, 0, f"no element {quoted(name)}; {nearest(name, known)}")])
    for tag, kind in known.items():
        if name in (None, tag):
            typer.echo("\n".join(describe(tag, kind, full=name is not None)))
    for broken, why in leaves.broken.items():
        typer.echo(f"warning: the leaf set {printable(broken)} cannot be imported: {printable(why)}", err=True)
