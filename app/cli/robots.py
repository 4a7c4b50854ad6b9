"""`regrasp robots`: list, show and check robots, and fit spheres to them."""

import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from regrasp.app.files.findings import Finding, Findings, shown
from regrasp.app.files.resources import named, resolve
from regrasp.interfaces.quote import nearest, printable, quoted

if TYPE_CHECKING:
    from regrasp.app.robots.proposal import Margins
    from regrasp.interfaces.robot.robot import Robot

app = typer.Typer(no_args_is_help=True, rich_markup_mode=None, help="List and check robots; fit collision spheres.")
Name = Annotated[str, typer.Argument(help="A name that `regrasp robots list` tells, or a path to a .yaml file.")]
AsJson = Annotated[bool, typer.Option("--json", help="Print it as JSON, for a program; SI units.")]
LEAST_MARGIN, MOST_MARGIN = 0.002, 0.2  # m; choice: below, a link takes hundreds of spheres, above, a room


@app.command("list")
def list_robots(as_json: AsJson = False) -> None:
    """List the robots that have a name: those that are shipped, and those that installed packages put in.

    A cell names one as its arm's robot; a file of your own may name one as its base and change some of it.
    """
    from regrasp.app.robots.robot_file import load_robot

    rows: list[dict[str, Any]] = []
    found: list[Finding] = []
    for name in named("robot"):
        try:
            robot = load_robot(resolve("robot", name, Path()), (name, 0))
        except Findings as error:  # of a package; the others are told
            found += error.items
            continue
        rows.append({"name": name, "title": robot.title, "joints": len(robot.joint_names), "spheres": _count(robot)})
    for line in [json.dumps(rows, indent=2, ensure_ascii=False)] if as_json else _lines(rows):
        typer.echo(line)
    if found:
        raise Findings(found)


def _lines(rows: list[dict[str, Any]]) -> Iterator[str]:
    names, titles = (max(len(row[key]) for row in rows) for key in ("name", "title"))
    for row in rows:
        title = printable(f"{row['title']:<{titles}}")
        yield f"{row['name']:<{names}}  {title}  {row['joints']} joints, {row['spheres']} spheres"


def _count(robot: "Robot") -> int:
    return sum(map(len, robot.spheres.values()))


@app.command("show")
def show_robot(
    robot: Name,
    as_json: AsJson = False,
    picture: Annotated[
        Path | None,
        typer.Option(help="Also write a PNG file: the robot asleep with its tool's frame, and its spheres beside it."),
    ] = None,
) -> None:
    """Show a robot's joints, tool, gripper and reach.

    Limits are those that hold: the file's, and where it gives none the URDF's.

    \b
    Example:
      regrasp robots show ur5e --picture runs/ur5e.png
    """
    from regrasp.app.robots.description import described, described_in_words
    from regrasp.app.robots.robot_file import load_robot

    if picture is not None and picture.suffix.lower() != ".png":
        raise Findings([Finding("--picture", 0, f"{quoted(str(picture))} is no PNG file; write a name with .png")])
    loaded = load_robot(resolve("robot", robot, Path()))
    if picture is not None:
        from regrasp.app.robots.picture import write_picture  # late: it brings the renderer

        write_picture(loaded, picture)
    if as_json:
        typer.echo(json.dumps(described(loaded), indent=2, ensure_ascii=False))
        return
    for line in described_in_words(loaded):
        typer.echo(printable(line))


@app.command("check")
def check_robots(
    files: Annotated[
        list[str] | None, typer.Argument(help="Names or paths; default all that `regrasp robots list` tells.")
    ] = None,
) -> None:
    """Check robot files, and measure how well their spheres cover the meshes.

    Finds joints, links and packages that do not exist, mesh files that are missing, limits beyond the URDF's, poses
    beyond the limits or in which the robot meets itself, and meshes that lie farther outside the spheres than the
    file's section `cover` promises.

    \b
    Example:
      regrasp robots check my/robot.yaml

    \b
    Exit code: 0 nothing is wrong, 2 findings, one a line:
      file:line: what is wrong; what would be right
    """
    from regrasp.app.robots.check import check_robot

    found: list[Finding] = []
    for name in files or named("robot"):
        try:
            path = resolve("robot", name, Path())
            measures = check_robot(path)
        except Findings as error:
            found += error.items
            continue
        outside = max((m.outside or 0.0 for m in measures if m.moves), default=0.0)
        outside, excess = max(outside, 0.0), max((m.excess or 0.0 for m in measures if m.moves), default=0.0)
        count = sum(m.spheres for m in measures)
        cover = f"{count} spheres leave at most {1000 * outside:.1f} mm of a moving link outside"
        typer.echo(f"{shown(path)}: ok, {cover} and stand out by at most {1000 * excess:.1f} mm")
    if found:
        raise Findings(found)


