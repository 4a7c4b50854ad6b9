"""Puts a run together: the world of a scenario and seed, the robot's services, the tree, and the judge."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeVar

import py_trees

from regrasp.app.run.attempts import Attempts
from regrasp.app.run.fault_injection import break_services
from regrasp.app.scenario.load import Scenario
from regrasp.app.scenario.sampling import scene_setup
from regrasp.app.scenario.scene_draw import drawn
from regrasp.app.task.judge import Judge
from regrasp.app.task.task import Task
from regrasp.behaviors import registry
from regrasp.behaviors.keys import causes
from regrasp.behaviors.services import Services
from regrasp.motion.service import Motion
from regrasp.perception.service import Perception
from regrasp.sim.render.renderer import RendererName
from regrasp.sim.world import World
from regrasp.trees import load_tree, read_graph
from regrasp.trees.task_networks import networks_named_in

ServicesT = TypeVar("ServicesT", bound=Services)


@dataclass
class Episode:
    """All that one run is made of."""

    task: Task
    world: World[Any]
    services: Services
    tree: py_trees.trees.BehaviourTree
    judge: Judge[Any]
    attempts: Attempts


def build_world(scenario: Scenario, seed: int, renderer: RendererName = "software", gui: bool = False) -> World[Any]:
    """The scenario's world for this seed. The caller closes it.

    Raises `Findings` if the scenario leaves its scene to the seed, and none can be solved.
    """
    scenario = drawn(scenario, seed).scenario
    cell, setup = scenario.lit_cell, scene_setup(scenario.file, seed)
    objects = scenario.task.objects()(cell)
    return World(cell, scenario.file.gravity, seed, objects, setup, renderer, gui)


def build_services(world: World[Any], seed: int, log: Any) -> Services:
    """Motion and perception as every task has them, see `connected`."""
    return connected(Services, Motion, Perception, world, seed, log)


def connected(
    services: Callable[..., ServicesT],
    motion: Callable[..., Motion],
    perception: Callable[..., Perception],
    world: World[Any],
    seed: int,
    log: Any,
) -> ServicesT:
    """Services of these classes on the world's devices. `log` is a structlog logger.

    They get the known part of the cell only, and no ground truth. What a motion compiles is loaded now. The planner's
    seeds begin at a thousand times the run's; each plan takes the next one.
    """
    known = world.cell.known
    grippers = {name: arm.gripper for name, arm in world.arms.items()}
    arms = motion(
        known,
        world.arms,
        grippers,
        world,
        seed * 1000,
        on_anomaly=lambda sentence: log.warning("anomaly", why=sentence),
    )
    arms.warm_up()
    sight = perception(known, world.cameras, world, arms.camera_pose, arms.spheres)
    return services(known, world, arms, sight, log)


def assemble(scenario: Scenario, world: World[Any], seed: int, log: Any) -> Episode:
    """Services with the scenario's software faults, the tree on an empty blackboard, its attempts and the judge."""
    task = scenario.task
    py_trees.blackboard.Blackboard.clear()
    services = task.services()(world, seed, log)
    break_services(services, world.faults, world.now)
    services.networks = networks_named_in(scenario.tree)
    leaves = registry.leaves_of(task.name)
    tree = py_trees.trees.BehaviourTree(load_tree(scenario.tree, leaves, scenario.inputs))
    graph = read_graph(scenario.tree, leaves, scenario.inputs)
    types = {node.path: node.type for node in graph.walk() if node.kind != "subtree"}
    attempts = Attempts(tree.root, causes, world.now, types)
    judge = task.judge()(world, services, scenario.file.expect)
    return Episode(task, world, services, tree, judge, attempts)
