"""What a command imports: nothing that it does not need, since imports are most of the time of a short command."""

import json
import subprocess
import sys
from collections.abc import Collection
from pathlib import Path

SIMULATION = ("scipy", "numba", "llvmlite", "cv2", "pybullet", "ompl", "eaik", "toppra", "moderngl", "matplotlib")
WRONG_TREE = '<root BTCPP_format="4"><BehaviorTree ID="main"><NoSuchLeaf/></BehaviorTree></root>'


def _imported(*arguments: str, of: Collection[str], code: int = 0) -> tuple[set[str], str]:
    """Which of the packages `regrasp` with these arguments imports, and what it writes to stderr."""
    program = (
        "import json, sys; from regrasp.app.__main__ import main; sys.argv = ['regrasp', *sys.argv[1:]]\n"
        "try: main()\n"
        "finally: print(json.dumps(sorted({m.split('.')[0] for m in sys.modules})))"
    )
    done = subprocess.run(
        [sys.executable, "-c", program, *arguments], capture_output=True, text=True, timeout=120, check=False
    )
    assert done.returncode == code, done.stderr
    return set(json.loads(done.stdout.splitlines()[-1])) & set(of), done.stderr


def test_help_needs_no_arithmetic_and_no_models() -> None:
    assert _imported("--help", of=("numpy", "scipy", "pydantic", "structlog"))[0] == set()


def test_the_check_of_a_tree_brings_neither_planner_nor_vision() -> None:
    assert _imported("trees", "check", "recovery", of=SIMULATION)[0] == set()


def test_the_list_of_leaves_and_the_drawing_of_a_tree_bring_neither_planner_nor_vision() -> None:
    assert _imported("trees", "leaves", of=SIMULATION)[0] == set()
    assert _imported("trees", "show", "recovery", of=SIMULATION)[0] == set()


def test_the_check_of_a_wrong_tree_tells_what_is_wrong(tmp_path: Path) -> None:
    path = tmp_path / "wrong.xml"
    path.write_text(WRONG_TREE)
    brought, told = _imported("trees", "check", str(path), of=SIMULATION, code=2)
    assert brought == set()
    assert "wrong.xml:1: " in told
    assert "NoSuchLeaf" in told


def test_the_check_of_a_tree_knows_the_techniques(tmp_path: Path) -> None:
    path = tmp_path / "technique.xml"
    path.write_text(WRONG_TREE.replace("<NoSuchLeaf/>", '<UseTechnique technique="fussed"/>'))
    _, told = _imported("trees", "check", str(path), of=SIMULATION, code=2)
    assert "fused" in told


def test_finding_a_connector_in_pictures_brings_no_simulator_and_no_planner(tmp_path: Path) -> None:
    files = [part for name in ("rgb", "depth", "intrinsics") for part in (f"--{name}", str(tmp_path / name))]
    unneeded = ("pybullet", "ompl", "eaik", "toppra", "moderngl", "matplotlib", "trimesh")
    brought, told = _imported("perceive", *files, "--technique", "rgbd", of=(*unneeded, "numba"), code=2)
    assert brought == set()
    assert str(tmp_path / "intrinsics") in told
