# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""The rigid body against closed solutions, conserved quantities and its order in dt."""

import math

import exact
import numpy as np
import pytest

from poststall_sim import rigid_body
from poststall_sim.frames import (
    GRAVITY,
    euler_from_quaternion,
    quaternion_from_euler,
    rotation,
    velocity_from_flow_angles,
)
from poststall_sim.state import BodyState

NO_LOAD = np.zeros(6)
NO_ADDED_MASS = np.zeros((6, 6))
SLUG = 14.593902937206
FOOT = 0.3048
# NESC 6-DOF check case 2 (NASA/TM-2015-218675): a brick that tumbles without torque.
BRICK_MASS = 0.155404754 * SLUG
BRICK_MOMENTS = np.array([0.001894220, 0.006211019, 0.007194665]) * SLUG * FOOT**2
BRICK_RATES = np.radians([10.0, 20.0, 30.0])
SKEW = np.array([[1.2, 0.05, -0.2], [0.05, 1.4, 0.1], [-0.2, 0.1, 2.5]])


def body(position=(0, 0, 0), velocity=(0, 0, 0), rates=(0, 0, 0), euler_deg=(0, 0, 0)):
    return BodyState(np.array(position, float), np.array(velocity, float),
                     np.array(rates, float), quaternion_from_euler(*np.radians(euler_deg)))


def of(mass, inertia, added=NO_ADDED_MASS, gravity=GRAVITY):
    """Return the keywords of `advance` for a body."""
    return {'mass': mass, 'inertia_B': np.asarray(inertia, float), 'gravity': gravity,
            'inverse': rigid_body.mass_matrix_inverse(mass, np.asarray(inertia, float), added)}


def fly(start, load, dt, steps, **properties):
    """Return all states under a load given as a function of time."""
    states = [start]
    for k in range(steps):
        states.append(rigid_body.advance(
            states[-1], load(k * dt), load((k + 1) * dt), dt, **properties))
    return states


def unloaded(time):
    return NO_LOAD


def packed(state):
    return np.concatenate([state.position_N, state.velocity_B, state.rates_B, state.q_NB])


@pytest.fixture(scope='module')
def tumbling():
    """NESC case 2: 30 s at dt = 0.01 s."""
    return fly(body(rates=BRICK_RATES), unloaded, 0.01, 3000,
               **of(BRICK_MASS, np.diag(BRICK_MOMENTS)))


def test_torque_free_brick_against_elliptic_functions(tumbling):
    rates = np.array([state.rates_B for state in tumbling])
    closed = exact.torque_free_rates(BRICK_MOMENTS, BRICK_RATES, 0.01 * np.arange(3001))
    # The bound asked of the check case, in deg/s; measured 3e-10.
    assert np.abs(np.degrees(rates - closed)).max() < 1e-6


def test_torque_free_brick_keeps_momentum_and_energy(tumbling):
    momentum = np.array([rotation(s.q_NB) @ (BRICK_MOMENTS * s.rates_B) for s in tumbling])
    energy = np.array([0.5 * s.rates_B @ (BRICK_MOMENTS * s.rates_B) for s in tumbling])
    # A phase error of 1e-6 deg/s over a rate of 30 deg/s would be 3e-8; RK4 is far below.
    assert np.abs(momentum - momentum[0]).max() < 1e-9 * np.linalg.norm(momentum[0])
    assert np.abs(energy / energy[0] - 1.0).max() < 1e-9


@pytest.mark.parametrize('moments', [(1.0, 2.0, 2.5), (2.5, 2.0, 1.0), (2.0, 1.0, 2.5),
                                     (2.0, 2.0, 1.0), (2.0, 2.0, 2.0)])
def test_torque_free_rates_for_any_order_of_the_moments(moments):
    rates0 = np.array([0.4, 1.0, -0.3])
    states = fly(body(rates=rates0), unloaded, 0.01, 500, **of(3.0, np.diag(moments)))
    closed = exact.torque_free_rates(moments, rates0, 0.01 * np.arange(501))
    # 500 steps of (1 rad/s 0.01 s)^5/120 each.
    assert np.abs([s.rates_B for s in states] - closed).max() < 1e-9


