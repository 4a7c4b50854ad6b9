import json
from pathlib import Path

import own_leaves
import pytest
import yaml
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st
from toy_scenario import write_scenario

from regrasp.app.files.findings import Finding, Findings
from regrasp.app.files.overrides import parse_overrides
from regrasp.app.files.resources import shipped
from regrasp.app.scenario.cell_file import load_cell
from regrasp.app.scenario.load import load_scenario
from regrasp.app.scenario.references import tree_text
from regrasp.behaviors.cable.unplug import Unplug
from regrasp.interfaces.cable.cause import CableCause
from regrasp.interfaces.cable.cell import CableCell

ARMS = 1 + shipped("cell")["thesis"].read_text().splitlines().index("  arms:")  # the line of that key
METRES = "expected a number in metres, such as 0.3"
MOVES = "{type: obstacle_moves_in, obstacle: shrt, by: [0, 1, 0], when: {at: [1, 1]}}\n  - {type: jaw_opens"
SOON = "  - soon\n  - {type: jaw_opens"
SECOND = "  - {name: short, size: [1, 1, 1], position: {zero: [-2, 0, 0], earth: [-2, 0, 0]}}\n"


@pytest.fixture
def scenario(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    return write_scenario(tmp_path, monkeypatch)


def findings(*overrides: str, name: str = "mine.yaml") -> list[str]:
    with pytest.raises(Findings) as raised:
        load_scenario(name, overrides)
    return str(raised.value).splitlines()


def findings_if_any(*overrides: str) -> list[Finding]:
    """None for a scenario that loads; any other exception goes through."""
    try:
        load_scenario("mine.yaml", overrides)
    except Findings as error:
        return error.items
    return []


def changed(scenario: Path, old: str, new: str) -> None:
    text = scenario.read_text()
    assert old in text
    scenario.write_text(text.replace(old, new))


def test_a_scenario_brings_its_cell_and_tree(scenario: Path) -> None:
    loaded = load_scenario("mine.yaml")
    assert (loaded.name, loaded.tree) == ("mine", Path("tree.xml"))
    assert loaded.file.obstacles[0].position_in("zero") == (0.30, 0.14, 0.16)
    assert loaded.file.faults[0].when.model_dump()["carried"] == (0.3, 0.8)
    assert isinstance(loaded.cell, CableCell)
    assert loaded.cell.known.cable.plugged_into == "back_4"


def test_what_is_left_out_has_its_default(scenario: Path) -> None:
    scenario.write_text("description: bare\ncell: thesis\ntree: tree.xml\ngravity: earth\n")
    file = load_scenario("mine.yaml").file
    assert (file.obstacles, file.faults, file.expect.outcome, file.expect.cause) == ((), (), "success", None)
    assert (file.limits.sim_seconds, file.inputs, file.seed) == (600.0, {}, 0)


def test_overrides_change_scenario_and_cell(scenario: Path) -> None:
    before = scenario.read_text()
    loaded = load_scenario(
        "mine.yaml",
        [
            "gravity=earth",
            "obstacles.0.size=[0.1, 0.1, 0.1]",
            "inputs.tries=2",
            "expect={outcome: failure, cause: search_exhausted}",
            "cell.hidden.errors.arm_tool=0",
            "cell.known.cable.sockets.0.depth=0.02",
        ],
    )
    assert loaded.file.gravity == "earth"
    assert loaded.file.obstacles[0].size == (0.1, 0.1, 0.1)
    assert loaded.inputs == {"tries": "2"}
    assert str(loaded.file.expect.cause) == CableCause.SEARCH_EXHAUSTED
    assert isinstance(loaded.cell, CableCell)
    assert loaded.cell.hidden.errors.arm_tool == 0
    # Socket 0 is the anchor that the others are aliases of: an override holds for the one item that it names.
    assert [s.depth for s in loaded.cell.known.cable.sockets] == [0.02, 0.015, 0.015, 0.015, 0.015]
    assert scenario.read_text() == before


def test_an_override_makes_the_mappings_on_its_way(scenario: Path) -> None:
    scenario.write_text("description: bare\ncell: thesis\ntree: tree.xml\ngravity: earth\n")
    assert load_scenario("mine.yaml", ["limits.sim_seconds=2"]).file.limits.sim_seconds == 2


@pytest.mark.parametrize("name", shipped("cell"))
def test_shipped_cells_are_right(name: str) -> None:
    assert load_cell(shipped("cell")[name]).known.arms


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("gravity: zero", "grvity: zero", "mine.yaml:4: unknown key 'grvity'; did you mean 'gravity'?"),
        ("gravity: zero", "", "mine.yaml:1: key 'gravity' is missing; expected one of zero, earth"),
        ("gravity: zero", "gravity: eart", "mine.yaml:4: gravity: no 'eart'; did you mean 'earth'?"),
        ("gravity: zero", "gravity: 0", "mine.yaml:4: gravity is 0; expected one of zero, earth"),
        ("0.12, 0.18", "30 cm, 0.18", "mine.yaml:8: obstacles.0.size.1 is '30 cm'; " + METRES),
        ("0.12, 0.18", "true, 0.18", "mine.yaml:8: obstacles.0.size.1 is True; expected a number in metres"),
        ("0.12, 0.18", "'0.12', 0.18", "mine.yaml:8: obstacles.0.size.1 is '0.12'; expected a number in metres"),
        ("0.12, 0.18", "0, 0.18", "mine.yaml:8: obstacles.0.size.1 is 0; " + METRES + " (at least 0.001, at most 3)"),
        ("0.12, 0.18]", "0.12]", "mine.yaml:8: obstacles.0.size is [0.08, 0.12]; expected 3 values, each"),
        ("0.12, 0.18]", "0.12, 0.18, 1]", "mine.yaml:8: obstacles.0.size is [0.08, 0.12, 0.18, 1]; expected 3 values"),
        ("slips: 1", "slips: 1.5", "mine.yaml:18: expect.slips is 1.5; expected a whole number (at least 0"),
        ("sim_seconds: 600", "sim_seconds:", "mine.yaml:15: limits.sim_seconds is empty; expected a number in seconds"),
        ("tries: 4", "trys: 4", "mine.yaml:5: inputs.trys: unknown input 'trys'; did you mean 'tries'?"),
        ("tries: 4", "tries: many", "mine.yaml:5: inputs.tries: Retry 'again': num_failures={tries} is 'many' here"),
        ("tries: 4", "tries: '{x}'", "mine.yaml:5: inputs.tries is '{x}'; expected"),
        ("hidden: true", "hidden: yep", "mine.yaml:19: expect.hidden is 'yep'; expected true or false"),
        ("slips: 1", "cause: slipped", "mine.yaml:16: expect: a run that ends in success has no cause; write"),
        ("[0.3, 0.8]", "[0.8, 0.3]", "mine.yaml:14: faults.0.when.carried: runs backwards; put the smaller first"),
        ("jaw_opens", "jaw_open", "mine.yaml:14: faults.0.type: no 'jaw_open'; did you mean 'jaw_opens'?"),
        ("type: jaw_opens, ", "", "mine.yaml:14: faults.0.type: it is missing; there are cable_snags, camera_dark"),
        ("{type: jaw_opens, when", "{type: jaw_stuck, force_share: 1, when", "mine.yaml:14: unknown key 'force_share'"),
        ("{carried: [0.3, 0.8]}", "{}", "mine.yaml:14: faults.0.when: nothing given; give one of at, carried, node"),
        ("{carried: [0.3, 0.8]}", "{at: [1, 2], phase: lost}", "mine.yaml:14: faults.0.when: at and phase given; give"),
        ("{carried: [0.3, 0.8]}", "{phase: los}", "mine.yaml:14: faults.0.when.phase: no 'los'; did you mean 'lost'?"),
        ("{carried: [0.3, 0.8]}", "{node: setle}", "mine.yaml:14: no node 'setle' in tree.xml; did you mean 'settle'?"),
        ("{carried: [0.3, 0.8]}", "{at: [1, 2], after: [1, 2]}", "mine.yaml:14: faults.0.when: after goes with node"),
        ("seconds: 1.0}", "seconds: soon}", "mine.yaml:14: faults.0.seconds is 'soon'; expected a number in seconds"),
        ("  - {type: jaw_opens", SOON, "mine.yaml:14: faults.0 is 'soon'; expected a mapping with type: one"),
        ("{type: jaw_opens", MOVES, "mine.yaml:14: no obstacle 'shrt'; did you mean 'short'?"),
        ("cell: thesis", "cell: thesi", "mine.yaml:2: no cell named 'thesi'; did you mean 'thesis'?"),
        ("cell: thesis", "cell: gone.yaml", "mine.yaml:2: 'gone.yaml' does not exist; name a file"),
        ("cell: thesis", "cell: 3", "mine.yaml:2: cell is 3; expected text"),
        ("tree.xml", "gone.xml", "mine.yaml:3: 'gone.xml' does not exist; name a file"),
        ("tree.xml", "nowhere", "mine.yaml:3: no tree named 'nowhere'"),
        ("0.30, 0.14, 0.16", "0.48, 0.00, 0.00", "mine.yaml:10: obstacle 'short' reaches 0.022 m into back_panel"),
        ("0.30, 0.14, 0.16", "0.30, 0.14, -0.05", "mine.yaml:10: obstacle 'short' reaches 0.050 m below the floor"),
        ("0.30, 0.14, 0.16", "-0.36, 0.0, 0.3", "mine.yaml:10: obstacle 'short' reaches 0.046 m into the rear camera;"),
        ("0.30, 0.14, 0.16", "0.45, 0.15, 0.35", "mine.yaml:10: obstacle 'short' reaches 0.032 m into socket back_4"),
        ("0.30, 0.12, 0.0]", "0.0, 0.2, 0.0]", "mine.yaml:10: obstacle 'short' reaches 0.079 m into the left arm"),
        ("0.01, 0.0]", "0.01, 0.2]", "mine.yaml:10: obstacle 'short' reaches 0.040 m below the floor"),
        ("faults:", SECOND + "faults:", "mine.yaml:13: two obstacles 'short'"),
    ],
)  # fmt: skip
def test_a_mistake_is_a_finding_at_its_line(scenario: Path, old: str, new: str, expected: str) -> None:
    changed(scenario, old, new)
    assert [line for line in findings() if line.startswith(expected)]


