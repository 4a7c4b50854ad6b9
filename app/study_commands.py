"""`regrasp study`: many episodes, counted."""

import os
from pathlib import Path
from typing import Annotated

import typer

from app import output
from app.findings import Finding, Findings, shown
from app.options import Sets, parse_seeds

app = typer.Typer(no_args_is_help=True, rich_markup_mode=None, help="Run many episodes and count.")


@app.command("demo")
def demo(
    seeds: Annotated[str, typer.Option(metavar="A:B", help="Seeds from A up to, not including, B.")],
    jobs: Annotated[int, typer.Option(min=1, help="Episodes side by side.")] = os.cpu_count() or 1,
    out: Annotated[Path | None, typer.Option(help="Folder of demo.json and the runs' records.")] = None,
    sets: Sets = None,
) -> None:
    """The whole demonstration: no, short and tall obstacle, each without and with gravity, over many seeds.

    \b
    Example:
      regrasp study demo --seeds 0:20 --jobs 2 --out results/demo
    """
    chosen = parse_seeds(seeds)
    wrong = output.findings(out) if out else []
    if out and (out / "demo.json").exists():
        wrong.append(Finding(shown(out), 1, "already holds a study; name another folder"))
    if wrong:
        raise Findings(wrong)
    from app.study import run_demo

    raise typer.Exit(run_demo(chosen, jobs, out, sets or []))


@app.callback()
def _group() -> None:
    """Keeps `demo` a word of its own while it is the only study."""
