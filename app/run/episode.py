"""One run: the world, the services, the tree, and the loop that ticks it."""

import time
import traceback
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import py_trees
from py_trees.common import Status

from regrasp.app.interrupts import WallLimit
from regrasp.app.records.record import OnEvent, Progress, Record
from regrasp.app.records.result import Link, Outcome, Result
from regrasp.app.run.attempts import Attempts
from regrasp.app.run.fault_injection import EnteredNodes, FaultLog, break_services
from regrasp.app.run.film import Film
from regrasp.app.run.tick_log import TickLog, active_leaf, note_leaf_at_work, running_leaf
from regrasp.app.scenario.copies import copies
from regrasp.app.scenario.load import Scenario
from regrasp.app.scenario.sampling import draw_faults, draw_obstacles
from regrasp.app.tasks.cable.belief import belief_state
from regrasp.app.tasks.cable.judge import Judge
from regrasp.behaviors import LEAVES
from regrasp.behaviors.services import Services
from regrasp.interfaces.cause import Cause, CauseCode
from regrasp.interfaces.scene import SceneSetup
from regrasp.motion.service import Motion
from regrasp.perception.service import Perception
from regrasp.sim.ground_truth import GroundTruth
from regrasp.sim.render.renderer import RendererName
from regrasp.sim.world import World
from regrasp.trees import in_tree_order, load_tree, node_paths, read_graph

TICK = 0.05  # simulated seconds


@dataclass
class Episode:
    """All that one run is made of."""

    world: World
    services: Services
    tree: py_trees.trees.BehaviourTree
    judge: Judge
    attempts: Attempts


@dataclass
class Ending:
    """How a run ended, and what decided it."""

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
    gui: bool = False,
    renderer: RendererName = "auto",
    progress: Progress | None = None,
    on_event: OnEvent | None = None,
) -> Result:
    """Run a scenario to its end and leave its record in the folder `out` (None: nowhere).

    `progress` is called at every tick with the simulated second and the active leaf, `on_event` with each event of
    the run's log. A KeyboardInterrupt, from them or inside a leaf, ends the run cleanly. An exception inside a leaf
    ends it with the cause `internal_error` and its traceback in the record.
    """
    began = time.perf_counter()
    with Record(out, scenario.name, seed, scenario.case, copies(scenario, seed)) as record:
        world = build_world(scenario, seed, renderer, gui)
        try:
            log = record.logger(world.now, on_event)
            log.info(
                "begin",
                scenario=scenario.name,
                case=scenario.case,
                seed=seed,
                gravity=scenario.file.gravity,
                cell=scenario.file.cell,
                tree=scenario.file.tree,
                inputs=scenario.file.inputs,
                limits=scenario.file.limits.model_dump(),
                overrides=list(scenario.overrides),
                renderer=world.renderer.name,
                renderer_reason=world.renderer.reason,
            )
            episode = _assemble(scenario, world, seed, log)
            ticks = TickLog(episode.tree.root, record.ticks, world.now)
            faults = [EnteredNodes(episode.tree.root, world.note_entered), FaultLog(world.faults, log)]
            episode.tree.visitors += [ticks, episode.attempts, *faults]
            note_leaf_at_work(episode.tree, lambda node: record.at_work(world.now(), node))
            with Film(out / "video.mp4" if video and out else None, world) as film:
                ending = _run(episode, scenario, film, progress, log)
            ticks.finalise()
            episode.attempts.finalise()
            result = _result(episode, scenario, seed, ending, time.perf_counter() - began)
            peaks = {pair: round(force, 2) for pair, force in world.contact_peaks.items()}  # N
            log.info("end", outcome=ending.outcome, succeeded=result.succeeded, contact_peaks=peaks)
            record.finish(result)
        finally:
            world.close()
    return result


def build_world(scenario: Scenario, seed: int, renderer: RendererName = "auto", gui: bool = False) -> World:
    """The scenario's world as this seed makes it; close it."""
    rng = np.random.default_rng([seed, 0])
    obstacles = draw_obstacles(scenario.file, rng)
    faults = draw_faults(scenario.file, rng)
    setup = SceneSetup(obstacles, faults)
    return World(scenario.lit_cell, scenario.file.gravity, seed, setup, renderer, gui)