def test_projectile():
    """Without rotation the exact path is a parabola, which a fourth-order rule meets exactly."""
    velocity = velocity_from_flow_angles(30.0, 0.3, 0.2)
    start = body((1.0, 2.0, -50.0), velocity, (0, 0, 0), (20, 40, 60))
    states = fly(start, unloaded, 0.05, 60, **of(2.0, SKEW))
    position, speed = exact.projectile(
        0.05 * np.arange(61), start.position_N, rotation(start.q_NB) @ velocity, GRAVITY)
    assert np.abs([s.position_N for s in states] - position).max() < 1e-11   # of 100 m
    assert np.abs([rotation(s.q_NB) @ s.velocity_B for s in states] - speed).max() < 1e-12


def test_projectile_that_tumbles_flies_the_same_path():
    start = body((0, 0, -50.0), (20.0, 3.0, -5.0), (1.0, 2.0, -1.5), (20, 40, 60))
    velocity_N = rotation(start.q_NB) @ start.velocity_B
    errors = []
    for dt in (0.02, 0.01):
        states = fly(start, unloaded, dt, round(2.0 / dt), **of(2.0, SKEW))
        position, _ = exact.projectile(2.0, start.position_N, velocity_N, GRAVITY)
        errors.append(np.linalg.norm(states[-1].position_N - position))
    # A step at 2.7 rad/s is off by (0.027)^5/120 of the vector that it turns: 2.4e-7 m/s per
    # second of 20 m/s, in the velocity and once more in the attitude, for 2 s.
    assert errors[1] < 1e-6
    assert math.log2(errors[0] / errors[1]) == pytest.approx(4.0, abs=0.1)


def test_a_loop_passes_straight_up_and_down():
    """At a steady pitch rate the attitude is known: nothing happens at 90 deg."""
    rate = math.radians(90.0)
    start = body(rates=(0.0, rate, 0.0), euler_deg=(0.0, 0.0, 30.0))
    states = fly(start, unloaded, 0.01, 400, **of(1.0, np.eye(3)))
    for k, state in enumerate(states):
        half = 0.5 * rate * 0.01 * k
        turn = rotation(np.array([math.cos(half), 0.0, math.sin(half), 0.0]))
        # 400 steps of (half the rate times dt)^5/120.
        assert np.abs(rotation(state.q_NB) - rotation(start.q_NB) @ turn).max() < 1e-9
    # At the gimbal the pitch itself is known to the root of round-off only.
    assert np.degrees(euler_from_quaternion(states[100].q_NB)[1]) == pytest.approx(90, abs=1e-4)
    assert np.degrees(euler_from_quaternion(states[300].q_NB)[1]) == pytest.approx(-90, abs=1e-4)


def test_fourth_order_under_a_load_linear_in_time():
    def load(time):
        return np.array([3.0, -1.0, 2.0, 0.3, 0.5, -0.2]) \
            + time * np.array([-2.0, 1.5, 4.0, 0.2, -0.6, 0.4])

    start = body((0, 0, -10), (10.0, 1.0, 2.0), (0.8, -0.6, 0.5), (10, 80, 30))
    ends = [packed(fly(start, load, dt, round(1.6 / dt), **of(2.0, SKEW))[-1])
            for dt in (0.08, 0.04, 0.02, 0.01)]
    steps = [np.linalg.norm(b - a) for a, b in zip(ends, ends[1:])]
    order = np.log2(np.array(steps[:-1]) / steps[1:])
    assert order == pytest.approx([4.0, 4.0], abs=0.1)   # a classical Runge-Kutta rule


def test_quaternion_stays_of_unit_length():
    states = fly(body(rates=(20.0, -30.0, 25.0)), unloaded, 0.02, 500, **of(1.0, SKEW))
    norms = [np.linalg.norm(s.q_NB) for s in states]
    assert norms == pytest.approx(np.ones(501), abs=4e-16)


