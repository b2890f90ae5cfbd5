# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""What a flight does to a body's energy, and a body that falls: the whole step in closed form."""

import math

import exact
import numpy as np
import pytest
import wings

from poststall_sim import definition, jobs, simulation
from poststall_sim.aero import model as models
from poststall_sim.aero.model import Settings
from poststall_sim.aircraft import Aircraft, Airfoil, MassProperties, Reference, Section, Surface
from poststall_sim.atmosphere import standard_air
from poststall_sim.frames import GRAVITY, quaternion_from_euler, rotation
from poststall_sim.nonlifting import NonliftingBody
from poststall_sim.state import BodyState, Controls, Status
from poststall_sim.weather import Weather

# --- a sphere

RADIUS, MASS = 0.1, 0.0025   # a ball of paper: at its last speed after half a metre
DRAG_AREA = 0.47 * math.pi * RADIUS ** 2


def sphere():
    """
    Return a sphere: an aircraft whose only surface is a chip of 1 mm in its stream's plane.

    The section has no drag, and the chip falls along its own chord, so that it has no lift: no
    force at all but by rounding.
    """
    alpha = np.radians(np.arange(-180.0, 181.0, 10.0))
    nothing = np.zeros_like(alpha)
    chip = Airfoil('chip', alpha, 0.1 * np.sin(2.0 * alpha) * (np.abs(alpha) < 3.1), nothing,
                   nothing)
    sections = tuple(Section((0.0, y, 0.0), 1e-3, 'chip') for y in (-5e-4, 5e-4))
    inertia = 0.4 * MASS * RADIUS ** 2
    return Aircraft(
        'sphere', (Surface('chip', sections, 2),), (chip,), Reference(1e-6, 1e-3, 1e-3),
        MassProperties(MASS, (0.0, 0.0, 0.0), inertia * np.eye(3)),
        bodies=(NonliftingBody('ball', (0.0, 0.0, 0.0), (DRAG_AREA,) * 3),))


@pytest.fixture(scope='module')
def ball():
    return models.build(sphere(), Settings(chordwise=1))


def off(ball, dt_ns, start):
    """Return how far a fall of 0.6 s, nose first from a speed, is from the closed form [m/s]."""
    body = BodyState(np.array([0.0, 0.0, -1000.0]), np.array([start, 0.0, 0.0]), np.zeros(3),
                     quaternion_from_euler(0.0, -math.pi / 2, 0.0))
    still = Controls(np.zeros(0))
    flight = simulation.Flight(ball, body, still, dt_ns=dt_ns)
    snapshots = [flight.snapshot] + [flight.step(still) for _ in range(600_000_000 // dt_ns)]
    assert flight.paused_reason is None
    density = standard_air(0.5 * (1000.0 + snapshots[-1].body.altitude)).density
    terminal = math.sqrt(2.0 * MASS * GRAVITY / (density * DRAG_AREA))
    closed = exact.fall_with_drag(np.array([s.time for s in snapshots]), terminal, start)
    assert snapshots[-1].airspeed > 0.99 * terminal
    for s in snapshots:
        velocity_N = rotation(s.body.q_NB) @ s.body.velocity_B
        assert velocity_N == pytest.approx([0.0, 0.0, s.airspeed], abs=1e-9)
        assert np.abs(s.body.rates_B).max() < 1e-9
    return float(np.abs([s.airspeed - v for s, v in zip(snapshots, closed)]).max())


@pytest.mark.parametrize('start', [0.0, 0.5])
def test_a_falling_sphere_has_the_closed_form(ball, start):
    """
    `exact.fall_with_drag`, through the whole step of a flight.

    It falls less than a metre, over which the density changes by 1e-4: with that of the middle
    the last speed, 1.7 m/s, is good to 5e-5. The step is of second order: a quarter at half dt.
    """
    coarse, fine = (off(ball, dt, start) for dt in (6_000_000, 3_000_000))
    assert fine < 1.5e-4
    assert coarse / fine == pytest.approx(4.0, abs=0.8)


# --- energy

def energy(snapshots, mass):
    """Return kinetic energy of the body and potential energy (n,) [J]."""
    return np.array([
        0.5 * mass.mass * s.body.velocity_B @ s.body.velocity_B
        + 0.5 * s.body.rates_B @ mass.inertia_B @ s.body.rates_B
        + mass.mass * GRAVITY * s.body.altitude for s in snapshots])


def power(snapshots):
    """Return the power (n,) of aerodynamics and thrust over the ground [W]."""
    return np.array([
        (s.force_B + s.thrust_B) @ s.body.velocity_B
        + (s.moment_B + s.thrust_moment_B) @ s.body.rates_B for s in snapshots])


@pytest.mark.parametrize('wind_N', [np.zeros(3), np.array([3.0, -2.0, 0.5])])
def test_energy_of_a_stall_and_its_recovery_balances(wind_N):
    """
    The work of air and engine is the change of the body's energy, to a thousandth of what went.

    The published force has the reaction of the air that is carried along (the added mass) in it,
    so that it is mass times acceleration, and the body's own energy alone balances. The integral
    is the trapezium rule over steps of 16 ms: its error, dt^2/12 times the change of the power's
    slope, and that of the step itself, of second order too, leave 3e-5 of the work, measured.
    """
    aircraft = wings.shipped_aircraft('trainer')
    scenario = definition.scenario(definition.find('scenarios', 'stall_and_recovery'))
    flight = simulation.start(aircraft, Settings(chordwise=2), airspeed=scenario.airspeed,
                              altitude=scenario.altitude, weather=Weather(wind_N))
    snapshots = [flight.snapshot, *jobs.fly(flight, scenario, 13.0)]
    assert all(s.status is Status.CONVERGED for s in snapshots)
    wing = flight.model.lattice.grids[0].strips
    stalled = np.array([np.count_nonzero(s.strips.stalled[wing]) for s in snapshots])
    assert stalled.max() > 10 and stalled[0] == stalled[-1] == 0
    had, worked = energy(snapshots, aircraft.mass), power(snapshots)
    work = np.append(0.0, np.cumsum(0.5 * (worked[1:] + worked[:-1]))) * flight.dt_ns * 1e-9
    gone = np.append(0.0, np.cumsum(0.5 * np.abs(worked[1:] + worked[:-1]))) * flight.dt_ns * 1e-9
    gap = had - had[0] - work
    assert np.abs(gap).max() < 1e-3 * gone[-1]
    # The engine gives, the air takes: the flight ends below, and what it lost is in the work.
    assert work[-1] < -200.0
    assert had[-1] - had[0] == pytest.approx(work[-1], rel=1e-3)
