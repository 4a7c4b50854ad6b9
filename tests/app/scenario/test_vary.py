from math import prod
from pathlib import Path

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st
from toy_scenario import SCENARIO, write_scenario

from regrasp.app.files.findings import Findings
from regrasp.app.files.yaml_lines import parse
from regrasp.app.records.folders import folder_name
from regrasp.app.scenario.load import case_names, cases, load_scenario
from regrasp.app.scenario.vary import axes, expand


@pytest.fixture(autouse=True)
def scenario(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    return write_scenario(tmp_path, monkeypatch)


def vary(path: Path, text: str) -> None:
    path.write_text(f"{SCENARIO}vary:\n{text}")


def findings(*overrides: str) -> list[str]:
    with pytest.raises(Findings) as raised:
        cases("mine.yaml", overrides)
    return str(raised.value).splitlines()


def test_every_combination_is_a_case_with_its_values(scenario: Path) -> None:
    vary(scenario, "  gravity: [earth, zero]\n  obstacles.0.size.2: [0.16, 0.18]\n  seed: '3:5'\n")
    made = {c.case: (c.file.gravity, c.file.obstacles[0].size[2], c.file.seed) for c in cases("mine.yaml")}
    assert made == {
        f"gravity={g},obstacles.0.size.2={z},seed={s}": (g, z, s)
        for g in ("earth", "zero")
        for z in (0.16, 0.18)
        for s in (3, 4)
    }
    assert case_names("mine.yaml") == list(made)


def test_a_case_is_chosen_by_its_name_and_the_first_values_are_the_default(scenario: Path) -> None:
    vary(scenario, "  gravity: [earth, zero]\n")
    assert load_scenario("mine.yaml").file.gravity == "earth"
    assert load_scenario("mine.yaml", case="gravity=zero").file.gravity == "zero"
    with pytest.raises(Findings, match=r"^--case: no case 'gravity=zer'; did you mean 'gravity=zero'\?$"):
        load_scenario("mine.yaml", case="gravity=zer")


def test_without_vary_the_only_case_is_called_default() -> None:
    [case] = cases("mine.yaml")
    assert (case.case, case.title) == ("default", "mine")


def test_evenly_spaced_numbers_have_both_ends_and_short_names(scenario: Path) -> None:
    vary(scenario, "  limits.sim_seconds: {from: 0.1, to: 0.5, steps: 5}\n  inputs.tries: {from: 1, to: 3, steps: 2}\n")
    assert case_names("mine.yaml") == [
        f"limits.sim_seconds={s},inputs.tries={n}" for s in (0.1, 0.2, 0.3, 0.4, 0.5) for n in (1, 3)
    ]
    assert cases("mine.yaml")[5].inputs == {"tries": "3"}


def test_values_of_the_cell_and_whole_lists_vary_too(scenario: Path) -> None:
    vary(
        scenario, "  cell.hidden.errors.arm_tool: [0.0, 0.004]\n  obstacles: [[], [{<<: &a {name: a, size: [1, 1, 1]},"
    )
    vary(scenario, "  cell.hidden.errors.arm_tool: [0.0, 0.004]\n  faults.0.seconds: [1, 2.5]\n  faults: [[]]\n")
    made = cases("mine.yaml")
    assert [c.cell.hidden.errors.arm_tool for c in made] == [0.0, 0.0, 0.004, 0.004]
    assert made[0].case == "cell.hidden.errors.arm_tool=0.0,faults.0.seconds=1,faults=[]"


def test_set_fixes_a_varied_key_and_wins_over_what_varies(scenario: Path) -> None:
    vary(scenario, "  gravity: [zero, earth]\n  obstacles.0.size.2: [0.16, 0.18]\n")
    assert case_names("mine.yaml", ["gravity=earth"]) == [f"gravity=earth,obstacles.0.size.2={z}" for z in (0.16, 0.18)]
    assert case_names("mine.yaml", ["obstacles.0.size=[0.1, 0.1, 0.1]"]) == ["gravity=zero", "gravity=earth"]
    sizes = [c.file.obstacles[0].size for c in cases("mine.yaml", ["obstacles.0.size=[0.1, 0.1, 0.1]"])]
    assert sizes == [(0.1, 0.1, 0.1)] * 2
    assert case_names("mine.yaml", ["vary={}"]) == ["default"]
    assert len(case_names("mine.yaml", ['vary.seed="0:5"'])) == 20
    assert len(case_names("mine.yaml", ["vary.obstacles.0.size.2=[0.15]"])) == 2


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("gravty: [zero]", "mine.yaml:22: unknown key 'gravty'; did you mean 'gravity'?"),
        ("gravity: [mars]", "mine.yaml:22: gravity: no 'mars'; there are earth, zero"),
        ("gravity: [zero, mars]", "mine.yaml:22: gravity: no 'mars'; there are earth, zero (case gravity=mars)"),
        ("gravity: [zero, zero]", "mine.yaml:22: vary: gravity takes zero twice; keep one"),
        ("gravity: []", "mine.yaml:22: vary.gravity is []; expected a list of at least 1 value, or text such as '0:5'"),
        ("gravity: zero", "mine.yaml:22: vary.gravity is 'zero'; expected a list of at least 1 value, or text such as"),
        ("seed: '5:5'", "mine.yaml:22: vary.seed: '5:5' holds no number; write A:B with A below B, such as '0:5'"),
        ("seed: 1:5", "mine.yaml:22: '1:5' is 65 to some readers of YAML and not to others; write 65, or quotes"),
        ("seed: '0:10001'", "mine.yaml:21: vary makes more than 10000 cases; shorten a list or a range"),
        ("seed: {from: 0, to: 1}", "mine.yaml:22: key 'steps' is missing in vary.seed; expected a whole number"),
        ("faults.1.seconds: [1]", "mine.yaml:22: vary: faults.1.seconds: no item '1' in faults; give a number from 0"),
        ("cell.hiden.x: [1]", "mine.yaml:22: unknown key 'hiden'; did you mean 'hidden'?"),
        ("vary: [1]", "mine.yaml:22: vary is 1; expected a mapping"),
    ],
)  # fmt: skip
def test_a_mistake_is_a_finding_at_its_line(scenario: Path, text: str, expected: str) -> None:
    vary(scenario, f"  {text}\n")
    assert [line for line in findings() if line.startswith(expected)]


