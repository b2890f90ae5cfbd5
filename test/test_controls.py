# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Mixing: movable parts that several controls turn, their names, stops and moments."""

import math

import numpy as np
import pytest
import wings

from poststall_sim.aero import solver
from poststall_sim.aero.model import Settings, build
from poststall_sim.aircraft import ConfigError
from poststall_sim.controls import Control, Effector, movables

DEG = math.radians(1.0)
BOTH = (-20.0 * DEG, 20.0 * DEG)


def elevons(stops=(-math.inf, math.inf)):
    """Return elevator and aileron on the same outer parts of a wing."""
    outer = {'surface': 'wing', 'span': (0.4, 1.0), 'hinge': 0.75}
    return (Control('elevator', BOTH, (Effector(**outer, stops=stops),)),
            Control('aileron', BOTH, (
                Effector(**outer, side=1, gain=-1.0), Effector(**outer, side=-1, gain=1.0))))


def flying_wing(controls):
    foil = wings.potential()
    wing = wings.panel_wing(foil, [(0, 0, 0), (1.5, 3, 0)], [1.0, 0.6], 12, symmetric=True)
    return wings.aircraft([wing], foil, area=4.8, chord=0.8, span=6.0, cg_G=(0.8, 0.0, 0.0),
                          controls=controls)


def moments(machine, deflections):
    """Return roll right, nose up, nose right (3,) that deflections [deg] add at alpha 3 deg."""
    model = build(machine, Settings(chordwise=4, unsteady=False))
    air = wings.onset(20.0, 3.0 * DEG)
    found = [solver.steady(model, air, DEG * np.array(each, dtype=float),
                           density=wings.DENSITY).moment_G * [-1.0, 1.0, -1.0]
             for each in (deflections, np.zeros(len(deflections)))]
    return found[0] - found[1]


def test_controls_that_name_the_same_part_turn_it_together():
    parts, mixing = movables(elevons(), ['wing'])
    assert [part.names for part in parts] == [
        ('elevator_right', 'aileron_right'), ('elevator_left', 'aileron_left')]
    assert mixing.tolist() == [[1.0, -1.0], [1.0, 1.0]]
    assert parts[0].travel == pytest.approx((-40.0 * DEG, 40.0 * DEG))


def test_a_hinge_of_its_own_makes_a_part_of_its_own():
    """And on a symmetric surface its left half turns about the mirror image: no roll."""
    outer = {'surface': 'wing', 'span': (0.4, 1.0), 'hinge': 0.75}
    controls = (Control('elevator', BOTH, (Effector(**outer, hinge_axis=(0.3, 1.0, 0.1)),)),
                Control('flap', BOTH, (Effector(**outer),)))
    assert len(movables(controls, ['wing'])[0]) == 4
    by_axis, by_line = (moments(flying_wing(controls), each) for each in ([5, 0], [0, 5]))
    assert by_axis[1] < 0.0 and by_axis[1] != pytest.approx(by_line[1], rel=1e-3)
    assert abs(by_axis[0]) < 1e-9 * abs(by_axis[1])


def test_elevons_pitch_and_roll():
    """Trailing edges down: nose down, no roll. Aileron: right up, left down: roll to the right."""
    machine = flying_wing(elevons())
    pitch, roll = moments(machine, [5, 0]), moments(machine, [0, 5])
    assert pitch[1] < 0.0 and abs(pitch[0]) < 1e-9 * abs(pitch[1])
    assert roll[0] > 0.0 and abs(roll[1]) < 0.02 * roll[0]


def test_flaperons_lift_and_roll():
    outer = {'surface': 'wing', 'span': (0.4, 1.0), 'hinge': 0.75}
    machine = flying_wing((
        Control('flap', (0.0, 20.0 * DEG), (Effector(**outer),)),
        Control('aileron', BOTH, (Effector(**outer, side=1, gain=-0.5),
                                  Effector(**outer, side=-1, gain=0.5)))))
    assert [part.name for part in machine.movables] == ['flap_right', 'flap_left']
    model = build(machine, Settings(unsteady=False))
    lift = [wings.steady(model, 20.0, deflections=DEG * np.array(each)).force_G[2]
            for each in ([0.0, 0.0], [10.0, 0.0], [10.0, 10.0])]
    # The sine of 5 and 15 deg is not quite twice that of 10.
    assert lift[1] > lift[0] + 1.0 and lift[2] == pytest.approx(lift[1], rel=5e-3)
    assert moments(machine, [10, 10])[0] > 0.0


