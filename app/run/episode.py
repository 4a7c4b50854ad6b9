"""One run: the loop that ticks the tree, how it can end, and its result."""

import gc
import traceback
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import py_trees
from py_trees.common import Status

from regrasp.app.interrupts import WallLimit, raise_if_swallowed
from regrasp.app.records.record import Progress, Record
from regrasp.app.records.result import Link, Outcome, Result
from regrasp.app.records.signals import SignalWriter
from regrasp.app.run.compose import Episode, assemble, build_world
from regrasp.app.run.fault_injection import EnteredNodes, FaultLog
from regrasp.app.run.film import Film
from regrasp.app.run.observers import Observers
from regrasp.app.run.pictures import Pictures
from regrasp.app.run.signals import engine_signals
from regrasp.app.run.tick_log import TickLog, active_leaf, note_leaf_at_work, running_leaf
from regrasp.app.scenario.copies import copies
from regrasp.app.scenario.load import Scenario
from regrasp.app.scenario.scene_draw import drawn
from regrasp.app.task.expectation import Expectation
from regrasp.app.task.signals import SignalGroup
from regrasp.behaviors.keys import causes
from regrasp.behaviors.services import Services
from regrasp.interfaces.cause import Cause, CauseCode
from regrasp.interfaces.devices import TICK
from regrasp.interfaces.wall_time import WallTime, counts_as, measured
from regrasp.sim.render.renderer import RendererName
from regrasp.trees import in_tree_order, node_paths

STOP_SECONDS = 0.3  # simulated: after a stop both arms must be at rest within this time (the specification)


@dataclass
class Ending:
    """How a run ended and what decided it. `chain`: the nodes from the root down to the one that decided."""

    outcome: Outcome
    cause: Cause | None = None
    chain: tuple[Link, ...] | None = None
    traceback: str | None = None


def run_episode(
    scenario: Scenario,
    out: Path | None,
    *,
    seed: int,
    video: bool = False,
    pictures: bool = False,
    gui: bool = False,
    renderer: RendererName = "software",
    observers: Observers = Observers(),  # noqa: B008 - it does not change
) -> Result:
    """Run a scenario to its end and leave its record in the folder `out` (None: nowhere).

    `pictures`: the record has the cameras' frames at events, too. A KeyboardInterrupt, inside a leaf or from an
    observer, ends the run cleanly. An exception inside a leaf ends it with the cause `internal_error`, and its
    traceback goes into the record.

    Raises `Findings` if the scenario leaves its scene to the seed, and none can be solved.
    """
    with (
        measured("start") as wall,
        Record(
            out,
            scenario.name,
            seed,
            scenario.case,
            copies((scene := drawn(scenario, seed)).scenario, seed),
            scenario.file.TASK,
        ) as record,
    ):
        scenario = scene.scenario
        world = build_world(scenario, seed, renderer, gui)
        try:
            key_frames = Pictures(out if pictures else None, world)

            def on_event(values: Mapping[str, Any]) -> None:
                key_frames.note(values)
                observers.event(values)

            log = record.logger(world.now, on_event)
            log.info(
                "begin",
                scenario=scenario.name,
                task=scenario.file.TASK,
                case=scenario.case,
                seed=seed,
                gravity=scenario.file.gravity,
                cell=scenario.file.cell,
                tree=scenario.file.tree,
                inputs=scenario.file.inputs,
                limits=scenario.file.limits.model_dump(),
                overrides=[o for o in scenario.overrides if not o.startswith("seed=")],
                renderer=world.renderer.name,
                renderer_device=world.renderer.device,
                **({} if scene.thrown_away is None else {"thrown_away": scene.thrown_away}),
            )
            episode = assemble(scenario, world, seed, log)
            observers.assembled(episode)
            ticks = TickLog(episode.tree.root, record.ticks, world.now)
            rows = None if out is None else SignalWriter(record.signals, _signals(episode), 1 / TICK)
            faults = [EnteredNodes(episode.tree.root, world.note_entered), FaultLog(world.faults, log)]
            episode.tree.visitors += [ticks, episode.attempts, *faults]
            note_leaf_at_work(episode.tree, lambda node: record.at_work(world.now(), node))
            with Film(out / "video.mp4" if video and out else None, world) as film, _garbage_of_the_run_alone():
                wall.switch("tree")

                def on_tick(seconds: float, leaf: str) -> None:
                    _noted(rows, key_frames, episode.services)
                    observers.tick(seconds, leaf)

                ending = _run(episode, scenario, film, on_tick, log, wall)
                wall.switch("film" if video else "record")
            ticks.finalise()
            episode.attempts.finalise()
            result = _result(episode, scenario, seed, ending, wall, log)
            result = replace(result, thrown_away=scene.thrown_away)
            peaks = {pair: round(force, 2) for pair, force in world.contact_peaks.items()}  # N
            log.info("end", outcome=result.outcome, succeeded=result.succeeded, contact_peaks=peaks)
            record.finish(result)
        finally:
            world.close()
    return result


