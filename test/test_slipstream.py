# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Slipstream: momentum theory in closed form, and what stands in the stream."""

import dataclasses
import math

import numpy as np
import propellers
import pytest
import wings

from poststall_sim import slipstream
from poststall_sim.aero import lattice as lattices
from poststall_sim.aero import model as models
from poststall_sim.aero import solver
from poststall_sim.controls import Control, Effector
from poststall_sim.engines import Rotation
from poststall_sim.slipstream import Stream, induced_velocity

AFT = np.array([1.0, 0.0, 0.0])
RADIUS = 0.2
AREA = math.pi * RADIUS ** 2


def stream(**changes):
    return Stream(**{'arm_G': np.zeros(3), 'aft_G': AFT, 'radius': RADIUS, 'along': 12.0,
                     'induced': 3.0, 'turning': 0.0, 'width': 1e-4, **changes})


@pytest.mark.parametrize('along', [0.0, 5.0, 20.0])
@pytest.mark.parametrize('thrust', [-3.0, 0.5, 30.0])
def test_thrust_is_mass_flow_times_what_the_stream_gains(along, thrust):
    w = induced_velocity(thrust, along, wings.DENSITY, RADIUS)
    if thrust < 0.0 and along < 10.0:   # it brakes more than a wake can bear
        assert w == pytest.approx(-along / 3.0)
    else:
        assert 2.0 * wings.DENSITY * AREA * (along + w) * w == pytest.approx(thrust, rel=1e-12)
    if along == 0.0 and thrust > 0.0:
        assert w == pytest.approx(math.sqrt(thrust / (2.0 * wings.DENSITY * AREA)), rel=1e-14)


def across(found, x, n=4000):
    """Return radii and the increments there (n, 3), in the plane y = 0 at x behind the disc."""
    r = (np.arange(n) + 0.5) * 2.0 * RADIUS / n
    return r, found.at(np.column_stack([np.full(n, x), np.zeros(n), r]))


@pytest.mark.parametrize('along, induced', [(0.0, 8.0), (12.0, 3.0), (12.0, -3.0)])
def test_far_behind_the_stream_carries_the_thrust_and_the_torque(along, induced):
    found = stream(along=along, induced=induced, turning=-30.0)
    r, more = across(found, 100.0)
    ring = 2.0 * math.pi * r * (r[1] - r[0])
    flow = wings.DENSITY * (along + more[:, 0]) * ring
    thrust = 2.0 * wings.DENSITY * AREA * (along + induced) * induced
    torque = wings.DENSITY * (along + induced) * 0.5 * math.pi * RADIUS ** 4 * 30.0
    # Rings of 1/1000 of the tube, of which the edge cuts one.
    assert np.sum(flow * more[:, 0]) == pytest.approx(thrust, rel=3e-3)
    # Above the axis, z up and x aft, what turns about -x moves to +y: clockwise from behind.
    assert np.sum(flow * more[:, 1] * r) == pytest.approx(torque, rel=5e-3)
    assert not more[:, 2].any()


def test_the_stream_contracts_as_it_gains_speed():
    found = stream(induced=9.0)
    for x in (0.0, 0.1, 0.4, 5.0):
        r, more = across(found, x)
        inside = more[:, 0] > 0.0
        speed = 12.0 + more[0, 0]
        assert speed == pytest.approx(12.0 + 9.0 * (1.0 + x / math.hypot(x, RADIUS)), rel=1e-12)
        assert r[inside].max() == pytest.approx(
            RADIUS * math.sqrt(21.0 / speed), abs=1.5 * (r[1] - r[0]))
        # The same all over, but for the one that the edge cuts.
        assert more[inside][:-1, 0] == pytest.approx(more[0, 0], rel=1e-12)
    assert not found.at(np.array([[-0.3, 0.0, 0.1]]))[0, 1:].any()


@pytest.mark.parametrize('width, radius', [(0.05, RADIUS), (0.1, RADIUS), (0.3, 0.1)])
def test_a_strip_feels_the_share_of_it_that_the_tube_covers(width, radius):
    """Strips side by side across the axis feel together what the tube is wide."""
    found = stream(width=width, radius=radius, induced=1e-9)   # hardly contracts
    for shift in np.linspace(0.0, width, 7):
        y = np.arange(-20, 21) * width + shift
        felt = found.at(np.column_stack([np.zeros(41), y, np.zeros(41)]))[:, 0] / 1e-9
        assert np.sum(felt) * width == pytest.approx(2.0 * radius, rel=1e-9)
    # And no strip jumps as it moves.
    y = np.linspace(0.0, 1.0, 2001)
    felt = found.at(np.column_stack([np.zeros(2001), y, np.zeros(2001)]))[:, 0] / 1e-9
    assert np.abs(np.diff(felt)).max() <= 0.0005 / width * 1.001


