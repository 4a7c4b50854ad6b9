"""What a campaign file asks for, and what is wrong with one."""

from pathlib import Path

import pytest

from regrasp.app.campaigns.plan import one_seed_each, planned
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
        ("scenarios:\n- scenario: nothing\n", "many.yaml:2: no scenario named 'nothing'"),
        ("scenarios:\n- scenario: none.yaml\n", "many.yaml:2: 'none.yaml' does not exist; name a file"),
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


_NO_FILE = "; write scenarios: and below it a list, such as - scenario: no_obstacle"
_ENTRY = "scenarios:\n- scenario: no_obstacle\n"


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("scenarioz:\n- scenario: no_obstacle\n", "many.yaml:1: unknown key 'scenarioz'; did you mean 'scenarios'?"),
        ("Scenario:\n- scenario: no_obstacle\n", "many.yaml:1: unknown key 'Scenario'; did you mean 'scenarios'?"),
        ("", f"many.yaml:1: the file is empty{_NO_FILE}"),
        ("~\n", f"many.yaml:1: the file is empty{_NO_FILE}"),
        ("no_obstacle\n", f"many.yaml:1: the file is 'no_obstacle'{_NO_FILE}"),
        (
            "- scenario: no_obstacle\n",
            "many.yaml:1: the file is a list; write scenarios: above it, and each item such as - scenario: no_obstacle",
        ),
        (
            f"seeds: 600\n{_ENTRY}",
            'many.yaml:1: seeds: 600 is no range of seeds; write a range such as "600:610", or a list such as [3, 7]',
        ),
        (
            f"seeds: true\n{_ENTRY}",
            'many.yaml:1: seeds: true is no range of seeds; write a range such as "0:10", or a list such as [3, 7]',
        ),
        (
            f"{_ENTRY}seeds: [0600,\n 1.5,\n true, 4]\n",
            "many.yaml:3: '0600' is 384 to some readers of YAML and not to others; write 384, or quotes around text\n"
            "many.yaml:4: seeds: 1.5 is no seed; write whole numbers from 0 to 2147483647\n"
            "many.yaml:5: seeds: true is no seed; write whole numbers from 0 to 2147483647",
        ),
        (
            "scenarios:\n- {scenario: no_obstacle, set: [seed=5], seeds: '0:2'}\n",
            "many.yaml:2: 'seed=5' does nothing beside seeds; leave one out",
        ),
        (
            "seeds: '0:2'\nscenarios:\n- {scenario: no_obstacle, set: [seed=5]}\n",
            "many.yaml:3: 'seed=5' does nothing beside seeds; write seeds: [5] in its place",
        ),
        ("scenarios:\n- scenario: none.yaml\n", "many.yaml:2: 'none.yaml' does not exist; name a file"),
        ("scenarios:\n- scenario: empty.yaml\n", f"empty.yaml:1: the file is empty{_NO_FILE}"),
    ],
)
def test_a_mistake_is_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, text: str, told: str) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "empty.yaml").touch()
    written(tmp_path, text)
    with pytest.raises(Findings) as raised:
        planned("many.yaml")
    assert str(raised.value) == told


def test_a_seed_that_is_set_is_refused_beside_seeds(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    written(tmp_path, f"seeds: '0:2'\n{_ENTRY}")
    with pytest.raises(Findings, match=r"^--seeds: the seed is given by --set, too; leave one out$"):
        planned("no_obstacle", ["seed=9"], range(3))
    with pytest.raises(Findings, match=r"^--set: 'seed=9' does nothing beside the seeds of many\.yaml; write --seeds"):
        planned("many.yaml", ["seed=9"])


@pytest.mark.parametrize(
    ("seeds", "told"),
    [("0:50", None), ("600:610", None), ('"5:50"', None), ("5:50", "'5:50' is 350 to some readers of YAML")],
)
def test_ranges_without_quotes(tmp_path: Path, seeds: str, told: str | None) -> None:
    """What the docs say: two numbers below 60 may be one number of base 60 to YAML."""
    file = written(tmp_path, f"seeds: {seeds}\n{_ENTRY}")
    if told is None:
        assert planned(file)
        return
    with pytest.raises(Findings, match=told):
        planned(file)


def test_whether_seeds_were_asked_for(tmp_path: Path) -> None:
    assert one_seed_each(planned("no_obstacle"))
    assert one_seed_each(planned(written(tmp_path, f"{_ENTRY}- scenario: short_obstacle\n")))
    assert not one_seed_each(planned("no_obstacle", seeds=range(2)))
    assert not one_seed_each(planned("no_obstacle", ["vary.seed=[0,1]"]))
    assert not one_seed_each(planned(written(tmp_path, "scenarios:\n- {scenario: no_obstacle, seeds: [7]}\n")))
