"""`regrasp migrate`."""

from pathlib import Path
from typing import Annotated

import typer

from regrasp.app.files.findings import Finding, Findings, shown


def add_to(app: typer.Typer) -> None:
    """Add the command to `app`."""
    app.command("migrate")(migrate)


def migrate(
    files: Annotated[list[Path], typer.Argument(help="Scenario files, such as mine.yaml.")],
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Say what would change, and change nothing.")] = False,
) -> None:
    """Rewrite older scenarios in the words of today.

    Comments and layout stay. Each line that changes is printed. A file that has nothing old is left alone, and when any
    file cannot be read, none is changed.

    \b
    Examples:
      regrasp migrate mine.yaml --dry-run
      regrasp migrate suites/*.scenario.yaml

    \b
    What changes: under expect, an outcome of older scenarios becomes success or failure.
    """
    import os

    from regrasp.app.files.resources import read_text
    from regrasp.app.files.whole_file import write_whole
    from regrasp.app.scenario.old_words import migrated

    found: list[Finding] = []
    done: dict[Path, tuple[str, list[int]]] = {}
    for path in files:
        try:
            done[path] = migrated(read_text(path), shown(path))
            if done[path][1] and not dry_run and not os.access(path, os.W_OK):
                found.append(Finding(shown(path), 0, "is write-protected; nothing has been changed"))
        except Findings as error:
            found += error.items
    if found:
        raise Findings(found)
    for path, (text, lines) in done.items():
        try:
            if lines and not dry_run:
                write_whole(path, text)
        except OSError as error:
            found.append(Finding(shown(path), 0, f"cannot be written: {error.strerror}"))
    for path, (text, lines) in done.items():
        for line in lines:
            typer.echo(f"{shown(path)}:{line}: {text.splitlines()[line - 1].strip()}")
        if not lines:
            typer.echo(f"{shown(path)}: nothing to change")
    if found:
        raise Findings(found)
