# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Air that differs from place to place and time to time: the body and its wake feel it there."""

import math

import numpy as np
import pytest
import wings

from poststall_sim import simulation
from poststall_sim.frames import euler_from_quaternion
from poststall_sim.state import Status


@pytest.fixture(scope='module')
def start():
    """Return a function that gives the trainer in level trim at 15 m/s, heading north."""
    first = simulation.start(wings.shipped_aircraft('trainer'), airspeed=15.0, altitude=100.0)
    saved = first.saved()
    return lambda: simulation.Flight.resumed(first.model, saved)


def flown(flight, gusts, steps=60):
    flight.gusts = gusts
    for _ in range(steps):
        snapshot = flight.step(flight.trim)
        assert snapshot.status is Status.CONVERGED
    return snapshot


def test_gust_that_is_the_same_everywhere_is_a_wind(start):
    """Switched on at once, as wind or as a gust: one flight."""
    wind = np.array([1.0, 0.5, -0.3])
    blown = start()
    blown.wind_N = wind
    here = flown(blown, None)
    there = flown(start(), lambda time, points: np.broadcast_to(wind, points.shape))
    assert there.body.position_N == pytest.approx(here.body.position_N, abs=1e-6)
    assert there.force_B == pytest.approx(here.force_B, abs=1e-4)
    assert there.wind_N == pytest.approx(wind, abs=1e-12)


def test_air_that_turns_about_the_flight_path_rolls_the_aircraft(start):
    """Rising on the right and sinking on the left: it rolls left, the more the faster it turns."""
    roll = {}
    for rate in (0.0, 0.3, -0.3):
        def gusts(time, points, rate=rate):
            return np.column_stack([np.zeros(len(points)), np.zeros(len(points)),
                                    -rate * points[:, 1]])
        roll[rate] = euler_from_quaternion(flown(start(), gusts).body.q_NB)[0]
    assert abs(roll[0.0]) < 1e-6
    assert roll[0.3] < math.radians(-1.0)
    assert roll[-0.3] == pytest.approx(-roll[0.3], rel=1e-3)


def test_gust_comes_with_its_time(start):
    """A vertical gust of 1 m/s after 0.2 s lifts from then on, and not before."""
    still, gusty = start(), start()
    gusty.gusts = lambda time, points: np.broadcast_to(
        [0.0, 0.0, -1.0 if time > 0.2 else 0.0], points.shape)
    lift = []
    for _ in range(60):
        lift.append([-flight.step(flight.trim).force_B[2] for flight in (still, gusty)])
    lift = np.array(lift)
    before = np.arange(1, 61) * still.dt_ns * 1e-9 <= 0.2
    assert lift[before, 1] == pytest.approx(lift[before, 0], rel=1e-4)
    # 1 m/s in 15 is 3.8 deg: two thirds more lift, of which Wagner gives half at once. The first
    # two steps have the jump in their rates.
    assert np.all(lift[~before, 1][2:6] > 1.25 * lift[~before, 0][2:6])


def test_wake_goes_with_the_air_where_it_is(start):
    """Air that rises behind the aircraft only: the wake there, and no other part of it."""
    flight = start()

    def gusts(time, points):
        rising = np.where(points[:, 0] < -1.0, -1.0, 0.0)
        return np.column_stack([np.zeros((len(points), 2)), rising])
    flown(flight, gusts, 40)
    calm = start()
    flown(calm, None, 40)
    moved = flight.state.flow.wake.nodes_N - calm.state.flow.wake.nodes_N
    behind = calm.state.flow.wake.nodes_N[..., 0] < -1.5
    ahead = calm.state.flow.wake.nodes_N[..., 0] > 0.5
    time = 40 * flight.dt_ns * 1e-9
    # Nodes shed before the start have risen for all of it.
    assert moved[behind][:, 2] == pytest.approx(-time * 1.0, rel=0.05)
    # The aircraft's own flight is another by a few hundredths of that.
    assert np.abs(moved[ahead]).max() < 0.05 * time