def test_v_tail_pitches_and_yaws():
    """
    A V of 35 deg. Elevator: both trailing edges down, nose down. Rudder: trailing edges left.

    On the right half, whose suction side faces up and left, that is up; so nose left.
    """
    foil = wings.potential()
    tail = wings.panel_wing(
        foil, [(4, 0, 0), (4.1, math.cos(35 * DEG), math.sin(35 * DEG))], [0.6, 0.4], 8,
        symmetric=True, name='tail')
    whole = {'surface': 'tail', 'hinge': 0.65}
    machine = wings.aircraft([tail], foil, area=1.0, chord=0.5, span=2.0, controls=(
        Control('elevator', BOTH, (Effector(**whole),)),
        Control('rudder', BOTH, (Effector(**whole, side=1, gain=-1.0),
                                 Effector(**whole, side=-1, gain=1.0)))))
    pitch, yaw = moments(machine, [5, 0]), moments(machine, [0, 5])
    assert pitch[1] < 0.0 and np.abs(pitch[[0, 2]]).max() < 1e-9 * abs(pitch[1])
    assert yaw[2] < 0.0 and abs(yaw[1]) < 0.02 * abs(yaw[2])


def test_parts_stop_where_their_controls_together_would_go_further():
    """Elevator -20 and aileron 20: the right elevon would go to -40 and stops at -25 deg."""
    machine = flying_wing(elevons((-25.0 * DEG, 25.0 * DEG)))
    lattice = build(machine).lattice
    assert lattice.angles(DEG * np.array([-20.0, 20.0])) / DEG == pytest.approx([-25.0, 0.0])
    assert lattice.angles(DEG * np.array([5.0, 10.0])) / DEG == pytest.approx([-5.0, 15.0])
    # The loads are those of the angles that are reached, here of -12.5 - 12.5 and -12.5 + 12.5.
    stopped, same = moments(machine, [-20, 20]), moments(machine, [-12.5, 12.5])
    assert stopped == pytest.approx(same, rel=1e-9)
    # What is at its stop has no derivative, the other part still has.
    assert lattice.angle_rate(DEG * np.array([-20.0, 20.0])).tolist() == [[0.0, 0.0], [1.0, 1.0]]


def test_stops_of_one_part_are_the_narrowest():
    controls = (Control('a', BOTH, (Effector('fin', stops=(-0.2, 0.3)),)),
                Control('b', BOTH, (Effector('fin', stops=(-0.3, 0.1)),)))
    (part,), _ = movables(controls, [])
    assert part.names == ('a', 'b') and part.stops == (-0.2, 0.1)


def test_several_parts_of_a_control_on_one_side_are_counted():
    flap = Control('flap', BOTH, (Effector('wing', (0.1, 0.4)), Effector('wing', (0.5, 0.8))))
    parts, _ = movables((flap,), ['wing'])
    assert [part.name for part in parts] == [
        'flap_right', 'flap_left', 'flap_right_2', 'flap_left_2']
    # A part is never called what another control is called.
    right = Control('flap_right', BOTH, (Effector('tail'),))
    names = [part.name for part in movables((flap, right), ['wing'])[0]]
    assert len(set(names)) == 5 and names[-1] == 'flap_right'


@pytest.mark.parametrize('stops', [(0.1, 0.2), (-0.2, -0.1), (0.0, 0.0), (math.nan, 0.1)])
def test_stops_without_neutral_between_them_are_refused(stops):
    with pytest.raises(ConfigError, match='stops must satisfy low <= 0 <= high'):
        Effector('wing', stops=stops)