@pytest.mark.parametrize(
    ("content", "expected"),
    [
        (b"", "mine.yaml:1: the file is empty; expected a mapping of description, cell"),
        (b"- a", "mine.yaml:1: the file is ['a']; expected a mapping of description, cell"),
        (b"a: \xff", "mine.yaml:1: byte 0xff is not UTF-8"),
        (b"a: 1\n\x89PNG\r\n\x1a\n\x00", "mine.yaml:2: byte 0x89 is not UTF-8"),
        (b"\x00\x01\x02", "mine.yaml:1: not YAML: '\\x00' is not text"),
        (b"a: [", "mine.yaml:1: not YAML"),
        (b"#" * 300_000, "mine.yaml: longer than 262144 bytes"),
    ],
)
def test_what_is_no_scenario_is_a_finding(scenario: Path, content: bytes, expected: str) -> None:
    scenario.write_bytes(content)
    assert findings()[0].startswith(expected)


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("gone.yaml", "gone.yaml: 'gone.yaml' does not exist"),
        ("folder.yaml", "folder.yaml: 'folder.yaml' is a folder"),
        ("folder", "folder: 'folder' is a folder"),
        ("nowhere", "nowhere: no scenario named 'nowhere'"),
        ("", "scenario: no scenario named ''"),
        ("nul\0.yaml", "nul\\x00.yaml: "),
        ("x" * 5000 + ".yaml", "x" * 5000 + ".yaml: "),
    ],
)
def test_a_name_without_a_file_is_a_finding(scenario: Path, name: str, expected: str) -> None:
    for folder in ("folder", "folder.yaml"):
        (scenario.parent / folder).mkdir()
    assert findings(name=name)[0].startswith(expected)


