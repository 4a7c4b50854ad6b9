"""Commands of the cable task."""

import typer

from regrasp.app.tasks.cable.cli import detector, studies


def add_to(app: typer.Typer, study: typer.Typer) -> None:
    """Add the commands to the command line, and the task's studies to `regrasp study`."""
    detector.add_to(app)
    studies.add_to(study)