@app.command("spheres")
def fit_robot_spheres(
    robot: Name,
    margin: Annotated[
        list[str] | None,
        typer.Option(
            metavar="[LINKS=]M",
            help="Metres that a sphere may stand out, 0.02 by default; of some links: gripper_*=0.008.",
        ),
    ] = None,
    links: Annotated[
        list[str] | None,
        typer.Option(metavar="LINKS", help="Fit these links only, such as 'gripper_*'; repeat. Others keep theirs."),
    ] = None,
    out: Annotated[
        Path | None, typer.Option("-o", "--out", metavar="FILE", help="Write here instead of standard output.")
    ] = None,
) -> None:
    """Fit collision spheres to a robot's meshes.

    Prints the sections `cover`, `self_collision` and `spheres` of a robot file. The spheres hold all of each
    link's collision geometry, and stand out of it by at most the margin: with half of it there are three to five times
    as many. Planning takes time with their number; small margins pay at fingers, which go near things.

    The pairs of self_collision are those links that meet in some of 5,000 random joint positions. The others never do,
    always do, or are neighbours.

    \b
    Examples:
      regrasp robots spheres my/robot.yaml
      regrasp robots spheres my/robot.yaml --margin 0.03 --margin '*finger*=0.006' > spheres.yaml
      regrasp robots spheres my/robot.yaml --links wrist_3_link --margin 0.01
    """
    from regrasp.app.files.whole_file import write_named
    from regrasp.app.robots.proposal import as_yaml, propose, table
    from regrasp.app.robots.robot_file import read_robot
    from regrasp.interfaces.robot.urdf import RobotError

    margins = _margins(margin or [])
    if out is not None and (out.is_dir() or out.is_file() or not out.exists()):  # a pipe is written to as it is
        _can_write(out)
    loaded, document = read_robot(resolve("robot", robot, Path()))
    _known_links(loaded, links or [], "--links")
    _known_links(loaded, [pattern for pattern, _ in margins.of_links], "--margin")
    try:
        proposal = propose(loaded, margins, links or (), lambda line: typer.echo(line, err=True))
    except RobotError as error:
        raise Findings([Finding(*document.place(error.path), str(error))]) from None
    for line in table(proposal.measures):
        typer.echo(line, err=True)
    text = as_yaml(proposal)
    if out is None:
        typer.echo(text, nl=False)
    else:
        write_named(out, text)
        typer.echo(f"{shown(out)}: put its sections into {shown(resolve('robot', robot, Path()))}", err=True)


def _can_write(out: Path) -> None:
    """Raise `Findings` if it cannot be written; a fit takes long, and is not to be lost."""
    from regrasp.app.records.folders import file_findings

    if found := file_findings(out):
        raise Findings([replace(finding, source=shown(out)) for finding in found])


def _margins(texts: list[str]) -> "Margins":
    from regrasp.app.robots.proposal import Margins

    general, of_links = Margins().general, []
    for text in texts:
        pattern, equals, number = text.rpartition("=")
        try:
            value = float(number)
        except ValueError:
            value = float("nan")
        if not LEAST_MARGIN <= value <= MOST_MARGIN or (equals and not pattern):
            right = (
                f"write metres from {LEAST_MARGIN} to {MOST_MARGIN}, such as 0.02, or for some links gripper_*=0.008"
            )
            raise Findings([Finding("--margin", 0, f"{quoted(text)} is no margin; {right}")])
        if pattern:
            of_links.append((pattern, value))
        else:
            general = value
    return Margins(general, tuple(of_links))


def _known_links(robot: "Robot", patterns: list[str], option: str) -> None:
    from fnmatch import fnmatchcase

    for pattern in patterns:
        if not any(fnmatchcase(link, pattern) for link in robot.tree.links):
            message = f"no link of the robot is named {quoted(pattern)}; {nearest(pattern, robot.tree.links)}"
            raise Findings([Finding(option, 0, message)])
