# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
Each parameter of the aerodynamics acts: with another value another flight, of the size it should.

A second of a hard pull from trim, by what a node declares and nothing else; the last test flies
over DDS.
"""

import dataclasses

import numpy as np
import pytest

pytest.importorskip('rclpy', reason='rclpy is not installed')

import rclpy
from nav_msgs.msg import Odometry
from processes import free_domain, nanoseconds
from std_srvs.srv import Trigger

from poststall_sim.ros import declaration, flight_setup
from poststall_sim.ros.air_settings import AirSettings
from poststall_sim.ros.parameters import SimulatorSettings

pytestmark = [pytest.mark.ros, pytest.mark.timeout(300)]

COARSE = {'uvlm.chordwise': 1, 'initial.airspeed': 12.0}
STEPS = 30
LOCAL, FREE = {'decambering.closure': 'local'}, {'uvlm.wake': 'free'}
SCHEME_A = {**LOCAL, 'decambering.scheme': 'A'}
FINE = {'uvlm.chordwise': 4}
NEAR_THE_GROUND = {'initial.altitude': 1.5}
LATE, FLOWN_LATE = {'separation.law': 'lag'}, {'separation.law': 'goman_khrabrov'}
PHYSICS, NUMERICS = (1e-3, np.inf), (1e-12, 0.05)
"""
By how much the lift coefficients of the strips may differ at the end of the second.

What says how the air is modelled is seen in the third decimal or before. What says how exactly
that is computed shows too, but in no more than 0.05 of lift coefficients that go up to 1.5.
"""
ACTS = {
    'uvlm.chordwise': (2, {}, PHYSICS),
    'uvlm.spanwise': (8, {}, PHYSICS),
    'uvlm.wake_length': (0.5, {}, PHYSICS),
    'uvlm.core': (0.2, {}, (1e-9, np.inf)),
    'uvlm.wake': ('free', {}, PHYSICS),
    'uvlm.free_rows': (1, FREE, (1e-6, np.inf)),
    'uvlm.free_every': (7, FREE, (1e-6, np.inf)),
    'uvlm.precision': ('float64', {}, NUMERICS),
    'uvlm.coarsen': (False, {}, NUMERICS),
    'uvlm.interpolate': (False, FINE, NUMERICS),
    'ground.effect': (True, NEAR_THE_GROUND, PHYSICS),
    'decambering.enabled': (False, {}, PHYSICS),
    'decambering.closure': ('local', {}, PHYSICS),
    'decambering.ell': (2.0, {}, PHYSICS),
    'decambering.scheme': ('A', LOCAL, (1e-9, np.inf)),
    'decambering.relaxation': (0.3, SCHEME_A, (1e-9, np.inf)),
    'decambering.angle_form': ('linear', {}, PHYSICS),
    'decambering.start': ('attached', SCHEME_A, (1e-12, np.inf)),
    'decambering.tolerance': (1e-3, {}, NUMERICS),
    'decambering.max_iterations': (2, SCHEME_A, (1e-9, np.inf)),
    'separation.law': ('lag', {}, PHYSICS),
    'separation.lag': (8.0, LATE, PHYSICS),
    'separation.relaxation': (5.0, FLOWN_LATE, PHYSICS),
    'separation.delay': (0.0, FLOWN_LATE, PHYSICS),
}


@pytest.fixture(scope='module')
def declared():
    """Return a function of parameters that gives the flight of a node that has them."""
    context = rclpy.Context()
    context.init(args=[], domain_id=free_domain())

    def flight(given):
        node = rclpy.create_node('simulator', context=context, cli_args=['--ros-args', *(
            part for each in arguments(given) for part in each)])
        try:
            settings, air = declaration.declare_all(node, SimulatorSettings, AirSettings)
        finally:
            node.destroy_node()
        return flight_setup.flight_from_settings(settings, air, [].append)
    yield flight
    context.try_shutdown()


def arguments(given):
    return [('-p', f'{name}:={str(value).lower() if isinstance(value, bool) else value}')
            for name, value in given.items()]


def pulled(flight):
    """Fly with the stick back and return the flight."""
    deflections = flight.trim.deflections.copy()
    deflections[flight.model.aircraft.control_names.index('elevator')] -= 0.3
    for _ in range(STEPS):
        flight.step(dataclasses.replace(flight.trim, deflections=deflections))
    assert flight.paused_reason is None
    return flight


@pytest.fixture(scope='module')
def before(declared):
    """Return a function of parameters that gives their flight, each flown once."""
    flown = {}

    def of(given):
        key = tuple(sorted(given.items()))
        if key not in flown:
            flown[key] = pulled(declared({**COARSE, **given})).snapshot
        return flown[key]
    return of


def test_every_parameter_of_the_aerodynamics_is_in_the_table():
    assert ACTS.keys() == {
        name for field in dataclasses.fields(SimulatorSettings)
        for name in [field.metadata['name']]
        if name.startswith(('uvlm.', 'ground.', 'decambering.', 'separation.'))}


@pytest.mark.parametrize('name', ACTS)
def test_another_value_makes_another_flight(name, declared, before):
    value, where_it_acts, (least, most) = ACTS[name]
    one, other = before(where_it_acts), pulled(declared(
        {**COARSE, **where_it_acts, name: value})).snapshot
    if name == 'uvlm.spanwise':
        assert other.strips.cl.size == 8 * 3 != one.strips.cl.size   # wing, tail and fin
        return
    if name == 'uvlm.chordwise':   # the step is half as long, by itself
        assert other.time_ns == pytest.approx(0.5 * one.time_ns, rel=0.1)
    change = np.abs(other.strips.cl - one.strips.cl).max()
    assert least < change < most


def test_over_dds_the_flight_is_that_of_its_parameters(start, probe, declared):
    given = {**COARSE, **NEAR_THE_GROUND, **LATE, 'ground.effect': True, 'uvlm.wake': 'free',
             'uvlm.free_rows': 4, 'uvlm.free_every': 3, 'uvlm.precision': 'float64',
             'uvlm.coarsen': False, 'uvlm.interpolate': False, 'separation.lag': 8.0,
             'decambering.ell': 0.5, 'step_count': STEPS}
    start('simulator', ros=['-p', 'start_paused:=true', *(
        part for each in arguments(given) for part in each)]).wait_for('ready')
    odoms = probe.collect(Odometry, 'odom')
    assert probe.call(Trigger, 'step').success
    flight = declared(given)
    for _ in range(STEPS):
        flight.step(flight.trim)
    time_ns = flight.snapshot.time_ns
    probe.spin_until(lambda: odoms and nanoseconds(odoms[-1].header.stamp) == time_ns,
                     'the last step')
    found, body = odoms[-1], flight.snapshot.body
    place, speed = found.pose.pose.position, found.twist.twist.linear
    assert (place.y, place.x, -place.z) == tuple(body.position_N)
    assert (speed.x, -speed.y, -speed.z) == tuple(body.velocity_B)