@contextmanager
def _garbage_of_the_run_alone() -> Iterator[None]:
    """Keep Python's garbage collector from searching all that exists already, which takes 0.1 s each time.

    Afterwards nothing is kept from it, not even what a caller had frozen.
    """
    gc.freeze()
    try:
        yield
    finally:
        gc.unfreeze()


def _signals(episode: Episode) -> list[SignalGroup]:
    of_task = episode.task.signals()(episode.world, episode.services)
    return [*engine_signals(episode.world, episode.services), *of_task]


@counts_as("record")
def _noted(rows: SignalWriter | None, key_frames: Pictures, services: Services) -> None:
    """After a tick: what the record keeps of it besides its logs."""
    if rows is not None:
        rows.sample()
    key_frames.take(services.perception.outlines)


def _run(episode: Episode, scenario: Scenario, film: Film, on_tick: Progress, log: Any, wall: WallTime) -> Ending:
    """Tick until the tree ends, the time limit is reached or somebody interrupts; then stop the arms."""
    root = episode.tree.root
    try:
        ending = _loop(episode, scenario, film, on_tick, wall)
        film.finish()
    except KeyboardInterrupt as stop:
        ending = _stopped(episode, stop)
    except Exception as error:
        ending = _broken(episode, error, log)
    try:
        _stop(root)
    except Exception as error:
        ending = ending if ending.outcome == "internal_error" else _broken(episode, error, log)
    finally:
        episode.services.motion.stop()
        episode.world.advance(STOP_SECONDS)
    return ending


def _loop(episode: Episode, scenario: Scenario, film: Film, on_tick: Progress, wall: WallTime) -> Ending:
    world, root, attempts = episode.world, episode.tree.root, episode.attempts
    limit = scenario.file.limits.sim_seconds
    episode.tree.setup(services=episode.services)
    wall.lap(counts=False)
    while world.now() < limit:
        episode.tree.tick()
        episode.judge.observe(world.now())
        leaf = active_leaf(root)
        for pair, force in episode.judge.new_touches():
            node = _path(running_leaf(root), root)
            episode.services.log.warning("unintended touch", node=node, what=pair, force=round(force, 1))
        film.show(leaf)
        on_tick(world.now(), leaf)
        raise_if_swallowed()
        if root.status is Status.SUCCESS:
            return Ending("success")
        if root.status is Status.FAILURE:
            cause = attempts.cause() or next(reversed(causes()), None)
            return Ending("failure", cause, attempts.failed_chain())
        world.advance(TICK)
        wall.lap()
    message = f"not done after {limit:g} simulated seconds"
    cause = Cause(CauseCode.TIME_LIMIT, message, _path(running_leaf(root), root))
    return Ending("time_limit", cause, _unfinished(episode))


def _stopped(episode: Episode, stop: KeyboardInterrupt) -> Ending:
    """The ending by a stop from outside. If it came inside a leaf, the cause names the leaf."""
    root, seconds = episode.tree.root, episode.world.now()
    inside = _raising(stop, root)
    is_limit = isinstance(stop, WallLimit)
    code = CauseCode.WALL_LIMIT if is_limit else CauseCode.INTERRUPTED
    by = "at the limit of wall time" if is_limit else "from outside"
    where = " in the middle of a tick" if inside else ""
    message = f"stopped {by}{where}, after {seconds:.2f} simulated seconds"
    cause = Cause(code, message, _path(inside or running_leaf(root), root))
    chain = _unfinished(episode, inside)
    if inside is not None and not inside.children:
        episode.attempts.raised(inside, cause)
    return Ending("wall_limit" if is_limit else "interrupted", cause, chain)


