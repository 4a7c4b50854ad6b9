"""A file with many mistakes gives a finding for each in one call, and none beside."""

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from toy_scenario import write_scenario

from regrasp.app.files.findings import Findings
from regrasp.app.scenario.load import cases

LINES = """\
description: a foam block hides the end of the cable
task: cable
cell: thesis
tree: tree.xml
gravity: zero
seed: 3
inputs:
  tries: 4
obstacles:
  - name: short
    size: [0.08, 0.12, 0.18]
    color: [0.5, 0.2, 0.6]
    position:
      zero: [0.30, 0.14, 0.16]
      earth: [0.30, 0.12, 0.0]
    jitter: [0.01, 0.01, 0.0]
  - name: tall
    size: [0.08, 0.12, 0.3]
    position:
      zero: [-2.0, 0.0, 0.0]
      earth: [-2.0, 0.0, 0.0]
faults:
  - type: jaw_opens
    seconds: 1.0
    when:
      carried: [0.3, 0.8]
  - type: joint_stalls
    arm: right
    joint: elbow
    when: # it moves
      node: settle
      after: [0.5, 1.0]
  - type: obstacle_moves_in
    obstacle: tall
    by: [0.0, 0.1, 0.0]
    when:
      at: [1.0, 2.0]
light:
  brightness: 0.5
limits:
  sim_seconds: 600
expect:
  outcome: failure
  cause: search_exhausted
  slips: 1
markers: [slow]
vary:
  gravity: [zero, earth]
  inputs.tries:
    - 2
    - 3
  expect.slips: [0, 1]
  light.brightness: {from: 0.5, to: 1.0, steps: 2}
  seed: '0:2'
""".splitlines()


class Mistake(NamedTuple):
    """A wrong line in place of a right one, and what is said of it, by default at that line."""

    right: str
    wrong: str
    said: str
    at: str | None = None