@pytest.mark.parametrize(
    ("override", "expected"),
    [
        ("limits.sim_second=3", "unknown key 'sim_second'; did you mean 'sim_seconds'?"),
        ("expect.tries=many", "expect.tries is 'many'; expected a whole number"),
        ("inputs.tries", "no key with a value; write key.path=value, such as gravity=earth"),
        ("inputs..tries=1", "no key with a value; write key.path=value"),
        ("=1", "no key with a value; write key.path=value"),
        ("obstacles.1.name=x", "no item '1' in obstacles; give a number from 0 to 0"),
        ("obstacles.x=1", "no item 'x' in obstacles; give"),
        ("markers.0=slow", "markers is empty, so it has no item to change; set the whole"),
        ("light.direction=[0, 0, 0]", "light.direction: a direction must not be zero"),
        ("gravity=1e9", "'1e9' is text to YAML, not a number; write 1.0e+9"),
        ("gravity.x=1", "gravity is a single value"),
        ("gravity=[", "not YAML"),
        ("cell.hidden.errors.arm_tol=0", "unknown key 'arm_tol'; did you mean 'arm_tool'?"),
        ("cell.known.plugged_into=back_9", "no socket 'back_9'; did you mean 'back_"),
        ("cell.known.cameras.0.mount.position.0=x", "known.cameras.0.mount.position.0 is 'x'; expected a"),
        ("cell.known.cameras.0.mount={arm: middle, offset: [0, 0, 0]}", "known.cameras.0.mount.arm: no"),
    ],
)  # fmt: skip
def test_a_wrong_override_is_a_finding(scenario: Path, override: str, expected: str) -> None:
    [finding] = findings(override)
    assert finding.startswith(f"--set {override}: {expected}")


