"""The pose study's plots, also of a study that was interrupted."""

import numpy as np
import pytest
from matplotlib.axes import Axes

from regrasp.app.tasks.cable.studies.pose.plots import _errors, _shares
from regrasp.app.tasks.cable.studies.pose.study import THESIS
from regrasp.app.tasks.cable.studies.pose.trial import Trial

TECHNIQUES = ["fused", "rgbd", "fiducial", "detector"]


def cut(axes: Axes) -> list[str]:
    """The labels of lines that end at the edge: the thesis's marks are 40 points wide."""
    low, high = axes.get_xlim()
    points = [float(x) for line in axes.get_lines() for x in np.ravel(line.get_xdata())]
    return [str(x) for x in points if not low + 0.4 <= x <= high - 0.4]


@pytest.mark.parametrize("techniques", [["fused"], ["fused", "rgbd"], TECHNIQUES])
@pytest.mark.parametrize("configurations", [["3"], ["1", "3"]])
def test_nothing_is_cut_at_the_edge_whatever_was_done(techniques: list[str], configurations: list[str]) -> None:
    trials = [Trial(t, c, 0, True, error_m=0.002, grasped=True) for t in techniques for c in configurations]
    assert [cut(axes) for axes in _shares(trials, TECHNIQUES, THESIS).axes] == [[], []]
    [errors] = _errors(trials, TECHNIQUES).axes
    low, high = errors.get_xlim()
    assert (low, high) == (-0.5, len(configurations) - 0.5)