WHEN = LINES[LINES.index("      node: settle") - 1]
MISTAKES = [
    Mistake(*row)
    for row in [
        ("description: a foam block hides the end of the cable", "description: 3", "description is 3; expected text"),
        ("cell: thesis", "cell: thesi", "no cell named 'thesi'; did you mean 'thesis'?"),
        ("tree: tree.xml", "tree: gone.xml", "'gone.xml' does not exist; name a file"),
        ("gravity: zero", "gravity: mars", "gravity: no 'mars'; there are earth, zero"),
        ("seed: 3", "seed: -3", "seed is -3; expected a whole number"),
        ("  tries: 4", "  trys: 4", "inputs.trys: unknown input 'trys'; did you mean 'tries'?"),
        (
            "  tries: 4",
            "  tries: four",
            "inputs.tries: Retry 'again': num_failures={tries} is 'four' here, which is no",
        ),
        ("  tries: 4", "  tries: '{x}'", "inputs.tries is '{x}'; expected true or false"),
        ("    size: [0.08, 0.12, 0.18]", "    size: [0.08, 0.12]", "obstacles.0.size is [0.08, 0.12]; expected 3"),
        ("    color: [0.5, 0.2, 0.6]", "    colour: [0.5, 0.2, 0.6]", "unknown key 'colour'; did you mean 'color'?"),
        ("    color: [0.5, 0.2, 0.6]", "    color: [.nan, 0.2, 0.6]", "'.nan' is no plain finite number; write it"),
        ("      zero: [0.30, 0.14, 0.16]", "      zero: [-2, 0.14, -0.3]", "obstacle 'short' reaches 0.300 m below"),
        ("    jitter: [0.01, 0.01, 0.0]", "    jitter: [x, 0.01, 0.0]", "obstacles.0.jitter.0 is 'x'; expected a num"),
        (
            "      earth: [-2.0, 0.0, 0.0]",
            "      earth: [-2.0, 0.0, -0.1]",
            "obstacle 'tall' reaches 0.100 m below the",
        ),
        ("  - type: jaw_opens", "  - type: jaw_open", "faults.0.type: no 'jaw_open'; did you mean 'jaw_opens'?"),
        ("  - type: jaw_opens", "  - tpye: jaw_opens", "unknown key 'tpye'; did you mean 'type'?"),
        ("    seconds: 1.0", "    secnds: 1.0", "unknown key 'secnds'; did you mean 'seconds'?"),
        ("      carried: [0.3, 0.8]", "      carried: [0.8, 0.3]", "faults.0.when.carried: runs backwards; put the"),
        ("      carried: [0.3, 0.8]", "      caried: [0.3, 0.8]", "unknown key 'caried'; did you mean 'carried'?"),
        ("    joint: elbow", "    joint: elbo", "the right arm has no joint 'elbo'; did you mean 'elbow'?"),
        (
            "    joint: elbow",
            "    ",
            "key 'joint' is missing in faults.1; expected text",
            "  - type: joint_stalls",
        ),
        ("      node: settle", "      node: setle", "no node 'setle' in tree.xml; did you mean 'settle'?"),
        (
            "      node: settle",
            "      phase: lost",
            "faults.1.when: after goes with node; write node: carry beside it",
            WHEN,
        ),
        (
            "      after: [0.5, 1.0]",
            "      at: [0.5, 1.0]",
            "faults.1.when: at and",
            WHEN,
        ),
        ("    obstacle: tall", "    obstacle: tal", "no obstacle 'tal'; did you mean 'tall'?"),
        ("    by: [0.0, 0.1, 0.0]", "    by: [0.0, 9, 0.0]", "faults.2.by.1 is 9; expected a number in metres"),
        ("  brightness: 0.5", "  brightness: 5", "light.brightness is 5; expected a number (at least 0, at most 3)"),
        ("  sim_seconds: 600", "  sim_seconds: 1e3", "'1e3' is text to YAML, not a number; write 1.0e+3"),
        ("limits:", "limts:", "unknown key 'limts'; did you mean 'limits'?"),
        ("  outcome: failure", "  outcome: failre", "expect.outcome: no 'failre'; did you mean 'failure'?"),
        ("  cause: search_exhausted", "  cause: search", "expect.cause: no 'search'; there are"),
        ("  slips: 1", "  slips: -1", "expect.slips is -1; expected a whole number (at least 0"),
        ("markers: [slow]", "markers: [slow!]", "markers.0 is 'slow!'; expected text such as 'slow'"),
        ("  gravity: [zero, earth]", "  gravity: []", "vary.gravity is []; expected a list of at least 1 value"),
        (
            "  gravity: [zero, earth]",
            "  gravity: [zero, moon]",
            "gravity: no 'moon'; there are earth, zero (case gravity",
        ),
        ("  gravity: [zero, earth]", "  gravty: [zero, earth]", "unknown key 'gravty'; did you mean 'gravity'?"),
        ("    - 3", "    - 0", "inputs.tries: Retry 'again': num_failures={tries} is '0' here, which is not above 0"),
        ("    - 3", "    - 2", "vary: inputs.tries takes 2 twice; keep one"),
        ("  expect.slips: [0, 1]", "  expect.slips: [0, x]", "expect.slips is 'x'; expected a whole number"),
        (
            "  expect.slips: [0, 1]",
            "  expect.slips.low: [0, 1]",
            "vary: expect.slips.low: expect.slips is a single value",
        ),
        ("  seed: '0:2'", "  seed: '2:2'", "vary.seed: '2:2' holds no number; write A:B with A below B"),
        ("  seed: '0:2'", "  seed: '0:99999'", "vary makes more than 10000 cases; shorten", "vary:"),
    ]
]
HIDDEN_BY = {  # what cannot be told, or is no mistake of its own, beside another
    "cell: thesi": ["    joint: elbo"],  # the cell says which robots there are
    "tree: gone.xml": ["  trys: 4", "  tries: four", "      node: setle", "    - 0"],
    "      at: [0.5, 1.0]": ["      phase: lost"],
    "  slips: -1": ["  expect.slips.low: [0, 1]"],
}


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    write_scenario(tmp_path, monkeypatch)
    return tmp_path


def with_mistakes(folder: Path, mistakes: Sequence[Mistake]) -> list[str]:
    """The findings of the file with these mistakes."""
    wrong = {m.right: m.wrong for m in mistakes}
    (folder / "mine.yaml").write_text("\n".join(wrong.get(line, line) for line in LINES))
    try:
        cases("mine.yaml")
    except Findings as error:
        return str(error).splitlines()
    return []


def expected(mistake: Mistake) -> str:
    """How the finding of this mistake begins."""
    line = LINES.index(mistake.right if mistake.at is None else mistake.at)
    return f"mine.yaml:{line + 1}: {mistake.said}"


def test_without_mistakes_there_is_no_finding(folder: Path) -> None:
    assert with_mistakes(folder, []) == []


@settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.lists(st.sampled_from(MISTAKES), min_size=1, max_size=12, unique_by=lambda m: m.right))
def test_each_mistake_is_one_finding_beside_any_others(folder: Path, mistakes: list[Mistake]) -> None:
    hidden = [wrong for m in mistakes for wrong in HIDDEN_BY.get(m.wrong, [])]
    told = sorted(expected(m) for m in mistakes if m.wrong not in hidden)
    found = sorted(with_mistakes(folder, mistakes))
    assert [f for f in found if not f.startswith(tuple(told))] == []
    assert [t for t in told if sum(f.startswith(t) for f in found) != 1] == []


@pytest.mark.parametrize("mistake", MISTAKES, ids=lambda m: m.wrong.strip())
def test_each_mistake_alone_is_one_finding(folder: Path, mistake: Mistake) -> None:
    [finding] = with_mistakes(folder, [mistake])
    assert finding.startswith(expected(mistake))