def _assemble(scenario: Scenario, world: World, seed: int, log: Any) -> Episode:
    known = scenario.cell.known
    grippers = {name: arm.gripper for name, arm in world.arms.items()}
    motion = Motion(known, world.arms, grippers, world, seed * 1000)
    motion.remark = lambda sentence: log.warning("does not follow", why=sentence)
    perception = Perception(known, world.cameras, world, motion.camera_pose, motion.spheres)
    services = Services(known, world, motion, perception, log)
    break_services(services, world.faults, world.now)
    py_trees.blackboard.Blackboard.clear()
    tree = py_trees.trees.BehaviourTree(load_tree(scenario.tree, LEAVES, scenario.inputs))
    graph = read_graph(scenario.tree, LEAVES, scenario.inputs)
    types = {node.path: node.type for node in graph.walk() if node.kind != "subtree"}
    attempts = Attempts(tree.root, services.belief.causes, world.now, types)
    return Episode(world, services, tree, Judge(GroundTruth(world), scenario.file.expect), attempts)


def _run(episode: Episode, scenario: Scenario, film: Film, progress: Progress | None, log: Any) -> Ending:
    """Tick until the tree ends, the time is over or somebody interrupts; the arms are stopped in the end."""
    root = episode.tree.root
    try:
        ending = _loop(episode, scenario, film, progress)
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
        episode.world.advance(0.3)
    return ending


def _loop(episode: Episode, scenario: Scenario, film: Film, progress: Progress | None) -> Ending:
    world, root, attempts = episode.world, episode.tree.root, episode.attempts
    belief, limit = episode.services.belief, scenario.file.limits.sim_seconds
    episode.tree.setup(services=episode.services)
    while world.now() < limit:
        episode.tree.tick()
        episode.judge.observe(world.now(), belief)
        leaf = active_leaf(root)
        film.show(leaf)
        if progress:
            progress(world.now(), leaf)
        if root.status is Status.SUCCESS:
            return Ending("stowed")
        if root.status is Status.FAILURE:
            cause = attempts.cause() or (belief.causes[-1] if belief.causes else None)
            return Ending("safe_stop", cause, attempts.failed_chain())
        world.advance(TICK)
    message = f"not done after {limit:g} simulated seconds"
    cause = Cause(CauseCode.TIME_LIMIT, message, _path(running_leaf(root), root))
    return Ending("time_limit", cause, _unfinished(episode))


def _stopped(episode: Episode, stop: KeyboardInterrupt) -> Ending:
    """The ending by a stop from outside: between two ticks, or inside a leaf, which it then names."""
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
    """The chain down to the leaf that the run's end cut short, by default the one that is RUNNING."""
    return episode.attempts.chain_to(leaf or running_leaf(episode.tree.root), "was running", "was still running")


def _broken(episode: Episode, error: Exception, log: Any) -> Ending:
    """The ending that an exception makes, most likely a leaf's."""
    node = _raising(error, episode.tree.root)
    cause = Cause(CauseCode.INTERNAL_ERROR, f"{type(error).__name__}: {error}", _path(node, episode.tree.root))
    log.error("exception in a leaf", node=cause.node, exc_info=error)
    chain = episode.attempts.chain_to(node, "raised", f"raised {cause.message}")
    if node is not None and not node.children:
        episode.attempts.raised(node, cause)
    return Ending("internal_error", cause, chain, "".join(traceback.format_exception(error)))


def _stop(root: py_trees.behaviour.Behaviour) -> None:
    """Stop all that runs, also beside a leaf whose terminate raises; then raises what the first of these raised."""
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
    """Tree path of a node, '' of None."""
    return "" if node is None else node_paths(root)[node.id]


def _raising(error: BaseException, root: py_trees.behaviour.Behaviour) -> py_trees.behaviour.Behaviour | None:
    """The innermost node of the tree that an exception came through."""
    nodes = {id(node): node for node in in_tree_order(root)}
    found, trace = None, error.__traceback__
    while trace is not None:
        found = nodes.get(id(trace.tb_frame.f_locals.get("self")), found)
        trace = trace.tb_next
    return found


def _result(episode: Episode, scenario: Scenario, seed: int, ending: Ending, wall: float) -> Result:
    judge, belief = episode.judge, episode.services.belief
    expectations = judge.expectations(ending.outcome, ending.cause.code if ending.cause else None, belief)
    return Result(
        scenario.name,
        seed,
        ending.outcome,
        succeeded=all(e.met for e in expectations),
        case=scenario.case,
        cause=ending.cause,
        chain=ending.chain,
        traceback=ending.traceback,
        expectations=expectations,
        slips=judge.slips(belief),
        sim_seconds=episode.world.now(),
        wall_seconds=wall,
        real_time_factor=episode.world.now() / wall,
        renderer=episode.world.renderer.name,
        belief=belief_state(episode.services),
        attempts=tuple(episode.attempts.made),
    )
