# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Shafts: governed and by motors, their balance and their way to it, and batteries."""

import dataclasses
import math

import numpy as np
import propellers
import pytest
import wings
from propellers import BATTERY, FLAT, GOVERNOR, MOTOR, RPM
from scipy.integrate import solve_ivp

from poststall_sim import propulsion
from poststall_sim.aircraft import ConfigError
from poststall_sim.engines import Coefficients, Propeller
from poststall_sim.state import EngineState

DENSITY = wings.DENSITY


def met(machine, speed, throttle, rates_B=(0.0, 0.0, 0.0), failed=frozenset()):
    return propulsion.Meeting(np.array([speed, 0.0, 0.0]), np.array(rates_B), DENSITY,
                              propulsion.throttles(machine, throttle, failed))


def turned(machine, state, throttle, dt, steps, speed=0.0):
    for _ in range(steps):
        state = propulsion.advance(machine, state, met(machine, speed, throttle), dt)
    return state


# --- governed


@pytest.mark.parametrize('steps', [1, 7, 100])
def test_a_governed_shaft_follows_its_exponential_whatever_the_step(steps):
    machine = propellers.at_nose(drive=GOVERNOR)
    state = turned(machine, EngineState([200.0], [1.0]), 0.6, 0.5 / steps, steps)
    target = 0.6 * GOVERNOR.greatest_speed
    expected = target + (200.0 - target) * math.exp(-0.5 / GOVERNOR.spool_time)
    assert state.speed[0] == pytest.approx(expected, rel=1e-13)
    assert state.charge[0] == 1.0


# --- by a motor


def balance(drive, throttle, kq, battery=BATTERY):
    """Return where (I - I0)/Kv g = kq Omega^2, by the formula for a quadratic equation."""
    resistance = drive.resistance + throttle ** 2 * battery.resistance
    a, g = kq, drive.gear / drive.speed_constant
    b = g * g / resistance
    c = g * drive.no_load_current - g * throttle * battery.voltage / resistance
    return (-b + math.sqrt(b * b - 4.0 * a * c)) / (2.0 * a)


@pytest.mark.parametrize('throttle', [0.3, 1.0])
@pytest.mark.parametrize('gear', [1.0, 2.5])
def test_a_motor_settles_where_its_torque_is_the_propeller_s(throttle, gear):
    drive = dataclasses.replace(MOTOR, gear=gear)
    machine = propellers.at_nose(coefficients=FLAT, drive=drive)
    kq = DENSITY * 0.4 ** 5 * 0.04 / (2.0 * math.pi) ** 3
    expected = balance(drive, throttle, kq)
    state = propulsion.settled(machine, met(machine, 0.0, throttle))
    assert state.speed[0] == pytest.approx(expected, rel=1e-11)
    readings = propulsion.loads(machine, state, met(machine, 0.0, throttle)).readings
    # Of the battery's power the motor's resistance, its friction and the battery take a part.
    through = readings.current[0] / throttle
    lost = through ** 2 * MOTOR.resistance \
        + MOTOR.no_load_current * gear * expected / MOTOR.speed_constant
    assert readings.voltage[0] * readings.current[0] - lost == pytest.approx(
        readings.torque[0] * expected, rel=1e-11)
    assert readings.voltage[0] == pytest.approx(
        BATTERY.voltage - BATTERY.resistance * readings.current[0], rel=1e-13)
    # Switched on at rest it comes to the same; 2 s are many of its time constants.
    run_up = turned(machine, EngineState([0.0], [1.0]), throttle, 0.01, 200)
    assert run_up.speed[0] == pytest.approx(expected, rel=1e-9)


