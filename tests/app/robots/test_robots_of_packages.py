"""Robots that an installed package puts in, by the entry points `regrasp.robots`."""

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from toy_robot import write_robot
from typer.testing import CliRunner

from regrasp.app.cli.commands import app
from regrasp.app.scenario.cell_file import load_cell
from regrasp.interfaces.plugins import installed

SECOND_TASK = Path(__file__).parents[2] / "second_task"
MODULE = "from pathlib import Path\nTOY = Path(__file__).with_name('toy.yaml')\n"
Install = Callable[[str, str], None]


@pytest.fixture
def install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Install]:
    """Installs a package with one entry point and a module of this text, named after the test's folder."""

    def now(name: str, text: str) -> None:
        package = f"robots_of_{tmp_path.name}"
        folder = tmp_path / f"{package}-1.0.dist-info"
        folder.mkdir()
        (folder / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {package}\nVersion: 1.0\n")
        (folder / "entry_points.txt").write_text(f"[regrasp.robots]\n{name} = {package}:TOY\n")
        (tmp_path / f"{package}.py").write_text(text)
        write_robot(tmp_path)
        for place in (SECOND_TASK, tmp_path):
            monkeypatch.syspath_prepend(str(place))
        monkeypatch.chdir(Path(__file__).parent)
        installed.cache_clear()

    yield now
    installed.cache_clear()


def robots(*args: str) -> Any:
    return CliRunner().invoke(app, ["robots", *args])


def test_a_package_s_robot_is_listed_shown_and_checked(install: Install) -> None:
    install("toy", MODULE)
    names = [row["name"] for row in json.loads(robots("list", "--json").stdout)]
    assert names == ["ur5e", "ur5e_rail", "vx300s", "toy"]
    assert robots("show", "toy").stdout.startswith("Toy\n")
    checked = robots("check", "toy")
    assert (checked.exit_code, checked.stderr) == (0, "")
    assert "toy.yaml: ok, 14 spheres" in checked.stdout
    assert "did you mean 'toy'?" in robots("show", "toyy").stderr


def test_a_cell_and_another_robot_may_name_it(install: Install, tmp_path: Path) -> None:
    install("toy", MODULE)
    (tmp_path / "heavy.yaml").write_text("base: toy\ntitle: Heavy\n")
    arms = "[{name: solo, robot: toy, base: [0.1, 0.0, 0.0]}, {name: other, robot: heavy.yaml, base: [4.0, 0.0, 0.0]}]"
    (tmp_path / "cell.yaml").write_text(f"base: {SECOND_TASK / 'cell.yaml'}\nknown: {{arms: {arms}}}\n")
    cell = load_cell(tmp_path / "cell.yaml", laid_out=False)
    assert [arm.robot.title for arm in cell.known.arms] == ["Toy", "Heavy"]
    assert cell.known.arms[0].robot.joint_names == ("turn", "bend")


@pytest.mark.parametrize(
    ("name", "module", "told"),
    [
        ("toy", "import nowhere", "toy: the robot toy cannot be loaded: ModuleNotFoundError"),
        ("toy", "TOY = 3", "toy: the robot toy cannot be loaded: '3' is no absolute path"),
        ("toy", MODULE.replace("toy.yaml", "gone.yaml"), "does not exist; name a file"),
        ("vx300s", MODULE, "a package puts in a robot with the name of a shipped one, vx300s; rename its entry point"),
    ],
)
def test_a_package_s_robot_that_cannot_be_had_is_a_line_and_hides_no_other(
    install: Install, name: str, module: str, told: str
) -> None:
    install(name, module)
    for command in (("list",), ("show", name)):
        ran = robots(*command)
        assert (ran.exit_code, ran.stderr.count("\n")) == (2, 1)
        assert told in ran.stderr
    assert "ur5e_rail" in robots("list").stdout
