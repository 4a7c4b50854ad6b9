"""`regrasp scenarios`: look at scenarios."""

import typer

from app.resources import shipped
from app.scenario_file import description

app = typer.Typer(no_args_is_help=True, rich_markup_mode=None, help="Look at scenarios.")


@app.command("list")
def list_scenarios() -> None:
    """Names and descriptions of the shipped scenarios."""
    known = shipped("scenario")
    width = max(map(len, known), default=0)
    for name, path in known.items():
        typer.echo(f"{name:<{width}}  {description(path)}")
