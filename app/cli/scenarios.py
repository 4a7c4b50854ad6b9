"""`regrasp scenarios`: list, check and show scenarios."""

import json
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from regrasp.app.cli.options import Sets, parse_seeds
from regrasp.app.files.findings import Finding, Findings, shown
from regrasp.app.files.resources import shipped
from regrasp.interfaces.quote import printable

if TYPE_CHECKING:
    from regrasp.app.scenario.scene_draw import Drawn

app = typer.Typer(no_args_is_help=True, rich_markup_mode=None, help="List, check and show scenarios.")
Name = Annotated[str, typer.Argument(help="A shipped scenario's name, or a path to a .yaml file.")]


@app.command("list")
def list_scenarios() -> None:
    """List the shipped scenarios, with their cases."""
    from regrasp.app.scenario.load import case_names, description

    known = shipped("scenario")
    width = max(map(len, known), default=0)
    for name, path in known.items():
        typer.echo(f"{name:<{width}}  {_counted(len(case_names(name))):>9}  {description(path)}")


def _counted(cases: int) -> str:
    return f"{cases} case{'s' if cases != 1 else ''}"


@app.command("check")
def check_scenarios(
    files: Annotated[list[str] | None, typer.Argument(help="Names or paths; default all that are shipped.")] = None,
    sets: Sets = None,
) -> None:
    """Check scenarios, in every case, without a run.

    With their cells and trees; tells all that is wrong.

    \b
    Examples:
      regrasp scenarios check
      regrasp scenarios check my/scenario.yaml --set vary.seed=[1,2,3]

    \b
    Exit code: 0 nothing is wrong, 2 findings, a line each on stderr.
    """
    from regrasp.app.scenario.load import cases

    found: list[Finding] = []
    for name in files or shipped("scenario"):
        try:
            checked = cases(name, sets or [])
            typer.echo(f"{shown(checked[0].path)}: {_counted(len(checked))}, nothing wrong")
        except Findings as error:
            found += error.items
    if found:
        raise Findings(found)


@app.command("show")
def show_scenario(
    scenario: Name,
    case: Annotated[
        str | None, typer.Option(metavar="NAME", help="The case; default that of the first values.")
    ] = None,
    sets: Sets = None,
) -> None:
    """Print a scenario as a run takes it.

    One case's values, your changes and all defaults, as YAML.

    Without --case the names of all cases come first, as comments.

    \b
    Examples:
      regrasp scenarios show short_obstacle
      regrasp scenarios show short_obstacle --case gravity=earth > mine.yaml
    """
    import yaml

    from regrasp.app.scenario.load import case_names, load_scenario

    loaded = load_scenario(scenario, sets or [], case)
    names = case_names(scenario, sets or []) if case is None else [loaded.case]
    typer.echo(f"# {printable(loaded.name)}: {'this case' if case else 'the first of these cases'}")
    for name in names:
        typer.echo(f"#   {printable(name)}")
    content = loaded.file.model_dump(mode="json", exclude_none=True, exclude={"vary"})
    typer.echo(
        yaml.safe_dump(content, sort_keys=False, allow_unicode=True, default_flow_style=None, width=120).rstrip()
    )


@app.command("draw")
def draw_scenes(
    scenario: Name,
    seeds: Annotated[str, typer.Option(metavar="A:B", help="From A to B, B left out.")] = "0:10",
    sets: Sets = None,
    pictures: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Write what the first camera sees of each, too, as JPEG.")
    ] = None,
) -> None:
    """Draw scenes of a scenario that has `draw`, without a run.

    A line for each case and seed: how many blocks, and what was thrown away before; then how much that was of all.

    \b
    Examples:
      regrasp scenarios draw random_scene --seeds 0:20
      regrasp scenarios draw random_scene --seeds 0:5 --set gravity=earth --pictures runs/scenes

    \b
    Exit code: 0, or 2 when a scene cannot be drawn.
    """
    from regrasp.app.records.folders import folder_name
    from regrasp.app.records.summary import thrown_words
    from regrasp.app.scenario.load import cases
    from regrasp.app.scenario.scene_draw import Drawn, drawn

    numbers, loaded = parse_seeds(seeds), cases(scenario, sets or [])
    if loaded[0].file.draw is None:
        raise Findings([Finding(shown(loaded[0].path), 0, "it has no draw; write what the seed shall draw")])
    found: list[Drawn] = []
    for case in loaded:
        for seed in numbers:
            found.append(scene := drawn(case, seed))
            blocks = len(scene.scenario.file.obstacles)
            told = f"{case.title}, seed {seed}: {blocks} block{'s' if blocks != 1 else ''}"
            typer.echo(printable(f"{told}; {thrown_words(scene.thrown_away or {})}"))
            if pictures is not None:
                from regrasp.app.frames.snapshot import write_picture

                pictures.mkdir(parents=True, exist_ok=True)
                camera = case.cell.known.cameras[0].name
                write_picture(scene.scenario, seed, camera, pictures / f"{folder_name(case.case)}-{seed}.jpg")
    typer.echo(f"{len(found)} scenes drawn; {thrown_words(_summed(found))}")


def _summed(found: "Sequence[Drawn]") -> dict[str, Counter[str]]:
    summed: dict[str, Counter[str]] = {}
    for scene in found:
        for kind, reasons in (scene.thrown_away or {}).items():
            summed.setdefault(kind, Counter()).update(reasons)
    return summed


@app.command("schema")
def print_schema(
    as_markdown: Annotated[
        bool, typer.Option("--markdown", help="A reference to read: each field, its meaning and an example.")
    ] = False,
    task: Annotated[
        str | None, typer.Option(metavar="NAME", help="Of which task; needed where several are installed.")
    ] = None,
) -> None:
    """Print what a scenario file may say.

    As JSON Schema (draft 2020-12), for editors.

    \b
    With the YAML language server (VS Code, Neovim, Emacs) an editor completes
    and checks scenario files:
      regrasp scenarios schema --task NAME > scenario.schema.json
    and as the first line of your scenario, with the path from it to that file:
      # yaml-language-server: $schema=scenario.schema.json

    \b
    To read it yourself:
      regrasp scenarios schema --task NAME --markdown
    """
    from regrasp.app.files.schema_doc import markdown
    from regrasp.app.scenario.schema import json_schema, scenario_model
    from regrasp.app.task import find

    known = find.names()
    if task is None and len(known) > 1:
        message = f"there are the tasks {' and '.join(known)}, and each has its own schema: write --task {known[0]}"
        raise Findings([Finding("--task", 0, message)])
    chosen = find.task_named(task or known[0], ("--task", 0))
    if as_markdown:
        typer.echo(markdown(scenario_model(chosen).model_json_schema()))
    else:
        typer.echo(json.dumps(json_schema(chosen), indent=2, ensure_ascii=False))
