# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Failures in words, and actuators, stops and failures in files."""

import argparse
import math

import pytest
import wings

from poststall_sim import control_reader, failure_reader, option_values
from poststall_sim.actuators import IDEAL, Actuator
from poststall_sim.aircraft import ConfigError
from poststall_sim.failures import Failure, Kind
from poststall_sim.reader import Place, Reader
from poststall_sim.scenario import Fault

DEG = math.radians(1.0)
PLACE = Place('plane.yaml', 'controls.elevator')
TAIL = wings.panel_wing(wings.potential(), [(0, 0, 0), (0, 1, 0)], [1, 1], 2, symmetric=True,
                        name='tail')


def control(actuator=None, **effector):
    """Return a control as read from a file."""
    given = {'limits_deg': [-20, 15],
             'effectors': [{'surface': 'tail', 'hinge': 0.7, **effector}]}
    if actuator is not None:
        given['actuator'] = actuator
    return control_reader.control(Reader(given, PLACE), 'elevator', (TAIL,))


def test_words_and_failures_are_each_others_inverse():
    words = ['elevator:stuck', 'aileron_right:stuck=-5', 'rudder:float', 'flap:lost', 'left:off']
    found = failure_reader.failures(words)
    assert found['aileron_right'] == Failure(Kind.STUCK, -5.0 * DEG)
    assert found['rudder'] == Failure(Kind.FLOATING)
    assert failure_reader.words(found) == words


@pytest.mark.parametrize(('word', 'message'), [
    ('elevator', 'a failure is NAME:KIND'), (':stuck', 'a failure is NAME:KIND'),
    ('elevator:stock', 'must be one of stuck, float, lost, off; did you mean stuck'),
    ('elevator:stuck=up', 'the angle must be a number of degrees'),
    ('elevator:stuck=nan', 'the angle must be a number of degrees'),
    ('elevator:stuck=95', 'within -90 to 90 deg, got 95'),
    ('elevator:float=3', 'float has no angle')])
def test_words_that_say_no_failure_are_refused(word, message):
    with pytest.raises(ConfigError, match=message):
        failure_reader.failure(word)
    with pytest.raises(argparse.ArgumentTypeError, match=message):
        option_values.fault(word)


def test_option_has_a_time():
    assert option_values.fault('elevator:stuck=-5@8.5') == Fault(
        8.5, 'elevator', Failure(Kind.STUCK, -5.0 * DEG))
    assert option_values.fault('rudder:float').time == 0.0
    assert option_values.failure('rudder:float') == ('rudder', Failure(Kind.FLOATING))
    with pytest.raises(argparse.ArgumentTypeError, match='a trim has no time'):
        option_values.failure('rudder:lost@3')
    for word, message in (('rudder:float@soon', 'expected a number'),
                          ('rudder:float@-1', 'at least 0 s')):
        with pytest.raises(argparse.ArgumentTypeError, match=message):
            option_values.fault(word)
    with pytest.raises(ConfigError, match='rudder fails twice'):
        failure_reader.failures(['rudder:float', 'rudder:lost'])


def test_scenario_file_says_what_fails():
    def fault(**keys):
        return failure_reader.fault(Reader(keys, Place('s.yaml', 'failures[0]')))

    assert fault(time_s=3, name='elevator', kind='stuck', angle_deg=-5) == Fault(
        3.0, 'elevator', Failure(Kind.STUCK, -5.0 * DEG))
    assert fault(time_s=3, name='elevator', kind='float').failure == Failure(Kind.FLOATING)
    with pytest.raises(ConfigError, match=r's.yaml: failures\[0\].kind: must be one of stuck'):
        fault(time_s=3, name='elevator', kind='jammed')
    with pytest.raises(ConfigError, match=r's.yaml: failures\[0\]: lost has no angle'):
        fault(time_s=3, name='elevator', kind='lost', angle_deg=3)


def test_aircraft_file_says_what_drives_a_control_and_where_it_stops():
    assert control().actuator == IDEAL
    assert control().effectors[0].stops == (-math.inf, math.inf)
    assert control(limits_deg=[-10, 5]).effectors[0].stops == (-10.0 * DEG, 5.0 * DEG)
    assert control({'rate_limit_deg_s': 300, 'time_constant_s': 0.05}).actuator == Actuator(
        rate_limit=300.0 * DEG, time_constant=0.05)
    assert control({'natural_frequency_rad_s': 50, 'damping': 0.7, 'dead_time_s': 0.02}
                   ).actuator == Actuator(natural_frequency=50.0, damping=0.7, dead_time=0.02)


@pytest.mark.parametrize(('actuator', 'message'), [
    ({'rate_limit_deg_s': 0}, 'actuator.rate_limit_deg_s: must be above 0, got 0'),
    ({'natural_frequency_rad_s': 50}, 'actuator: key damping must be there'),
    ({'time_constant': 0.1}, 'unknown key time_constant with value 0.1; did you mean time_cons'),
    ({'time_constant_s': 0.1, 'natural_frequency_rad_s': 9, 'damping': 1}, 'not both'),
    ({'dead_time_s': 5}, 'actuator: dead time must be 0 to 1 s, got 5'),
    (300, 'actuator: must be a mapping')])
def test_actuators_that_a_file_has_wrong_are_refused_with_their_place(actuator, message):
    with pytest.raises(ConfigError, match=f'^plane.yaml: controls.elevator.*{message}'):
        control(actuator)
    with pytest.raises(ConfigError, match=r'effectors\[0\]: stops must satisfy'):
        control(limits_deg=[2, 5])
