"""The wheel, installed in an empty environment, beside a user's project whose folders are named as ours are."""

import os
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
SUITE = """\
description: the drive of the shoulder jams
cell: thesis
tree: recovery
gravity: zero
faults: [{type: joint_stalls, when: {at: [0.0, 0.0]}, arm: right, joint: shoulder}]
expect: {outcome: failure, cause: arm_failed}
"""
OWN = """\
from app import NAME
from sim.world import World
def test_these_are_mine():
    assert (NAME, World) == ("my app", "my world")
"""


def tracked() -> list[str]:
    """The files of this checkout that git knows."""
    return subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True).stdout.splitlines()


@pytest.fixture(scope="module")
def environment(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The programs of an environment that holds the wheel, and beside it nothing but what the wheel requires."""
    wheels, made = tmp_path_factory.mktemp("wheels"), tmp_path_factory.mktemp("environment")
    source = tmp_path_factory.mktemp("source")  # a build leaves files behind that the next one packs again
    for name in tracked():
        (source / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy2(ROOT / name, source / name, follow_symlinks=False)
    pip = [sys.executable, "-m", "pip", "--quiet", "--disable-pip-version-check"]
    options = ["--no-deps", "--no-index", "--no-build-isolation"]
    subprocess.run([*pip, "wheel", *options, f"--wheel-dir={wheels}", str(source)], check=True, timeout=300)
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", str(made)], check=True, timeout=300)
    python = made / "bin" / "python"
    (wheel,) = wheels.glob("*.whl")
    subprocess.run([*pip, f"--python={python}", "install", "--no-deps", "--no-index", str(wheel)], check=True)
    # What it requires is here already. A path in a .pth file brings no .pth files of its own, hence not our checkout.
    purelib = sysconfig.get_path("purelib", vars={"base": str(made)})
    Path(purelib, "required.pth").write_text(sysconfig.get_path("purelib"))
    take_compiled(Path(purelib, "regrasp"))
    return made / "bin"


def take_compiled(installed: Path) -> None:
    """Copy numba's cache of this checkout, which takes a minute to make; it counts only if the source is as old."""
    for name in tracked():
        source, target = ROOT / name, installed / name
        if target.suffix == ".py" and target.is_file():
            shutil.copystat(source, target)
            (target.parent / "__pycache__").mkdir(exist_ok=True)
            for compiled in (source.parent / "__pycache__").glob(f"{source.stem}.*.nb[ic]"):
                shutil.copy2(compiled, target.parent / "__pycache__")


@pytest.fixture
def project(tmp_path: Path) -> Path:
    """A user's project: packages `app` and `sim`, a test of its own, a scenario and a tree."""
    for package, text in {"app": "NAME = 'my app'\n", "sim": ""}.items():
        (tmp_path / package).mkdir()
        (tmp_path / package / "__init__.py").write_text(text)
    (tmp_path / "sim" / "world.py").write_text("World = 'my world'\n")
    (tmp_path / "test_own.py").write_text(OWN)
    (tmp_path / "jams.scenario.yaml").write_text(SUITE)
    (tmp_path / "trees").mkdir()
    (tmp_path / "trees" / "mine.xml").write_text((ROOT / "trees" / "recovery.xml").read_text())
    return tmp_path


def run(project: Path, *command: str | Path) -> str:
    clean = {key: value for key, value in os.environ.items() if key not in ("PYTHONPATH", "PYTEST_ADDOPTS")}
    done = subprocess.run(command, cwd=project, env=clean, capture_output=True, text=True, timeout=600)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def test_a_project_s_own_app_and_sim_stay_its_own(environment: Path, project: Path) -> None:
    told = run(project, environment / "python", "-m", "pytest", "-q", "-p", "no:cacheprovider")
    assert "4 passed" in told  # its own test, the scenario, and two of the tree


def test_all_that_is_shipped_is_there(environment: Path, project: Path) -> None:
    where = run(project, environment / "python", "-c", "import regrasp; print(regrasp.__file__)")
    assert str(environment.parent) in where
    scenarios = run(project, environment / "regrasp", "scenarios", "list")
    assert len(scenarios.splitlines()) == len([*ROOT.glob("scenarios/*.yaml"), *ROOT.glob("scenarios/faults/*.yaml")])
    run(project, environment / "python", "-m", "regrasp", "scenarios", "check", "short_obstacle", "faults/joint_lags")
    assert "unplug" in run(project, environment / "regrasp", "trees", "show", "recovery")


def test_every_file_of_ours_is_in_the_wheel(environment: Path) -> None:
    installed = Path(sysconfig.get_path("purelib", vars={"base": str(environment.parent)})) / "regrasp"
    packages = {path.name for path in (ROOT / "regrasp").iterdir() if path.is_symlink()}
    wanted = [name for name in tracked() if name.partition("/")[0] in packages]
    assert [name for name in wanted if not (installed / name).is_file()] == []
