"""What recovery.xml does, whatever its leaves meet: the leaves are scripted, and a table shows the whole run.

R running, S success, F failure, X stopped from above, a dot where a leaf was not visited.
"""

from collections.abc import Callable
from textwrap import dedent

import pytest
from py_trees.common import Status

from regrasp.trees.scripted import ScriptedTree

# After the first try the hand holds nothing; a safe stop fails by design.
USUAL = {"Holding": "success, failure", "SafeStop": "2 failure"}
Run = Callable[..., ScriptedTree]


@pytest.fixture
def run(scripted_tree: Callable[..., ScriptedTree]) -> Run:
    """Runs the recovery tree to its end on these scripts, `tries` times at most."""

    def make(tries: int = 5, **script: str) -> ScriptedTree:
        tree = scripted_tree("recovery", USUAL | script, inputs={"tries": str(tries)})
        tree.run()
        return tree

    return make


def expect(tree: ScriptedTree, status: Status, table: str) -> None:
    assert tree.table() == dedent(table).strip("\n")
    assert tree.status is status
    assert tree.running == []


def test_undisturbed_it_goes_straight_to_the_clip_and_the_watch_ends_with_the_insertion(run: Run) -> None:
    tree = run(StartUp="2 success", Unplug="3 success", Carry="3 success", Insert="2 success")
    table = """
        tick           1   5
        recovery       RRRRRRS
        use_technique  S......
        start_up       RS.....
        unplug         .RRS...
        holding        ...S...
        monitor        ...SSSS
        detect_slip    ...RRRX
        carry          ...RRS.
        insert         .....RS
        let_go         ......S
        look_at_stow   ......S
    """
    expect(tree, Status.SUCCESS, table)


def test_a_slip_stops_the_carrying_at_once_and_the_next_try_recovers_and_delivers(run: Run) -> None:
    tree = run(
        DetectSlip="3 failure, running", Carry="9 success, 3 success", MakeRoom="2 success", WaitUntilStill="2 success"
    )
    table = """
        tick              1   5
        recovery          RRRRRRRS
        use_technique     S.......
        start_up          S.......
        unplug            S.......
        holding           S..F....
        make_room         ...RS...
        wait_until_still  ....RS..
        check_cameras     .....S..
        look_closer       .....S..
        regrasp           .....S..
        monitor           SSS..SSS
        detect_slip       RRF..RRX
        carry             RRX..RRS
        insert            .......S
        let_go            .......S
        look_at_stow      .......S
    """
    expect(tree, Status.SUCCESS, table)


def test_what_the_rear_camera_does_not_see_is_searched(run: Run) -> None:
    tree = run(
        DetectSlip="2 failure, running",
        Carry="9 success, 2 success",
        CheckCameras="2 failure",
        SpiralSearch="4 success",
    )
    table = """
        tick              1   5
        recovery          RRRRRRRS
        use_technique     S.......
        start_up          S.......
        unplug            S.......
        holding           S.F.....
        make_room         ..S.....
        wait_until_still  ..S.....
        check_cameras     ..RF....
        spiral_search     ...RRRS.
        look_closer       ......S.
        regrasp           ......S.
        monitor           SS....SS
        detect_slip       RF....RX
        carry             RX....RS
        insert            .......S
        let_go            .......S
        look_at_stow      .......S
    """
    expect(tree, Status.SUCCESS, table)


def test_a_second_slip_is_recovered_like_the_first(run: Run) -> None:
    tree = run(
        DetectSlip="2 failure, 3 failure, running",
        Carry="9 success, 9 success, 2 success",
        CheckCameras="success, failure",
    )
    table = """
        tick              1   5
        recovery          RRRRRRS
        use_technique     S......
        start_up          S......
        unplug            S......
        holding           S.F..F.
        make_room         ..S..S.
        wait_until_still  ..S..S.
        check_cameras     ..S..F.
        spiral_search     .....S.
        look_closer       ..S..S.
        regrasp           ..S..S.
        monitor           SSSSSSS
        detect_slip       RFRRFRX
        carry             RXRRXRS
        insert            ......S
        let_go            ......S
        look_at_stow      ......S
    """
    expect(tree, Status.SUCCESS, table)


def test_a_slip_in_the_tick_in_which_the_insertion_ends_counts_as_a_slip(run: Run) -> None:
    tree = run(DetectSlip="3 failure, running", Insert="3 success, 2 success")
    table = """
        tick              1   5
        recovery          RRRRS
        use_technique     S....
        start_up          S....
        unplug            S....
        holding           S..F.
        make_room         ...S.
        wait_until_still  ...S.
        check_cameras     ...S.
        look_closer       ...S.
        regrasp           ...S.
        monitor           SSSSS
        detect_slip       RRFRX
        carry             S..S.
        insert            RRSRS
        let_go            ....S
        look_at_stow      ....S
    """
    expect(tree, Status.SUCCESS, table)


