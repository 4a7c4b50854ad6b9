"""The chain against the theory of rods."""

from collections.abc import Iterator

import numpy as np
import pybullet as p
import pytest
from scipy.integrate import solve_bvp
from scipy.spatial.transform import Rotation

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cable.cell import CableCell, HiddenCable
from regrasp.interfaces.scene import EARTH_GRAVITY
from regrasp.sim.cable.cable import CableBody, build_cable, first_frequency, spring_torques

DROOP = 0.02  # share of the elastica's droop
ENERGY_RISE = 0.01  # share of the initial energy
STILL = 0.03  # m/s
SETTLE = 8.0  # s
FREQUENCY = 0.05  # share of the beam's first frequency
TINY = 1e-4  # kg


def run(cable: CableBody, step: float, seconds: float) -> Iterator[int]:
    """Step so long; yields after every step."""
    for i in range(round(seconds / step)):
        cable.apply_springs()
        p.stepSimulation(physicsClientId=cable.client)
        yield i


def energy(cable: CableBody) -> float:
    """Kinetic plus bending energy in J, without gravity; with the links' raised inertia, as in the motion."""
    return kinetic_energy(cable) + bending_energy(cable)


def kinetic_energy(cable: CableBody) -> float:
    links = range(cable.links + 1)
    energy = 0.0
    for link, s in zip(links, p.getLinkStates(cable.body, links, 1, 1, physicsClientId=cable.client), strict=True):
        mass, _, inertia = p.getDynamicsInfo(cable.body, link, physicsClientId=cable.client)[:3]
        turn = np.array(p.getMatrixFromQuaternion(s[1])).reshape(3, 3)
        rate = turn.T @ np.array(s[7])
        energy += 0.5 * mass * float(np.dot(s[6], s[6])) + 0.5 * float(np.dot(inertia, rate**2))
    return energy


def bending_energy(cable: CableBody) -> float:
    states = p.getJointStatesMultiDof(cable.body, range(cable.links), physicsClientId=cable.client)
    bend = Rotation.from_quat([s[0] for s in states]).magnitude()
    return 0.5 * float(np.sum(cable.stiffness * bend**2))


def tip(cable: CableBody, connector_length: float) -> FloatArray:
    """Position (3,) m of the flexible part's end."""
    return cable.connector_state().pose.apply([-connector_length / 2, 0.0, 0.0])


def elastica(stiffness: float, weight: float, length: float) -> float:
    """Droop in m of a horizontally clamped heavy rod: EI a'' = -w (L - s) cos a, a(0) = a'(L) = 0, drop = int sin a."""

    def rod(s: FloatArray, y: FloatArray) -> FloatArray:
        return np.array([y[1], -weight * (length - s) * np.cos(y[0]) / stiffness, np.sin(y[0])])

    def ends(start: FloatArray, end: FloatArray) -> FloatArray:
        return np.array([start[0], end[1], start[2]])

    s = np.linspace(0.0, length, 50)
    solution = solve_bvp(rod, ends, s, np.zeros((3, 50)), tol=1e-8)
    assert solution.success
    return float(solution.y[2, -1])


@pytest.fixture
def step(cell: CableCell) -> float:
    return 1.0 / cell.hidden.step_rate


@pytest.mark.parametrize("stiffness", [0.05, 0.16])
def test_a_cantilever_droops_like_the_heavy_elastica(
    cell: CableCell, client: int, step: float, stiffness: float
) -> None:
    spec, connector = cell.hidden.cable, cell.known.cable.connector
    p.setGravity(0, 0, -EARTH_GRAVITY, physicsClientId=client)
    cable = build_cable(client, spec, connector, TINY, stiffness, step)
    for _ in run(cable, step, SETTLE):
        pass
    droop = spec.anchor[2] - tip(cable, connector.length)[2]
    expected = elastica(stiffness, spec.mass_per_length * EARTH_GRAVITY, spec.length)
    assert spec.links == 20
    assert droop == pytest.approx(expected, rel=DROOP)


