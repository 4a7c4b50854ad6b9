"""The progress of a campaign, as lines in a pipe."""

import pytest

from regrasp.app.campaigns.progress import Progress


def test_what_was_done_before_counts(capfd: pytest.CaptureFixture[str]) -> None:
    progress = Progress(seconds_of_summary=0.0)
    progress.begin(total=100, done_before=60, succeeded_before=58)
    progress.ended("a scene", "success", True)
    told = capfd.readouterr().err
    assert "60 of 100 are done already" in told
    assert "[61/100] a scene: success" in told
    assert "61 of 100 done; 59 as expected (95 % interval 89 to 99 %); " in told


def test_runs_that_expect_nothing_have_no_successes(capfd: pytest.CaptureFixture[str]) -> None:
    progress = Progress(seconds_of_summary=0.0, counted=False)
    progress.begin(total=3, done_before=0, succeeded_before=0)
    progress.ended("a scene", "done", True)
    assert "expected" not in capfd.readouterr().err