def test_an_end_that_is_not_in_the_clip_after_all_is_fetched_again(run: Run) -> None:
    tree = run(LookAtStow="2 failure, success")
    table = """
        tick              1
        recovery          RRS
        use_technique     S..
        start_up          S..
        unplug            S..
        holding           S.F
        make_room         ..S
        wait_until_still  ..S
        check_cameras     ..S
        look_closer       ..S
        regrasp           ..S
        monitor           S.S
        detect_slip       X.X
        carry             S.S
        insert            S.S
        let_go            S.S
        look_at_stow      RFS
    """
    expect(tree, Status.SUCCESS, table)


def test_a_hand_that_closed_on_nothing_recovers_anew_instead_of_carrying(run: Run) -> None:
    tree = run(DetectSlip="failure, running", Carry="9 success, 2 success", Regrasp="2 failure, success")
    table = """
        tick              1   5
        recovery          RRRRS
        use_technique     S....
        start_up          S....
        unplug            S....
        holding           SF.F.
        make_room         .S.S.
        wait_until_still  .S.S.
        check_cameras     .S.S.
        look_closer       .S.S.
        regrasp           .RFS.
        monitor           S..SS
        detect_slip       F..RX
        carry             X..RS
        insert            ....S
        let_go            ....S
        look_at_stow      ....S
    """
    expect(tree, Status.SUCCESS, table)


def test_what_is_found_nowhere_is_searched_until_the_tries_are_used_up_then_all_stops(run: Run) -> None:
    tree = run(DetectSlip="2 failure", Carry="9 success", CheckCameras="failure", SpiralSearch="2 failure")
    table = """
        tick              1   5    10
        recovery          RRRRRRRRRRF
        use_technique     S..........
        start_up          S..........
        unplug            S..........
        holding           S.F.F.F.F..
        make_room         ..S.S.S.S..
        wait_until_still  ..S.S.S.S..
        check_cameras     ..F.F.F.F..
        spiral_search     ..RFRFRFRF.
        monitor           SS.........
        detect_slip       RF.........
        carry             RX.........
        safe_stop         .........RF
    """
    expect(tree, Status.FAILURE, table)


def test_as_many_slips_as_tries_end_in_a_safe_stop(run: Run) -> None:
    tree = run(tries=3, DetectSlip="2 failure", Carry="9 success")
    table = """
        tick              1   5
        recovery          RRRRRRF
        use_technique     S......
        start_up          S......
        unplug            S......
        holding           S.F.F..
        make_room         ..S.S..
        wait_until_still  ..S.S..
        check_cameras     ..S.S..
        look_closer       ..S.S..
        regrasp           ..S.S..
        monitor           SSSSSS.
        detect_slip       RFRFRF.
        carry             RXRXRX.
        safe_stop         .....RF
    """
    expect(tree, Status.FAILURE, table)


def test_a_cable_that_never_hangs_still_is_not_looked_for(run: Run) -> None:
    tree = run(tries=2, Carry="failure", WaitUntilStill="2 failure")
    table = """
        tick              1
        recovery          RRRF
        use_technique     S...
        start_up          S...
        unplug            S...
        holding           SF..
        make_room         .S..
        wait_until_still  .RF.
        monitor           S...
        detect_slip       X...
        carry             F...
        safe_stop         ..RF
    """
    expect(tree, Status.FAILURE, table)


@pytest.mark.parametrize("leaf", ["StartUp", "Unplug"])
def test_before_the_first_try_a_failure_is_not_retried(run: Run, leaf: str) -> None:
    tree = run(**{leaf: "2 failure"})
    assert tree.status is Status.FAILURE
    assert (tree.entered("safe_stop"), tree.entered("holding"), tree.ticks) == (1, 0, 3)


@pytest.mark.parametrize("leaf", ["MakeRoom", "LookCloser", "Regrasp", "Carry", "Insert", "LetGo", "LookAtStow"])
def test_one_failure_of_any_leaf_of_a_try_costs_one_try(run: Run, leaf: str) -> None:
    tree = run(Holding="failure", **{leaf: "failure, success"})
    assert tree.status is Status.SUCCESS
    assert (tree.entered("holding"), tree.entered("unplug"), tree.entered("safe_stop")) == (2, 1, 0)


def test_the_watch_is_kept_at_every_tick_of_carrying_and_inserting_and_only_then(run: Run) -> None:
    tree = run(Carry="7 success", Insert="5 success", LetGo="3 success", LookAtStow="2 success")
    carried, watched = (tree.table(leaf).splitlines()[1].split()[1] for leaf in ("watched", "monitor"))
    assert carried == "RRRRRRRRRRS..."
    assert watched == "SSSSSSSSSSS..."


@pytest.mark.parametrize(
    ("tick", "stopped"), [(1, ["unplug"]), (4, ["detect_slip", "carry"]), (6, ["detect_slip", "insert"])]
)
def test_cancelled_it_stops_what_ran_and_begins_anew_when_ticked_again(
    scripted_tree: Callable[..., ScriptedTree], tick: int, stopped: list[str]
) -> None:
    tree = scripted_tree("recovery", USUAL | {"Unplug": "3 success", "Carry": "4 success", "Insert": "2 success"})
    tree.cancel_at(tick)
    assert [path.rsplit("/", 1)[1] for path, leaf in tree.leaves.items() if leaf.stopped] == stopped
    assert tree.running == []
    assert tree.tick() is Status.RUNNING
    assert tree.entered("start_up") == 2