# --- what stands in it


def tail_alone():
    """Return a tail with an elevator 4 m behind a big disc, well inside its stream."""
    tail = wings.panel_wing(wings.potential(), [(0, 0, 0), (0, 0.5, 0)], [0.3, 0.3], 8,
                            symmetric=True, name='tail')
    elevator = Control('elevator', (-0.5, 0.5), (Effector('tail', hinge=0.6),))
    machine = wings.aircraft([tail], wings.potential(), area=0.3, chord=0.3, span=1.0,
                             cg_G=(-1.0, 0.0, 0.0), controls=(elevator,))
    return dataclasses.replace(machine, engines=(propellers.propeller(
        diameter=2.4, position_G=(-4.0, 0.0, 0.0), drive=propellers.GOVERNOR, slipstream=True),))


def loads(machine, model, speed, throttle, elevator):
    push = wings.push(machine, [speed, 0.0, 0.0], throttle)
    streams = slipstream.streams(machine, model.lattice, push.readings, wings.DENSITY)
    air = dataclasses.replace(wings.onset(speed), gust=slipstream.blown(streams))
    return solver.steady(model, air, np.array([elevator]), density=wings.DENSITY), streams


@pytest.mark.parametrize('speed', [0.0, 10.0])
def test_an_elevator_in_the_stream_gains_by_the_dynamic_pressure(speed):
    """Without any airspeed as well: there it is the stream's alone."""
    machine = tail_alone()
    model = models.build(machine)
    blown, (found,) = loads(machine, model, speed, 0.1, 0.1)
    faster = speed + found.at(model.quarter_arm)[0, 0]
    assert faster > speed + 8.0
    free, _ = loads(dataclasses.replace(machine, engines=()), model, faster, 0.0, 0.1)
    assert blown.force_G[2] > 1.0
    # The stream still gains 0.1 % along the tail, 4 m behind a disc of 1.2 m.
    assert blown.force_G[2] == pytest.approx(free.force_G[2], rel=4e-3)
    assert blown.moment_G[1] == pytest.approx(free.moment_G[1], rel=4e-3)
    still, _ = loads(machine, model, speed, 0.1, 0.0)
    assert abs(still.force_G[2]) < 1e-9


@pytest.mark.parametrize('rotation, side', [
    (Rotation.CLOCKWISE, 1.0), (Rotation.COUNTERCLOCKWISE, -1.0)])
def test_swirl_pushes_a_fin_above_the_axis_the_way_the_propeller_turns(rotation, side):
    """Clockwise from behind the air above goes to the right, the tail with it, the nose left."""
    machine = propellers.at_nose(slipstream=True, swirl=True, rotation=rotation, diameter=0.6)
    model = models.build(machine)
    push = wings.push(machine, [12.0, 0.0, 0.0], 0.6)
    streams = slipstream.streams(machine, model.lattice, push.readings, wings.DENSITY)
    fin = next(grid.strips for grid in model.lattice.grids if grid.name == 'fin')
    sideways = slipstream.blown(streams)(model.quarter_arm[fin])[:, 1]
    assert (side * sideways >= 0.0).all() and side * sideways.sum() > 0.5
    air = dataclasses.replace(wings.onset(12.0), gust=slipstream.blown(streams))
    result = solver.steady(model, air, np.zeros(3), density=wings.DENSITY)
    assert -result.moment_G[2] * side < -0.1   # about z down: to the left is negative
    # And the wing takes back some of the torque.
    assert -result.moment_G[0] * side > 0.0


def test_slipstream_comes_on_top_of_gusts_and_off_means_none():
    machine = propellers.at_nose(slipstream=True)
    lattice = lattices.build(machine, 2)
    readings = wings.push(machine, [12.0, 0.0, 0.0], 0.5).readings
    found = slipstream.streams(machine, lattice, readings, wings.DENSITY)
    points = np.array([[1.0, 0.0, 0.05], [1.0, 2.0, 0.0]])

    def gust(arm_G):
        return np.full(arm_G.shape, 0.5)

    both = slipstream.blown(found, gust)(points)
    assert both == pytest.approx(found[0].at(points) + 0.5)
    assert both[1].tolist() == [0.5, 0.5, 0.5] and both[0, 0] > 1.0
    assert slipstream.blown([], gust) is gust and slipstream.blown([]) is None
    quiet = propellers.at_nose()
    assert not slipstream.streams(quiet, lattice, readings, wings.DENSITY)
    shut = dataclasses.replace(readings, thrust=np.zeros(1), axial=np.zeros(1))
    assert not slipstream.streams(machine, lattice, shut, wings.DENSITY)