def test_the_way_of_a_shaft_is_of_second_order():
    """A throttle opened in flight, against an integrator with its tolerance at 1e-11."""
    smooth = Coefficients([0.0, 0.8], [0.10, 0.0], [0.045, 0.012])   # no corner on the way
    machine = propellers.at_nose(coefficients=smooth)
    engine, = machine.engines
    begin = propulsion.settled(machine, met(machine, 12.0, 0.3))
    exact = solve_ivp(
        lambda t, y: [propulsion.spin(engine, y[0], 12.0, DENSITY, 0.8, 1.0)], (0.0, 0.06),
        begin.speed, rtol=1e-11, atol=1e-9, method='LSODA').y[0, -1]
    assert exact > 1.5 * begin.speed[0]
    errors = [abs(turned(machine, begin, 0.8, 0.06 / n, n, 12.0).speed[0] - exact)
              for n in (8, 16, 32)]
    for coarse, fine in zip(errors, errors[1:]):
        assert math.log2(coarse / fine) == pytest.approx(2.0, abs=0.25)
    assert errors[0] < 2e-3 * exact
    # However long the step, it goes to the balance and not beyond.
    end = propulsion.settled(machine, met(machine, 12.0, 0.8)).speed[0]
    assert turned(machine, begin, 0.8, 10.0, 30, 12.0).speed[0] == pytest.approx(end, rel=1e-9)


def test_a_shut_motor_is_turned_by_the_air_until_its_friction_balances():
    machine = propellers.at_nose()
    state = propulsion.settled(machine, met(machine, 25.0, 0.0))
    readings = propulsion.loads(machine, state, met(machine, 25.0, 0.0)).readings
    assert state.speed[0] > 0.0 and readings.current[0] == 0.0
    assert readings.torque[0] == pytest.approx(
        -MOTOR.no_load_current / MOTOR.speed_constant, rel=1e-9)
    assert readings.thrust[0] < 0.0
    # It brakes with more power than it takes.
    assert -readings.thrust[0] * 25.0 > -readings.torque[0] * state.speed[0]
    assert not propulsion.settled(machine, met(machine, 0.0, 0.0)).speed.any()


def test_a_propeller_at_rest_has_neither_thrust_nor_torque_at_any_airspeed():
    engine = propellers.propeller()
    for axial in (-20.0, 0.0, 20.0):
        assert propulsion.of_air(engine, 0.0, axial, DENSITY) == (0.0, 0.0)
        # And it comes there without a jump.
        assert np.abs(propulsion.of_air(engine, 1e-6, axial, DENSITY)).max() < 1e-7


# --- batteries


def test_a_battery_gives_its_charge_at_the_rate_of_its_current():
    machine = propellers.at_nose()
    state = propulsion.settled(machine, met(machine, 12.0, 0.7))
    current = propulsion.loads(machine, state, met(machine, 12.0, 0.7)).readings.current[0]
    later = turned(machine, state, 0.7, 0.02, 500, 12.0)
    assert 1.0 - later.charge[0] == pytest.approx(10.0 * current / BATTERY.capacity, rel=1e-9)
    assert later.speed[0] == pytest.approx(state.speed[0], rel=1e-9)


def test_what_a_battery_has_lost_is_the_integral_of_its_current():
    """Also while voltage and speed change, by the trapezium rule of the readings."""
    small = dataclasses.replace(BATTERY, capacity=300.0, empty_voltage=18.0)
    machine = propellers.at_nose(drive=dataclasses.replace(MOTOR, battery=small))
    state, currents = EngineState([100.0], [1.0]), []
    for _ in range(200):
        meeting = met(machine, 8.0, 0.9)
        currents.append(propulsion.loads(machine, state, meeting).readings.current[0])
        state = propulsion.advance(machine, state, meeting, 0.01)
    currents.append(propulsion.loads(machine, state, met(machine, 8.0, 0.9)).readings.current[0])
    total = 0.01 * (sum(currents) - 0.5 * (currents[0] + currents[-1]))
    # The charge at a step's end is taken from the current at its begin: (dt)^2 again.
    assert 300.0 * (1.0 - state.charge[0]) == pytest.approx(total, rel=1e-5)
    assert currents[-1] < currents[50]   # the voltage sinks


def test_an_empty_battery_turns_nothing():
    tiny = dataclasses.replace(BATTERY, capacity=0.5)
    machine = propellers.at_nose(drive=dataclasses.replace(MOTOR, battery=tiny))
    state = turned(machine, EngineState([0.0], [1.0]), 1.0, 0.01, 300)
    readings = propulsion.loads(machine, state, met(machine, 0.0, 1.0)).readings
    assert state.charge[0] == 0.0 and readings.current[0] == 0.0
    assert state.speed[0] < 1.0   # friction has stopped it