def test_what_is_wrong_in_all_cases_is_told_once_beside_what_is_in_some(scenario: Path) -> None:
    vary(scenario, "  seed: '0:3'\n  obstacles.0.size.2: [0.2, 0.9]\n")
    scenario.write_text(scenario.read_text().replace("tries: 4", "trys: 4"))
    wrong, *placed = findings()
    assert wrong == "mine.yaml:5: inputs.trys: unknown input 'trys'; did you mean 'tries'?"
    assert placed
    assert all(
        f.endswith("; move it, or jitter it less (case seed=0,obstacles.0.size.2=0.9 and 2 more)") for f in placed
    )


_scalars = st.none() | st.booleans() | st.integers(-99, 99) | st.text("ab=,/. ü", max_size=4)
_lists = st.lists(_scalars | st.lists(_scalars, max_size=2), min_size=1, max_size=4, unique_by=lambda v: str(v).lower())


@given(st.dictionaries(st.text("abc", min_size=1), _lists, max_size=3))
def test_names_are_as_many_as_combinations_and_make_folders_of_their_own(lists: dict[str, list[object]]) -> None:
    document = parse(yaml.safe_dump({"vary": lists}), "f.yaml")
    found, wrong = axes(document, [])
    assert wrong == []
    names = [name for name, _ in expand(found)]
    assert len(names) == prod(map(len, lists.values()))
    folders = {folder_name(name) for name in set(names)}
    assert len(folders) == len(set(names))
    assert all("/" not in f and f not in (".", "..", "") and len(f) <= 120 for f in folders)


@pytest.mark.parametrize(
    ("old", "new", "text", "expected"),
    [
        ("gravity: zero", "gravity: mars", "gravity: [zero]", ["4: gravity: no 'mars'; there are earth, zero"]),
        ("gravity: zero", "", "gravity: [zero]", []),
        ("gravity: zero", "", "gravity: []", ["22: vary.gravity is []; expected"]),
        ("gravity: zero", "", "seed: [1]", ["1: key 'gravity' is missing; expected one of zero, earth"]),
        ("tries: 4", "tries: many", "inputs.tries: [1]", ["5: inputs.tries: Retry 'again': num_failures={tries}"]),
        ("slips: 1", "cause: slippd", "expect.outcome: [failure]", ["18: expect.cause: no 'slippd'"]),
        ("slips: 1", "cause: arm_failed", "expect.outcome: [failure]", []),
        ("limits: {sim_seconds: 600}", "limits: 3", "limits.sim_seconds: [1]", ["15: limits is 3; expected a mapping"]),
        ("type: jaw_opens,", "type: camera_dark,", "faults.0.camera: [rear]", ["14: key 'camera' is missing in f"]),
        ("gravity: zero", "gravity: 1", "seed: [1e9, 2.5]", ["4: gravity is 1", "22: '1e9' is", "22: seed is 2.5"]),
    ],
)  # fmt: skip
def test_the_file_is_right_without_vary_too_but_for_keys_that_only_vary_gives(
    scenario: Path, old: str, new: str, text: str, expected: list[str]
) -> None:
    vary(scenario, f"  {text}\n")
    scenario.write_text(scenario.read_text().replace(old, new))
    found = findings() if expected else [str(len(cases("mine.yaml")))]
    for line, start in zip(found, expected or ["1"], strict=True):
        assert line.removeprefix("mine.yaml:").startswith(start)


def test_too_many_cases_hide_no_value_that_is_wrong(scenario: Path) -> None:
    vary(scenario, "  seed: '0:9999999999'\n  gravity: [zero, mars]\n  expect.tries: [1, 200]\n")
    assert [line.split(" (case ")[0].split("; ")[0] for line in findings()] == [
        "mine.yaml:21: vary makes more than 10000 cases",
        "mine.yaml:22: seed is 9999999998",
        "mine.yaml:23: gravity: no 'mars'",
        "mine.yaml:24: expect.tries is 200",
    ]


def test_a_finding_stands_at_its_own_value_and_names_the_case(scenario: Path) -> None:
    vary(scenario, "  inputs.tries:\n    - 2\n    - three\n  seed: [1, 2]\n")
    [finding] = findings()
    assert finding.startswith("mine.yaml:24: inputs.tries: Retry 'again': num_failures={tries} is 'three' here")
    assert finding.endswith("(case inputs.tries=three,seed=1 and 1 more)")


def test_the_command_line_and_the_file_are_told_of_together(scenario: Path) -> None:
    scenario.write_text("a: [")
    assert [line.split(": ")[0] for line in findings("nonsense")] == ["--set nonsense", "mine.yaml:1"]
