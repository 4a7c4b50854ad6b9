"""Draws the scene of a scenario that has `draw`: the first that can be solved, and what was thrown away before it."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

import numpy as np

from regrasp.app.files.findings import Finding, Findings, shown
from regrasp.app.scenario.load import Scenario
from regrasp.app.scenario.placement import entered, with_stand
from regrasp.app.scenario.sampling import draw_faults, scene_setup
from regrasp.app.scenario.schema import LightSpec, ObstacleSpec
from regrasp.app.scenario.shapes import JitteredBox, penetration_depth
from regrasp.app.task.draw import Draw, LightDraw, ObstacleDraw, hue_color, light_direction
from regrasp.interfaces.scene import Gravity

CONCERN = 3  # beside a run's seed, the key of the generator; 0 to 2 are the scene's jitter, errors, and faults


@dataclass(frozen=True)
class SceneDrawParameters:
    """How a scene is drawn."""

    clearance: float = 0.015  # m along x, y and z from a block to the cell; choice: a sleeping arm must get out
    piece_tries: int = 50  # places that are tried for a block before the whole scene is drawn anew
    saturation: float = 0.6  # of a block's colour; choice: coloured, and not bright
    value: float = 0.55


@dataclass(frozen=True)
class Drawn:
    """A scenario with all that its `draw` left to the seed, and what was thrown away before: counts by reason."""

    scenario: Scenario
    # By "scenes" (that cannot be solved) and "blocks" (that stood in something); None: the seed had nothing to draw.
    thrown_away: dict[str, dict[str, int]] | None = None


def drawn(scenario: Scenario, seed: int, parameters: SceneDrawParameters = SceneDrawParameters()) -> Drawn:
    """The first scene of this seed that can be solved; the scenario itself if it leaves nothing to the seed.

    The same scenario and seed draw the same. Other draws of the run do not change: the generator is one of its own.

    Raises:
        Findings: none of the scenario's `tries` can be solved; it names the reasons.
    """
    draw = scenario.file.draw
    if draw is None:
        return Drawn(scenario)
    rng = np.random.default_rng([seed, CONCERN])
    scenes, pieces = Counter[str](), Counter[str]()
    for _ in range(draw.tries):
        candidate, reason = _candidate(scenario, draw, rng, pieces, parameters)
        if not reason and (unsolvable := scenario.task.unsolvable) is not None:
            reason = unsolvable()(candidate.cell, candidate.file.gravity, scene_setup(candidate.file, seed))
        if not reason:
            return Drawn(candidate, {"scenes": dict(scenes), "blocks": dict(pieces)})
        scenes[reason] += 1
    message = f"draw: none of {draw.tries} scenes of seed {seed} can be solved: {counted(scenes)}; {_RIGHT}"
    raise Findings([Finding(shown(scenario.path), 0, message)])


_RIGHT = "draw smaller or fewer blocks, or from another region"


def counted(reasons: Mapping[str, int]) -> str:
    """Reasons with how often each came, the most frequent first."""
    return ", ".join(f"{count} {reason}" for reason, count in Counter(reasons).most_common())


def _candidate(
    scenario: Scenario, draw: Draw, rng: np.random.Generator, thrown: Counter[str], parameters: SceneDrawParameters
) -> tuple[Scenario, str]:
    """A scene that is not checked as a whole yet, and why it is none, or ''. Blocks `thrown` away are counted."""
    cell = draw.in_cell(scenario.cell, rng)
    update: dict[str, Any] = {"draw": None, "faults": draw_faults(scenario.file, rng)}
    if draw.light is not None:
        update["light"] = _light(draw.light, rng)
    made = replace(scenario, cell=cell, file=scenario.file.model_copy(update=update))
    pieces: list[ObstacleSpec] = list(made.file.obstacles)
    for kind in draw.obstacles:
        for number in range(int(rng.integers(*kind.count, endpoint=True))):
            for _ in range(parameters.piece_tries):
                piece = _piece(kind, f"{kind.name}_{number + 1}", rng, parameters)
                if (what := _stands_in(scenario, piece, pieces, parameters.clearance)) is None:
                    pieces.append(piece)
                    break
                thrown[f"in {what}"] += 1
            else:
                return made, "no room for its blocks"
    return replace(made, file=made.file.model_copy(update={"obstacles": tuple(pieces)})), ""


def _light(draw: LightDraw, rng: np.random.Generator) -> LightSpec:
    brightness, tilt, azimuth = rng.uniform(*draw.brightness), rng.uniform(*draw.tilt_deg), rng.uniform(-np.pi, np.pi)
    return LightSpec(brightness=float(brightness), direction=light_direction(float(tilt), float(azimuth)))


def _piece(draw: ObstacleDraw, name: str, rng: np.random.Generator, parameters: SceneDrawParameters) -> ObstacleSpec:
    size, region = draw.size, draw.region
    spans = (size.x, size.y, size.z, region.x, region.y, region.z, draw.yaw_deg, draw.hue_deg)
    dx, dy, dz, x, y, bottom, yaw_deg, hue_deg = rng.uniform(*np.array(spans).T).round(3).tolist()  # millimetres
    bottom = bottom if rng.random() < region.on_stand else 0.0
    color = hue_color(hue_deg, parameters.saturation, parameters.value)
    return ObstacleSpec(name=name, size=(dx, dy, dz), position=(x, y, bottom), yaw_deg=yaw_deg, color=color)


def _stands_in(scenario: Scenario, piece: ObstacleSpec, others: Sequence[ObstacleSpec], clearance: float) -> str | None:
    """What a block stands in, or nearer to than `clearance` m along an axis, in words; None if it is free.

    Blocks may touch one another.

    The cell is the undrawn one, so that what a task works out for it is worked out once for many scenes.
    """
    gravity = scenario.file.gravity
    for other, one in product(others, _boxes(piece, gravity).values()):
        for box in _boxes(other, gravity).values():
            if penetration_depth(np.vstack([box.generators, one.generators]), box.center - one.center) > 0:
                return "another block"
    boxes = _boxes(piece, gravity, clearance)
    return next((body for _, body, _ in entered(scenario.cell, scenario.task, gravity, boxes)), None)


def _boxes(piece: ObstacleSpec, gravity: Gravity, clearance: float = 0.0) -> dict[str, JitteredBox]:
    bottom, wide = np.array(piece.position_in(gravity)), clearance + np.array(piece.jitter)
    return with_stand(JitteredBox(bottom, piece.size, piece.yaw_deg, tuple(wide.tolist())))
