"""`regrasp trees`: look at behaviour trees."""

from pathlib import Path
from typing import Annotated

import typer

from app.resources import resolve, shipped
from app.scenario_file import check_tree_file

app = typer.Typer(no_args_is_help=True, rich_markup_mode=None, help="Look at behaviour trees.")


@app.command("list")
def list_trees() -> None:
    """Names of the shipped trees."""
    for name in shipped("tree"):
        typer.echo(name)


@app.command("show")
def show(tree: Annotated[str, typer.Argument(help="A shipped tree's name, or a path to an .xml file.")]) -> None:
    """Draw a tree as text.

    \b
    Example:
      regrasp trees show recovery
    """
    path = resolve("tree", tree, Path())
    check_tree_file(path)
    from trees import show_tree

    typer.echo(show_tree(path))