def _unfinished(episode: Episode, leaf: py_trees.behaviour.Behaviour | None = None) -> tuple[Link, ...] | None:
    """The chain down to the leaf that the end of the run cut short, by default the RUNNING one."""
    return episode.attempts.chain_to(leaf or running_leaf(episode.tree.root), "was running", "was still running")


def _broken(episode: Episode, error: Exception, log: Any) -> Ending:
    """The ending by an exception in a tick: of a leaf, or of the judge that watches."""
    node = _raising(error, episode.tree.root)
    cause = Cause(CauseCode.INTERNAL_ERROR, f"{type(error).__name__}: {error}", _path(node, episode.tree.root))
    log.error("exception in a tick", node=cause.node, exc_info=error)
    chain = episode.attempts.chain_to(node, "raised", f"raised {cause.message}")
    if node is not None and not node.children:
        episode.attempts.raised(node, cause)
    return Ending("internal_error", cause, chain, "".join(traceback.format_exception(error)))


def _stop(root: py_trees.behaviour.Behaviour) -> None:
    """Stop all RUNNING nodes, even if some raise in `terminate`; then raise the first of these exceptions."""
    first: Exception | None = None
    for node in in_tree_order(root):
        while node.status is Status.RUNNING:
            try:
                node.stop(Status.INVALID)
            except Exception as error:
                first = first or error
                raiser = _raising(error, node)
                (raiser if raiser and raiser.status is not Status.INVALID else node).status = Status.INVALID
    if first is not None:
        raise first


def _path(node: py_trees.behaviour.Behaviour | None, root: py_trees.behaviour.Behaviour) -> str:
    """The tree path of a node; '' for None."""
    return "" if node is None else node_paths(root)[node.id]


def _raising(error: BaseException, root: py_trees.behaviour.Behaviour) -> py_trees.behaviour.Behaviour | None:
    """The innermost node of the tree that an exception came through."""
    nodes = {id(node): node for node in in_tree_order(root)}
    found, trace = None, error.__traceback__
    while trace is not None:
        found = nodes.get(id(trace.tb_frame.f_locals.get("self")), found)
        trace = trace.tb_next
    return found


def _result(episode: Episode, scenario: Scenario, seed: int, ending: Ending, wall: WallTime, log: Any) -> Result:
    wall.switch("record")
    seconds = sum(wall.seconds.values())
    judge, task = episode.judge, episode.task
    expectations: tuple[Expectation, ...] = ()
    measured, belief = dict[str, Any](), None
    try:
        expectations = judge.expectations(ending.outcome, ending.cause.code if ending.cause else None)
        measured, belief = judge.measured(), task.belief()(episode.services)
    except Exception as error:  # another package's code: the record is kept
        message = f"the judge of the task {task.name} raised {type(error).__name__}: {error}"
        log.error("exception in the judge", exc_info=error)
        cause = Cause(CauseCode.INTERNAL_ERROR, message)
        ending = Ending("internal_error", cause, None, "".join(traceback.format_exception(error)))
    return Result(
        scenario.name,
        seed,
        ending.outcome,
        succeeded=ending.outcome != "internal_error" and all(e.met for e in expectations),
        task=task.name,
        case=scenario.case,
        cause=ending.cause,
        chain=ending.chain,
        traceback=ending.traceback,
        expectations=expectations,
        measured=measured,
        sim_seconds=episode.world.now(),
        wall_seconds=seconds,
        real_time_factor=episode.world.now() / seconds,
        longest_tick=round(wall.longest_lap, 3),
        wall_by_part={part: round(spent, 3) for part, spent in wall.seconds.items()},
        renderer=episode.world.renderer.name,
        belief=belief,
        attempts=tuple(episode.attempts.made),
    )
