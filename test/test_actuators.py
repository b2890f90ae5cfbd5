# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Actuators against their closed forms, however time is cut into steps."""

import math

import numpy as np
import pytest
from scipy.linalg import expm

from poststall_sim import actuators
from poststall_sim.actuators import Actuator
from poststall_sim.aircraft import ConfigError

WIDE = [(-10.0, 10.0)]


def moved(actuator, command_at, dt, steps, *, limits=WIDE):
    """Return position and rate (steps + 1, 2) of one actuator that is told command_at(t)."""
    state = actuators.at_rest([actuator], np.zeros(1), dt)
    found = [(0.0, 0.0)]
    for k in range(steps):
        state = actuators.advance(
            [actuator], limits, state, np.array([command_at(k * dt)]), dt)
        found.append((float(state.position[0]), float(state.rate[0])))
    return np.array(found)


def told(value):
    """Return a command that steps to a value at once."""
    return lambda t: value


def test_without_dynamics_a_control_is_where_it_is_told():
    found = moved(Actuator(), lambda t: 0.1 + t, 0.01, 5)
    assert np.array_equal(found[1:, 0], 0.1 + 0.01 * np.arange(5))


@pytest.mark.parametrize('steps', [1, 3, 60])
def test_first_order_lag_is_exact_at_any_step(steps):
    """The answer to a step, 1 - exp(-t/tau), to rounding, and its rate likewise."""
    x, v = moved(Actuator(time_constant=0.07), told(1.0), 0.3 / steps, steps)[-1]
    left = math.exp(-0.3 / 0.07)
    assert x == pytest.approx(1.0 - left, abs=1e-14)
    assert v == pytest.approx(left / 0.07, abs=1e-12)


@pytest.mark.parametrize('damping', [0.3, 1.0, 2.5])
@pytest.mark.parametrize('steps', [1, 7, 40])
def test_second_order_lag_is_the_matrix_exponential(damping, steps):
    omega, end = 30.0, 0.2
    system = np.array([[0.0, 1.0], [-omega ** 2, -2.0 * damping * omega]])
    expected = np.array([1.0, 0.0]) + expm(end * system) @ [-1.0, 0.0]
    actuator = Actuator(natural_frequency=omega, damping=damping)
    found = moved(actuator, told(1.0), end / steps, steps)[-1]
    assert found == pytest.approx(expected, abs=1e-11)   # rates are of order 10


def test_rate_limit_is_a_ramp_until_the_lag_is_slower():
    """It is r t while what is left is above r tau, then that dies away by the time constant."""
    r, tau = 2.0, 0.05
    actuator = Actuator(rate_limit=r, time_constant=tau)
    for steps in (1, 8, 50):
        found = moved(actuator, told(1.0), 0.6 / steps, steps)
        t = np.linspace(0.0, 0.6, steps + 1)
        corner = (1.0 - r * tau) / r
        expected = np.where(t < corner, r * t, 1.0 - r * tau * np.exp(-(t - corner) / tau))
        assert found[:, 0] == pytest.approx(expected, abs=1e-13)
        assert np.abs(found[:, 1]).max() <= r
    # Without a lag it stops where it is told.
    ramp = moved(Actuator(rate_limit=r), told(-0.3), 0.04, 6)[:, 0]
    assert ramp == pytest.approx(-np.minimum(0.08 * np.arange(7), 0.3), abs=1e-14)


@pytest.mark.parametrize('damping', [0.5, 1.0, 2.0])
def test_second_order_actuator_keeps_its_rate_limit_at_any_step(damping):
    actuator = Actuator(rate_limit=1.5, natural_frequency=40.0, damping=damping)

    def command(t):   # there, and back on the way
        return 0.6 if t < 0.24 - 1e-9 else -0.2

    ends = []
    for steps in (12, 48, 480):
        found = moved(actuator, command, 0.48 / steps, steps)
        assert np.abs(found[:, 1]).max() <= 1.5 * (1.0 + 1e-9)
        ends.append(found[[steps // 4, steps // 2, 3 * steps // 4, steps]])
    assert ends[0] == pytest.approx(ends[2], abs=1e-9)
    assert ends[1] == pytest.approx(ends[2], abs=1e-9)
    # On the ramp it gains what the limit allows.
    assert found[2 * 240 // 3, 0] - found[240 // 3, 0] == pytest.approx(1.5 * 0.08, rel=1e-9)


def test_rate_limit_that_is_never_reached_changes_nothing():
    plain = Actuator(natural_frequency=25.0, damping=0.7)
    held = Actuator(natural_frequency=25.0, damping=0.7, rate_limit=100.0)
    assert moved(held, told(0.5), 0.02, 30) == pytest.approx(
        moved(plain, told(0.5), 0.02, 30), abs=1e-12)


@pytest.mark.parametrize('dead_time', [0.0, 0.02, 0.033, 0.0475])
def test_dead_time_need_not_be_a_number_of_steps(dead_time):
    tau, dt = 0.05, 0.01
    found = moved(Actuator(time_constant=tau, dead_time=dead_time), told(1.0), dt, 30)[:, 0]
    since = dt * np.arange(31) - dead_time
    assert found == pytest.approx(
        np.where(since > 0.0, 1.0 - np.exp(-np.maximum(since, 0.0) / tau), 0.0), abs=1e-13)


def test_actuator_that_overshoots_stops_at_the_limit_and_leaves_it_at_once():
    """No wind-up: told to come back, it comes back as from rest there."""
    actuator = Actuator(natural_frequency=40.0, damping=0.2)

    def command(t):
        return 0.5 if t < 0.3 - 1e-9 else 0.0

    found = moved(actuator, command, 0.005, 80, limits=[(-0.5, 0.5)])[:, 0]
    assert found.max() == 0.5 and np.all(found[20:61] == 0.5)
    assert found[60:] == pytest.approx(0.5 - moved(actuator, told(0.5), 0.005, 20)[:, 0])


@pytest.mark.parametrize(('wrong', 'message'), [
    ({'rate_limit': 0.0}, 'rate limit must be above 0'),
    ({'time_constant': -0.1}, 'time constant must be 0 to 10 s'),
    ({'dead_time': 2.0}, 'dead time must be 0 to 1 s'),
    ({'natural_frequency': math.nan}, 'natural frequency must be'),
    ({'natural_frequency': 5.0, 'damping': 0.0}, 'damping must be'),
    ({'time_constant': 0.1, 'natural_frequency': 9.0}, 'not both')])
def test_actuators_that_make_no_sense_are_refused(wrong, message):
    with pytest.raises(ConfigError, match=message):
        Actuator(**wrong)
