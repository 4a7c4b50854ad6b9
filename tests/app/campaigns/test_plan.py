"""What a campaign file asks for, and what is wrong with one."""

from pathlib import Path

import pytest

from regrasp.app.campaigns.plan import planned
from regrasp.app.files.findings import Findings


def written(folder: Path, text: str) -> str:
    path = folder / "many.yaml"
    path.write_text(text)
    return str(path)


def test_a_scenario_runs_every_case_with_every_seed() -> None:
    runs = planned("no_obstacle", seeds=range(3, 5))
    assert [(run.scenario.case, run.seed) for run in runs] == [
        ("gravity=zero", 3),
        ("gravity=earth", 3),
        ("gravity=zero", 4),
        ("gravity=earth", 4),
    ]
    assert [run.seed for run in planned("no_obstacle", ["seed=9", "gravity=earth"])] == [9]


def test_a_campaign_file(tmp_path: Path) -> None:
    (tmp_path / "own.yaml").write_text("description: mine\ncell: thesis\ntree: recovery\ngravity: earth\nseed: 11\n")
    file = written(
        tmp_path,
        """
seeds: "0:2"
scenarios:
  - {scenario: no_obstacle, set: [gravity=earth], seeds: [7, 3, 7]}
  - scenario: own.yaml
  - {scenario: short_obstacle, seeds: "5:6"}
""",
    )
    told = [(run.scenario.name, run.scenario.file.gravity, run.seed) for run in planned(file)]
    assert told == [
        ("no_obstacle", "earth", 7),
        ("no_obstacle", "earth", 3),
        ("own", "earth", 0),
        ("own", "earth", 1),
        ("short_obstacle", "zero", 5),
        ("short_obstacle", "earth", 5),
    ]
    assert {run.seed for run in planned(file, seeds=range(1))} == {0}  # the command line's go before
    assert {run.scenario.file.limits.sim_seconds for run in planned(file, ["limits.sim_seconds=5"])} == {5.0}


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("scenarios: []\n", "many.yaml:1: scenarios is []; expected a list of at least 1 value"),
        ("scenarios:\n- {scenaro: a}\n", "many.yaml:2: unknown key 'scenaro'; did you mean 'scenario'?"),
        ("scenarios:\n- scenario: nothing\n", "many.yaml:2: nothing: nothing: no scenario named 'nothing'"),
        ("scenarios:\n- scenario: none.yaml\n", "many.yaml:2: none.yaml: "),
        ("scenarios:\n- scenario: many.yaml\n", "many.yaml:2: 'many.yaml' is a campaign file; name a scenario"),
        ("seeds: '5:2'\nscenarios:\n- scenario: no_obstacle\n", "many.yaml:1: seeds: '5:2' is no range of seeds"),
        ("scenarios:\n- {scenario: no_obstacle, seeds: [-1]}\n", "many.yaml:2: scenarios.0.seeds: -1 is no seed"),
        ("scenarios:\n- {scenario: no_obstacle, seeds: []}\n", "many.yaml:2: scenarios.0.seeds: an empty list is no"),
        ("scenarios:\n- {scenario: no_obstacle, set: [gravty=zero]}\n", "many.yaml:2: no_obstacle: --set gravty=zero"),
        ("scenarios:\n- {scenario: no_obstacle, set: ['vary.seed=[1]'], seeds: '0:2'}\n", "varies its seed itself"),
        (
            "seeds: '0:1'\nscenarios:\n- scenario: no_obstacle\n- {scenario: no_obstacle, set: [inputs.tries=5]}\n",
            "is asked for twice with other values",
        ),
    ],
)
def test_what_is_wrong_has_its_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, text: str, told: str) -> None:
    monkeypatch.chdir(tmp_path)
    written(tmp_path, text)
    with pytest.raises(Findings) as raised:
        planned("many.yaml")
    assert told in str(raised.value)
