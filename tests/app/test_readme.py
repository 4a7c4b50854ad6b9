"""README and tutorial: commands are ours, samples right, links alive. `make readme` runs the README's commands."""

import re
import shlex
from pathlib import Path
from typing import Any

import pytest
import typer.main
from readme_commands import README, commands

from regrasp.app.cli.commands import app
from regrasp.app.files.findings import Findings
from regrasp.app.robots.check import check_robot
from regrasp.app.scenario.load import cases

TEXT = README.read_text(encoding="utf-8")
OURS = [command for command in commands(TEXT) if command.startswith("regrasp ")]
TUTORIAL = README.parent / "docs" / "tutorial.md"
ROBOTS = README.parent / "docs" / "robots.md"
TAUGHT = [
    command
    for page in (TUTORIAL, ROBOTS)
    for command in commands(page.read_text(encoding="utf-8"))
    if command.startswith("regrasp ")
]
FIRST_ROBOT = re.findall(r"```yaml\n(title: .*?)```", ROBOTS.read_text(encoding="utf-8"), re.DOTALL)[0]
PAGES = [README, *sorted(TUTORIAL.parent.glob("*.md"))]


@pytest.mark.parametrize("command", [*OURS, *TAUGHT])
def test_a_command_is_one_of_ours(command: str) -> None:
    """All of its options and values are taken."""
    group: Any = typer.main.get_command(app)
    words = shlex.split(command)[1:]
    context = group.make_context("regrasp", list(words))
    while hasattr(group, "resolve_command"):
        words = [*context._protected_args, *context.args]  # a group may put its default command in front
        name, group, words = group.resolve_command(context, words)
        context = group.make_context(name, list(words), parent=context)
    assert context.command is group


def test_runs_are_made_before_they_are_looked_at() -> None:
    made: dict[str, int] = {}
    for command in OURS:
        words = shlex.split(command)
        for record in (
            word for word in words if word.startswith("runs/") and words[1] in ("explain", "replay", "diff")
        ):
            name, _, number = record.removeprefix("runs/").rpartition("-")
            assert made.get(name, 0) >= int(number), command
        if words[1] == "run" and "--all" not in words:
            seed = words[words.index("--seed") + 1] if "--seed" in words else "0"
            name = f"{words[2].rsplit('/', 1)[-1]}-{seed}"
            made[name] = made.get(name, 0) + 1


@pytest.mark.parametrize(("page", "count"), [(README, 30), (TUTORIAL, 2)], ids=["README", "tutorial"])
def test_a_scenario_that_is_shown_is_right(page: Path, count: int, tmp_path: Path) -> None:
    _, _, rest = page.read_text(encoding="utf-8").partition("```yaml\n")
    (tmp_path / "mine.yaml").write_text(rest.partition("```")[0])
    assert len(cases(str(tmp_path / "mine.yaml"))) == count


def test_the_tutorial_s_test_passes(pytester: pytest.Pytester) -> None:
    [example] = re.findall(r"```python\n(.*?)```", TUTORIAL.read_text(encoding="utf-8"), re.DOTALL)
    pytester.makepyfile(example)
    pytester.runpytest_inprocess("-p", "regrasp.app.pytest_plugin", "-p", "no:cacheprovider").assert_outcomes(passed=1)


def first_robot(folder: Path, text: str | None = None) -> list[str]:
    """What is wrong with the first robot of docs/robots.md, or with this text in its place."""
    path = folder / "mine.yaml"
    path.write_text(text or FIRST_ROBOT)
    with pytest.raises(Findings) as raised:
        check_robot(path)
    return [item.message for item in raised.value.items]


def test_the_first_robot_lacks_nothing_but_spheres(tmp_path: Path) -> None:
    [told] = first_robot(tmp_path)
    assert told.startswith("no spheres; ")


@pytest.mark.parametrize("key", re.findall(r"^(\w+):", FIRST_ROBOT, re.MULTILINE))
def test_the_first_robot_has_no_key_that_may_be_left_out(key: str, tmp_path: Path) -> None:
    [told] = first_robot(tmp_path, re.sub(rf"^{key}:.*\n( .*\n)*", "", FIRST_ROBOT, flags=re.MULTILINE))
    assert told.startswith(f"key {key!r} is missing; ")


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_every_link_leads_somewhere(page: Path) -> None:
    for link in re.findall(r"\]\(([^)]+)\)", page.read_text(encoding="utf-8")):
        if link.startswith("https://"):
            continue
        path, _, section = link.partition("#")
        assert (page.parent / path).exists(), link
        assert not section or section in sections(page.parent / path), link


def sections(page: Path) -> list[str]:
    """The name of each heading in a link, as GitHub makes it: small letters, no marks, a dash for a blank."""
    headings = re.findall(r"^#+ (.*)$", page.read_text(encoding="utf-8"), re.MULTILINE)
    return [re.sub(r"[^\w -]", "", heading.lower()).replace(" ", "-") for heading in headings]