def test_spin_up_about_a_principal_axis():
    """Under a moment linear in time, p = (M0 t + M1 t^2/2)/Ixx."""
    states = fly(body(), lambda t: np.array([0, 0, 0, 0.4 + 0.3 * t, 0, 0]), 0.02, 100,
                 **of(1.0, np.diag([0.8, 1.0, 1.2]), gravity=0.0))
    time = 0.02 * np.arange(101)
    rates = np.array([s.rates_B for s in states])
    assert rates[:, 0] == pytest.approx((0.4 * time + 0.15 * time**2) / 0.8, abs=1e-13)
    assert not rates[:, 1:].any()


def test_added_mass_in_heave_is_a_heavier_body():
    """(m + m_add) dw/dt = Z; the added mass has inertia, but no weight."""
    added = np.zeros((6, 6))
    added[2, 2] = 0.7
    push = np.array([0.0, 0.0, -12.0, 0.0, 0.0, 0.0])
    light = fly(body(), lambda t: t * push, 0.01, 200, **of(2.0, SKEW, added))
    heavy = fly(body(), lambda t: t * push, 0.01, 200,
                **of(2.7, SKEW, gravity=2.0 * GRAVITY / 2.7))
    time = 0.01 * np.arange(201)
    closed = (-6.0 * time**2 + 2.0 * GRAVITY * time) / 2.7
    assert np.array([s.velocity_B[2] for s in light]) == pytest.approx(closed, abs=1e-12)
    assert np.abs(packed(light[-1]) - packed(heavy[-1])).max() < 1e-12


def test_added_mass_that_couples_heave_and_pitch():
    """An off-centre force on a body with coupling solves the two by two system."""
    added = np.zeros((6, 6))
    added[2, 2], added[4, 4], added[2, 4], added[4, 2] = 0.7, 0.3, 0.1, 0.1
    change = rigid_body.acceleration(
        body(), np.array([0, 0, 5.0, 0, 2.0, 0]), **of(2.0, np.diag([1.0, 1.4, 2.0]), added,
                                                       gravity=0.0))
    expected = np.linalg.solve([[2.7, 0.1], [0.1, 1.7]], [5.0, 2.0])
    assert change[[2, 4]] == pytest.approx(expected, rel=1e-14)
    assert not change[[0, 1, 3, 5]].any()


@pytest.mark.parametrize('euler_deg, weight_B', [
    ((0, 0, 0), (0, 0, 1)), ((90, 0, 0), (0, 1, 0)), ((0, 90, 45), (-1, 0, 0)),
    ((180, 0, 0), (0, 0, -1))])
def test_acceleration_under_a_constant_load(euler_deg, weight_B):
    load = np.array([4.0, -2.0, 6.0, 0.3, 0.2, 0.1])
    change = rigid_body.acceleration(
        body(euler_deg=euler_deg), load, **of(2.0, np.diag([1.0, 2.0, 2.5])))
    assert change[:3] == pytest.approx(load[:3] / 2.0 + GRAVITY * np.array(weight_B), abs=1e-14)
    assert change[3:] == pytest.approx(load[3:] / [1.0, 2.0, 2.5], rel=1e-14)


def test_turning_axes_see_a_constant_velocity_change():
    """Seen from turning axes, components of a constant velocity change at -omega x v."""
    state = body(velocity=(10.0, 2.0, -3.0), rates=(0.5, -1.0, 0.7))
    change = rigid_body.acceleration(state, NO_LOAD, **of(2.0, np.eye(3), gravity=0.0))
    assert change[:3] == pytest.approx(-np.cross(state.rates_B, state.velocity_B), abs=1e-14)


def test_acceleration_is_the_slope_of_the_flight():
    state = body((0, 0, -5), (10.0, 2.0, -3.0), (0.5, -1.0, 0.7), (10, 20, 30))
    load = np.array([4.0, -2.0, 6.0, 0.3, 0.2, 0.1])
    h = 1e-4
    after, before = (packed(rigid_body.advance(state, load, load, dt, **of(2.0, SKEW)))
                     for dt in (h, -h))
    slope = (after - before)[3:9] / (2.0 * h)
    # Truncation h^2 (1 rad/s)^2 10 m/s^2, cancellation 1e-15/h.
    assert rigid_body.acceleration(state, load, **of(2.0, SKEW)) == pytest.approx(slope, abs=1e-7)