def _released(cell: CableCell, client: int, step: float) -> CableBody:
    """The thesis's cable after half a second of a sideways pull on its end."""
    cable = build_cable(
        client,
        cell.hidden.cable,
        cell.known.cable.connector,
        cell.hidden.cable.connector_mass,
        cell.hidden.cable.stiffness.zero,
        step,
    )
    pull = [0.4, 0.0, 0.3]  # N, bends the end aside by 0.3 m
    for _ in range(round(0.5 / step)):
        at = cable.connector_state().pose.translation.tolist()
        p.applyExternalForce(cable.body, cable.connector_link, pull, at, p.WORLD_FRAME, physicsClientId=client)
        next(run(cable, step, step))
    return cable


def test_a_released_cable_never_gains_energy_and_comes_to_rest(cell: CableCell, client: int, step: float) -> None:
    cable = _released(cell, client, step)
    energies, speeds = [energy(cable)], []
    for _ in run(cable, step, SETTLE):
        energies.append(energy(cable))
        speeds.append(float(np.linalg.norm(cable.connector_state().velocity)))
    lowest = np.minimum.accumulate(energies)
    assert energies[0] > 0.05  # J: it was bent
    assert float(np.max(energies - lowest)) < ENERGY_RISE * energies[0]
    assert max(speeds[-round(0.5 / step) :]) < STILL


def test_it_swings_at_the_beams_first_frequency(cell: CableCell, client: int, step: float) -> None:
    spec = cell.hidden.cable.model_copy(update={"damping_ratio": 0.0})
    mass, stiffness = cell.hidden.cable.connector_mass, cell.hidden.cable.stiffness.zero
    cable = build_cable(client, spec, cell.known.cable.connector, mass, stiffness, step)
    x = []
    for i in run(cable, step, 6.0):
        at = cable.connector_state().pose.translation
        x.append(at[0] - spec.anchor[0])
        push = [0.2 * (i < 200), 0.0, 0.0]  # N
        p.applyExternalForce(cable.body, cable.connector_link, push, at.tolist(), p.WORLD_FRAME, physicsClientId=client)
    crossings = np.flatnonzero(np.diff(np.sign(x[200:])))
    half_period = float(np.mean(np.diff(crossings))) * step
    # The end's mass swings at its own centre, half a connector past the flexible part.
    reach = spec.length + cell.known.cable.connector.length / 2
    low = first_frequency(stiffness, reach, spec.mass_per_length, mass)
    high = first_frequency(stiffness, spec.length, spec.mass_per_length, mass)
    assert low * (1 - FREQUENCY) < np.pi / half_period < high * (1 + FREQUENCY)


def test_first_frequency_of_a_bare_cantilever() -> None:
    """3.516 sqrt(EI / mu L^4), the textbook's first mode; Rayleigh's mass is good to 2 %."""
    exact = 3.516 * np.sqrt(0.05 / (0.05 * 0.55**4))
    assert first_frequency(0.05, 0.55, 0.05, 0.0) == pytest.approx(exact, rel=0.02)


def test_springs_turn_back_by_angle_and_rate() -> None:
    angle, axis = 2.5, np.array([0.6, 0.0, 0.8])
    q = np.append(np.sin(angle / 2) * axis, np.cos(angle / 2))
    rates = np.array([[0.1, 0.2, -0.3]] * 2)
    torques = spring_torques(np.hstack([[q, -q], rates]), np.array([2.0, 2.0]), np.array([0.5, 0.5]))
    np.testing.assert_allclose(torques[0], -2.0 * angle * axis - 0.5 * rates[0])
    np.testing.assert_allclose(torques[1], torques[0])  # q and -q are the same turn


def test_it_starts_straight_and_at_rest(cell: CableCell, client: int, step: float) -> None:
    spec: HiddenCable = cell.hidden.cable
    connector = cell.known.cable.connector
    cable = build_cable(client, spec, connector, cell.hidden.cable.connector_mass, 0.05, step)
    start = cable.connector_state()
    reach = spec.length + connector.length / 2
    np.testing.assert_allclose(start.position, np.asarray(spec.anchor) + reach * np.asarray(spec.anchor_axis))
    np.testing.assert_array_equal(start.velocity, 0.0)
    assert energy(cable) == 0.0