def test_what_an_override_makes_of_a_list_is_told_at_the_list(scenario: Path) -> None:
    [finding] = findings("cell.known.arms.1.name=left")
    assert f"cells/thesis.yaml:{ARMS}: 2 arms are named 'left'; rename them" in finding


@pytest.mark.parametrize("key", ["tree", "cell"])
def test_a_path_on_the_command_line_is_taken_from_the_current_folder(
    scenario: Path, monkeypatch: pytest.MonkeyPatch, key: str
) -> None:
    """In a scenario file it is taken from that file's folder."""
    here = scenario.parent / "elsewhere"
    here.mkdir()
    monkeypatch.chdir(here)
    source = scenario.parent / "tree.xml" if key == "tree" else shipped("cell")["thesis"]
    (here / f"mine{source.suffix}").write_text(source.read_text())
    for override in (f"{key}=mine{source.suffix}", f"vary.{key}=[mine{source.suffix}]"):
        assert load_scenario("../mine.yaml", [override]).file.tree
    with pytest.raises(Findings, match=f"'gone{source.suffix}' does not exist; name a file"):
        load_scenario("../mine.yaml", [f"{key}=gone{source.suffix}"])


def test_findings_of_all_files_come_at_once(scenario: Path) -> None:
    changed(scenario, "slips: 1", "slips: -1")
    (scenario.parent / "tree.xml").write_text((scenario.parent / "tree.xml").read_text().replace("Wait", "Wiat"))
    lines = findings("expect.tries=x", "cell.hidden.step_rate=100", "nonsense")
    assert [line.split(": ")[0] for line in lines] == [
        "--set cell.hidden.step_rate=100",
        "--set expect.tries=x",
        "--set nonsense",
        "mine.yaml:18",
        "tree.xml:2",
    ]


