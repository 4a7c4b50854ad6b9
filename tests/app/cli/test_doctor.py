import re
import sys
from pathlib import Path

import pytest

from regrasp.app.cli import doctor


def test_a_machine_that_runs_these_tests_lacks_nothing(tmp_path: Path) -> None:
    seen = {check.name: check for check in doctor.checks(tmp_path / "runs")}
    assert [check for check in seen.values() if check.status == "wrong"] == []
    assert seen["python"].seen == ".".join(map(str, sys.version_info[:3]))
    assert re.match(r"software, \d+ ms for a picture of a camera; .", seen["renderer"].seen)
    assert not (tmp_path / "runs").exists()


def test_an_old_python_is_wrong() -> None:
    assert doctor.python((3, 10, 9)).status == "wrong"
    assert "3.11" in doctor.python((3, 10, 9)).seen


def test_a_package_that_is_not_there_is_wrong() -> None:
    assert doctor.package("no-such-package-anywhere").status == "wrong"


def test_an_output_folder_below_a_file_is_wrong(tmp_path: Path) -> None:
    (tmp_path / "runs").write_text("")
    assert doctor.output_folder(tmp_path / "runs").status == "wrong"


def test_missing_egl_names_the_packages_and_nothing_is_wrong() -> None:
    assert doctor.egl(lambda _: None) == doctor.Check(
        "EGL libraries",
        "ok",
        "for --renderer moderngl: EGL not found (libegl1), EGL_mesa not found (libegl-mesa0); "
        "on Debian: apt-get install libegl1 libegl-mesa0 libgl1-mesa-dri",
    )


def test_slow_pictures_are_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(doctor, "SLOW_PICTURE", 1e-6)
    assert doctor.renderer().status == "slow"


def test_a_world_that_cannot_be_built_is_told_in_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*_: object, **__: object) -> None:
        raise RuntimeError("no physics")

    monkeypatch.setattr("regrasp.sim.world.World", broken)
    assert doctor.renderer().status == "wrong"
    assert doctor.renderer().seen == "no world can be built: RuntimeError: no physics"