def test_less_charge_means_less_voltage_and_speed():
    sinking = dataclasses.replace(BATTERY, empty_voltage=18.0)
    machine = propellers.at_nose(drive=dataclasses.replace(MOTOR, battery=sinking))
    meeting = met(machine, 10.0, 0.8)
    full, half = (propulsion.loads(machine, propulsion.settled(machine, meeting, np.array([c])),
                                   meeting).readings for c in (1.0, 0.5))
    assert full.speed[0] > half.speed[0]
    assert half.voltage[0] == pytest.approx(20.1 - 0.05 * half.current[0], rel=1e-12)


# --- energy and refusals


def test_the_shaft_s_power_is_never_less_than_the_thrust_s():
    """Over all airspeeds and speeds, between and beyond the rows too."""
    for table in (propellers.PLAIN, FLAT):
        engine = propellers.propeller(coefficients=table)
        for speed in np.linspace(10.0, 900.0, 12):
            for axial in np.linspace(-10.0, 90.0, 41):
                thrust, torque = propulsion.of_air(engine, speed, axial, DENSITY)
                assert torque * speed >= thrust * axial - 1e-9


def test_static_thrust_is_that_of_the_coefficient():
    """T = CT rho n^2 D^4: 100 turns a second of 0.4 m at CT 0.1."""
    engine = propellers.propeller()
    thrust, torque = propulsion.of_air(engine, 6000.0 * RPM, 0.0, 1.225)
    assert thrust == pytest.approx(0.1 * 1.225 * 100.0 ** 2 * 0.4 ** 4, rel=1e-12)
    assert torque == pytest.approx(
        0.045 * 1.225 * 100.0 ** 2 * 0.4 ** 5 / (2.0 * math.pi), rel=1e-12)


@pytest.mark.parametrize('make, message', [
    (lambda: Coefficients([0.0, 1.0], [0.1, 0.0], [0.05, 0.05, 0.05]), 'CT and CP must be within'),
    (lambda: Coefficients([0.0, 1.0], [0.1, -math.inf], [0.1, 0.05]), 'CT and CP must be within'),
    (lambda: Coefficients([0.0, 1.0], [0.1, 0.2], [0.05, 0.5]), 'CT must fall'),
    (lambda: Coefficients([0.0, 1.0], [0.1, 0.09], [0.05, 0.05]), 'more work than the shaft'),
    (lambda: Coefficients([0.0, 1.0], [0.1, 0.0], [0.0, 0.05]), 'CP must be above 0'),
    (lambda: Coefficients([0.5, 0.5], [0.1, 0.0], [0.1, 0.05]), 'advance ratio must be at least'),
    (lambda: dataclasses.replace(BATTERY, empty_voltage=23.0), 'at most the 22.2 V'),
    (lambda: dataclasses.replace(BATTERY, resistance=-1.0), 'resistance must be at least 0 Ohm'),
    (lambda: dataclasses.replace(MOTOR, gear=0.0), 'gear must be above 0'),
    (lambda: dataclasses.replace(GOVERNOR, spool_time=0.0), 'spool_time must be above 0 s'),
    (lambda: propellers.propeller(inertia=0.0), 'inertia of what a motor turns must be above 0'),
    (lambda: propellers.propeller(swirl=True), 'swirl is of a slipstream'),
    (lambda: Propeller(-1.0, FLAT, MOTOR, (0.0, 0.0, 0.0), inertia=1.0), 'diameter must be'),
    (lambda: propellers.propeller(diameter=400.0), 'diameter must be at most 100 m'),
    (lambda: propellers.trainer(propellers.propeller(name='left'),
                                propellers.propeller(name='left')), 'two engines are named left'),
])
def test_engines_that_cannot_be_are_refused(make, message):
    with pytest.raises(ConfigError, match=message):
        make()