def test_a_tree_that_names_a_socket_which_the_cell_has_not_is_a_finding_in_the_tree(
    scenario: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    own_leaves.put_in({"Unplug": Unplug}, monkeypatch.setattr)
    tree = scenario.parent / "tree.xml"
    tree.write_text(
        tree.read_text().replace('<Wait name="settle" seconds="0.1"/>', '<Unplug name="u" socket="bck_4"/>')
    )
    assert findings() == ["tree.xml:2: Unplug 'u': socket='bck_4' is unknown; did you mean 'back_4'?"]
    tree.write_text(tree.read_text().replace("bck_4", "back_4"))
    assert findings_if_any() == []


def test_a_cell_beside_the_scenario_is_found_from_elsewhere(scenario: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (scenario.parent / "my_cell.yaml").write_text(shipped("cell")["thesis"].read_text())
    changed(scenario, "cell: thesis", "cell: my_cell.yaml")
    monkeypatch.chdir(scenario.parent.parent)
    assert load_scenario(str(scenario)).tree == scenario.parent / "tree.xml"


def test_a_key_that_may_mean_either_of_two_that_are_missing_is_told_once(scenario: Path) -> None:
    changed(scenario, "type: jaw_opens, when", "type#when")
    assert sum("unknown key 'type#when'; did you mean " in finding for finding in findings()) == 1


_TOKENS = st.sampled_from(
    ["", "\n", " ", "  ", ":", "- ", "[", "]", "{", "}", "&a ", "*a", "<<: *a", "!!str ", "'", '"', "#", "1e3", ".nan",
     "-1", "99999", "null", "true", "\t", "\x00", "\\U99999999", "---\n", "%", "|", ">", "?", "ä", "0x1f"]
)  # fmt: skip


@settings(max_examples=30, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    edits=st.lists(
        st.tuples(st.floats(0, 1), st.integers(0, 12), _TOKENS | st.text(max_size=5)), min_size=1, max_size=4
    )
)
def test_a_damaged_file_gives_findings_or_loads(scenario: Path, edits: list[tuple[float, int, str]]) -> None:
    original = scenario.read_text(encoding="utf-8")
    text = original
    for share, cut, token in edits:
        at = int(share * len(text))
        text = text[:at] + token + text[at + cut :]
    scenario.write_bytes(text.encode("utf-8", "surrogatepass"))
    try:
        found = findings_if_any()
    finally:
        scenario.write_text(original, encoding="utf-8")
    assert all(f.line >= 0 and str(f).isprintable() for f in found)


_values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
    max_leaves=6,
)


_PATHS = """gravity obstacles obstacles.0 obstacles.0.size obstacles.0.position.zero.2 faults.0 expect expect.cause cell
tree cell.known cell.known.cable.clip cell.known.cameras.0.mount cell.known.cable.sockets.0.axis cell.known.boxes.0"""


@settings(max_examples=30, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(path=st.sampled_from(_PATHS.split()), value=_values)
@example(path="cell.known.cable.sockets.0.axis", value=[1.0, 0, 0])
@example(path="cell.known.cable.sockets.0.axis", value=[0, 0, -1.0])
@example(path="cell.known.cable.clip.axis", value=[0, 0, 1.0])
@example(path="cell.hidden.cable.anchor_axis", value=[0, 0, 1.0])
def test_any_value_anywhere_gives_findings_or_loads(scenario: Path, path: str, value: object) -> None:
    for text in (json.dumps(value), yaml.safe_dump(value)):
        assert all(f.line >= 0 and str(f).isprintable() for f in findings_if_any(f"{path}={text}"))


def test_a_number_that_cannot_be_read_hides_nothing_else(scenario: Path) -> None:
    changed(scenario, "0.12, 0.18", ".nan, 0.18")
    changed(scenario, "slips: 1", "slips: 1e9")
    changed(scenario, "hidden: true", "hiden: true")
    assert findings() == [
        "mine.yaml:8: '.nan' is no plain finite number; write it such as 1000, 0.3 or 1.0e+3",
        "mine.yaml:18: '1e9' is text to YAML, not a number; write 1.0e+9",
        "mine.yaml:19: unknown key 'hiden'; did you mean 'hidden'?",
    ]


def test_the_first_item_of_a_list_that_is_not_there_blames_the_command_line(scenario: Path) -> None:
    scenario.write_text("description: bare\ncell: thesis\ntree: tree.xml\ngravity: earth\n")
    told = "obstacles is empty, so it has no item to change; set the whole list, obstacles=[...]"
    assert findings("obstacles.0.size=[1, 1, 1]") == [f"--set obstacles.0.size=[1, 1, 1]: {told}"]
    assert findings("obstacles=[]", "obstacles.0.yaw_deg=1") == [f"--set obstacles.0.yaw_deg=1: {told}"]


def test_a_scenario_s_light_takes_the_place_of_the_cell_s(scenario: Path) -> None:
    before = load_scenario("mine.yaml").lit_cell
    assert before == load_scenario("mine.yaml").cell
    cell = load_scenario("mine.yaml", ["light={brightness: 0.5, ambient: 0.2, direction: [0, 0, 1]}"]).lit_cell
    light = cell.hidden.light
    assert light.ambient == pytest.approx(0.1)
    assert list(light.direction) == [0, 0, 1]
    assert light.diffuse == pytest.approx(0.5 * before.hidden.light.diffuse)
    assert light.brightness_jitter == before.hidden.light.brightness_jitter
    assert cell.known == before.known


def test_inputs_reach_the_tree_as_a_tree_file_writes_them(scenario: Path) -> None:
    inputs = load_scenario("mine.yaml", ["inputs.tries=3"]).inputs
    assert inputs == {"tries": "3"}
    assert (tree_text(True), tree_text(0.25), tree_text("rear")) == ("true", "0.25", "rear")


def test_of_a_cell_that_is_no_mapping_that_alone_is_told(tmp_path: Path) -> None:
    (tmp_path / "cell.yaml").write_text("- 1\n- 2\n")
    assignments, _ = parse_overrides(["hidden.cable.stiffness.zero=0.005"])
    with pytest.raises(Findings) as caught:
        load_cell(tmp_path / "cell.yaml", assignments)
    assert len(caught.value.items) == 1
    assert "expected a mapping" in caught.value.items[0].message


def test_of_an_empty_file_one_thing_is_told(scenario: Path) -> None:
    scenario.write_text("")
    assert len(findings()) == 1


def test_after_an_unknown_name_a_few_are_named_and_how_to_see_all(scenario: Path) -> None:
    [told] = findings(name="xyzzy")
    assert told.startswith(
        "xyzzy: no scenario named 'xyzzy'; the shipped ones are no_obstacle, printer_door, printer_grasp, printer_p"
    )
    assert "regrasp scenarios list shows" in told
    assert len(told) < 250
