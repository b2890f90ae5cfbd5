# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
The services of simulation_interfaces, held to its definitions.

Where that package is not installed, `stand_ins` has its fields and constants. A stand-in has no
type support and cannot be offered over DDS: the simulator is a real node, and what it would offer
is kept and called as rclpy would. That nothing is offered without the package, see
`test_optional`.
"""

import gc
import importlib
import math
import sys
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip('rclpy', reason='rclpy is not installed')

import rclpy
from processes import free_domain

from poststall_sim.ros import optional
from poststall_sim.ros.commands import Source
from poststall_sim.ros.simulator import SimulatorNode

pytestmark = [pytest.mark.ros, pytest.mark.timeout(300)]

STAND_INS = str(Path(__file__).resolve().parent / 'stand_ins')
EAST = ['-p', 'start_paused:=true', '-p', 'uvlm.chordwise:=1',
        '-p', 'initial.euler_deg:=[0.0, 0.0, 90.0]']


class Simulator(SimulatorNode):
    """The simulator, its services of simulation_interfaces kept instead of offered."""

    def create_service(self, srv_type, srv_name, callback, **options):
        if not srv_type.__module__.startswith(optional.INTERFACES):
            return super().create_service(srv_type, srv_name, callback, **options)
        self.__dict__.setdefault('offered', {})[srv_name] = (srv_type, callback)
        return None

    def call(self, name, **fields):
        """Call a service with fields of its request, and return the answer."""
        kind, callback = self.offered[name]
        request = kind.Request()
        for field, value in fields.items():
            setattr(request, field, value)
        return callback(request, kind.Response())

    def time_steps(self):
        return self.flight.snapshot.time_ns / self.flight.dt_ns


@pytest.fixture(scope='module')
def package():
    """Return the modules msg and srv of the package, or of what stands in for it."""
    before = list(sys.path)
    if optional.INTERFACES in optional.missing():
        sys.path.insert(0, STAND_INS)
    yield tuple(importlib.import_module(f'{optional.INTERFACES}.{part}')
                for part in ('msg', 'srv'))
    sys.path[:] = before
    if STAND_INS not in before:
        for name in [each for each in sys.modules if each.startswith(optional.INTERFACES)]:
            if (sys.modules[name].__file__ or '').startswith(STAND_INS):
                del sys.modules[name]


@pytest.fixture(scope='module')
def make(package):
    """Return a function of ROS arguments that makes a simulator in a graph of its own."""
    made = []

    def opened(*arguments):
        context = rclpy.Context()
        context.init(args=[], domain_id=free_domain())
        node = Simulator(context=context, cli_args=['--ros-args', *EAST, *arguments])
        made.append((node, context))
        return node
    yield opened
    for node, context in made:
        node.destroy_node()
        context.try_shutdown()
    gc.unfreeze()   # a simulator has a process of its own, where all that exists stays


@pytest.fixture(scope='module')
def flown(make):
    return make()


@pytest.fixture
def node(flown, package):
    """Return a simulator that is paused at its start and at time 0."""
    flown.operations.pause(True)
    flown.operations.reset(to_zero=True)
    return flown


def result(answer):
    return answer.result.result


def test_all_that_is_offered_and_what_it_says_it_can_do(node, package):
    features = package[0].SimulatorFeatures
    assert node.offered.keys() == {
        'get_simulator_features', 'get_simulation_state', 'set_simulation_state',
        'reset_simulation', 'step_simulation', 'get_entity_state', 'set_entity_state'}
    assert set(node.call('get_simulator_features').features.features) == {
        features.ENTITY_STATE_GETTING, features.ENTITY_STATE_SETTING,
        features.SIMULATION_RESET, features.SIMULATION_RESET_TIME,
        features.SIMULATION_RESET_STATE, features.SIMULATION_STATE_GETTING,
        features.SIMULATION_STATE_SETTING, features.SIMULATION_STATE_PAUSE,
        features.STEP_SIMULATION_SINGLE, features.STEP_SIMULATION_MULTIPLE}


def test_states_and_the_ways_between_them(node, package):
    msg, srv = package
    states, ok = msg.SimulationState, msg.Result.RESULT_OK
    already = srv.SetSimulationState.Response.ALREADY_IN_TARGET_STATE

    def ask(state):
        wanted = states()
        wanted.state = state
        return node.call('set_simulation_state', state=wanted)

    def now():
        answer = node.call('get_simulation_state')
        assert result(answer) == ok
        return answer.state.state

    assert now() == states.STATE_PAUSED
    assert result(ask(states.STATE_PAUSED)) == already
    assert result(ask(states.STATE_PLAYING)) == ok and now() == states.STATE_PLAYING
    assert not node.paused
    assert result(ask(states.STATE_PLAYING)) == already
    # Stopped is paused and reset with all: where it began, at time 0.
    begun = node.flight.snapshot.body.position_N
    node.advance(5)
    assert result(ask(states.STATE_STOPPED)) == ok and now() == states.STATE_STOPPED
    assert node.paused and node.time_steps() == 0
    assert np.array_equal(node.flight.snapshot.body.position_N, begun)
    assert result(ask(states.STATE_STOPPED)) == already
    assert result(node.call('step_simulation')) == ok and now() == states.STATE_PAUSED
    assert result(ask(states.STATE_STOPPED)) == ok
    assert result(ask(states.STATE_PAUSED)) == ok and now() == states.STATE_PAUSED
    assert node.time_steps() == 0
    for state in (states.STATE_QUITTING, states.STATE_INITIALIZING):
        refused = ask(state)
        assert result(refused) == msg.Result.RESULT_FEATURE_UNSUPPORTED
        assert refused.result.error_message and now() == states.STATE_PAUSED


def test_what_lies_on_the_ground_does_not_play_until_it_is_reset(node, package):
    msg, srv = package
    place = node.call('get_entity_state', entity='trainer').state
    place.pose.position.z, place.twist.linear.z = 0.2, -5.0
    assert result(node.call('set_entity_state', entity='trainer',
                            state=place)) == msg.Result.RESULT_OK
    stepped = node.call('step_simulation', steps=100)
    assert result(stepped) == msg.Result.RESULT_OPERATION_FAILED
    assert 'ground' in stepped.result.error_message and node.time_steps() < 100
    playing = msg.SimulationState()
    playing.state = playing.STATE_PLAYING
    refused = node.call('set_simulation_state', state=playing)
    assert result(refused) == srv.SetSimulationState.Response.STATE_TRANSITION_ERROR
    assert 'ground' in refused.result.error_message and node.paused
    scopes = srv.ResetSimulation.Request
    # Time alone does not take it from where it lies.
    assert result(node.call('reset_simulation', scope=scopes.SCOPE_TIME)) == msg.Result.RESULT_OK
    assert node.time_steps() == 0 and 'ground' in node.flight.paused_reason
    assert result(node.call('reset_simulation', scope=scopes.SCOPE_STATE)) == msg.Result.RESULT_OK
    assert result(node.call('set_simulation_state', state=playing)) == msg.Result.RESULT_OK


def test_steps_are_those_that_were_asked_for_and_only_of_what_is_paused(node, package):
    results = package[0].Result
    assert result(node.call('step_simulation')) == results.RESULT_OK
    assert node.time_steps() == 1
    assert result(node.call('step_simulation', steps=4)) == results.RESULT_OK
    assert node.time_steps() == 5 and node.paused
    refused = node.call('step_simulation', steps=optional.MOST_STEPS + 1)
    assert result(refused) == results.RESULT_OPERATION_FAILED
    assert str(optional.MOST_STEPS) in refused.result.error_message
    node.operations.pause(False)
    refused = node.call('step_simulation')
    assert result(refused) == results.RESULT_OPERATION_FAILED
    assert 'pause' in refused.result.error_message and node.time_steps() == 5


@pytest.mark.parametrize('permitted', [False, True])
def test_a_reset_takes_back_what_its_scope_names_and_nothing_else(node, package, permitted):
    """Whatever reset.time says: that is for the service `reset`, which has no scope."""
    msg, srv = package
    scopes, ok = srv.ResetSimulation.Request, msg.Result.RESULT_OK
    node.set_parameters([rclpy.parameter.Parameter('reset.time', value=permitted)])
    begun = node.flight.snapshot.body.position_N.copy()
    for scope, time, state in (
            (scopes.SCOPE_STATE, False, True), (scopes.SCOPE_TIME, True, False),
            (scopes.SCOPE_TIME | scopes.SCOPE_STATE, True, True),
            (scopes.SCOPE_DEFAULT, True, True), (scopes.SCOPE_ALL, True, True),
            (scopes.SCOPE_SPAWNED, None, None),
            (scopes.SCOPE_TIME | scopes.SCOPE_SPAWNED, None, None)):
        node.operations.reset(to_zero=True)
        node.call('step_simulation', steps=5)
        before = node.flight.snapshot
        assert not np.array_equal(before.body.position_N, begun)
        answer = node.call('reset_simulation', scope=scope)
        after = node.flight.snapshot
        if time is None:
            assert result(answer) == msg.Result.RESULT_FEATURE_UNSUPPORTED
            assert answer.result.error_message and after is before
            continue
        assert result(answer) == ok and node.paused
        assert after.time_ns == (0 if time else before.time_ns), scope
        assert np.array_equal(
            after.body.position_N, begun if state else before.body.position_N), scope
        assert np.array_equal(after.body.velocity_B, before.body.velocity_B) == (not state)
        assert np.array_equal(after.controls.deflections, before.controls.deflections)
        # And it goes on from there.
        assert result(node.call('step_simulation')) == ok
        assert node.flight.snapshot.time_ns == after.time_ns + node.flight.dt_ns


def test_time_alone_set_back_changes_nothing_of_the_flight(node, package):
    """The same steps from there on, to the last bit, with the deflections that were commanded."""
    scopes = package[1].ResetSimulation.Request
    flown = []
    for at_once in (True, False):
        node.operations.reset(to_zero=True)
        node.desk.receive(Source.PILOT, {'elevator': -0.1}, 0)
        node.call('step_simulation', steps=3)
        if not at_once:
            node.call('reset_simulation', scope=scopes.SCOPE_TIME)
        node.call('step_simulation', steps=20)
        flown.append(node.flight.snapshot)
    one, other = flown
    assert one.time_ns == other.time_ns + 3 * node.flight.dt_ns
    for name in ('position_N', 'velocity_B', 'q_NB', 'rates_B'):
        assert np.array_equal(getattr(one.body, name), getattr(other.body, name)), name


def test_the_entity_is_the_aircraft_in_map(node, package):
    """Heading east, so that forward is x of map; its acceleration is the change of its twist."""
    results = package[0].Result
    missing = node.call('get_entity_state', entity='nobody')
    assert result(missing) == results.RESULT_NOT_FOUND
    assert 'nobody' in missing.result.error_message
    place = node.call('get_entity_state', entity='trainer')
    assert result(place) == results.RESULT_OK
    state = place.state
    assert state.header.frame_id == 'map'
    assert (state.twist.linear.x, state.twist.linear.y, state.twist.linear.z) == pytest.approx(
        (12.0, 0.0, 0.0), abs=1e-6)
    assert state.pose.position.z == pytest.approx(150.0)

    # North, level, climbing, turning left and pulling up from below the trim.
    wanted = package[0].EntityState()
    wanted.pose.position.x, wanted.pose.position.y, wanted.pose.position.z = 5.0, 6.0, 200.0
    wanted.pose.orientation.z = wanted.pose.orientation.w = math.sqrt(0.5)
    wanted.twist.linear.y, wanted.twist.linear.z = 15.0, 1.0
    wanted.twist.angular.z = 0.2
    assert result(node.call('set_entity_state', entity='trainer',
                            state=wanted)) == results.RESULT_OK
    body = node.flight.snapshot.body
    assert body.position_N == pytest.approx([6.0, 5.0, -200.0])
    assert body.velocity_B == pytest.approx([15.0, 0.0, -1.0], abs=1e-12)
    assert body.rates_B == pytest.approx([0.0, 0.0, -0.2], abs=1e-12)
    read = node.call('get_entity_state', entity='trainer').state
    for part in ('linear', 'angular'):
        assert [getattr(getattr(read.twist, part), axis) for axis in 'xyz'] == pytest.approx(
            [getattr(getattr(wanted.twist, part), axis) for axis in 'xyz'], abs=1e-12)

    seen = []
    for _ in range(12):
        assert result(node.call('step_simulation')) == results.RESULT_OK
        seen.append(node.call('get_entity_state', entity='trainer').state)
    dt = node.flight.dt_ns * 1e-9
    for part in ('linear', 'angular'):
        before, now, after = (np.array([[getattr(getattr(each, part), axis) for axis in 'xyz']
                                        for each in (seen[-3].twist, seen[-2].acceleration,
                                                     seen[-1].twist)]))
        # A central difference is of second order in the step, which is 33 ms here.
        assert now == pytest.approx((after - before) / (2.0 * dt), rel=0.03, abs=2e-3), part


def test_a_state_that_cannot_be_is_refused_with_its_reason_and_nothing_changes(node, package):
    results = package[0].Result
    before = node.flight.snapshot

    def refused(change, **also):
        state = node.call('get_entity_state', entity='trainer').state
        change(state)
        answer = node.call('set_entity_state', **{'entity': 'trainer', 'state': state, **also})
        assert node.flight.snapshot is before
        return result(answer), answer.result.error_message

    code, text = refused(lambda state: None, entity='glider')
    assert code == results.RESULT_NOT_FOUND and 'glider' in text
    for change, word in (
            (lambda state: setattr(state.header, 'frame_id', 'odom'), 'odom'),
            (lambda state: setattr(state.twist.linear, 'x', math.nan), 'not finite'),
            (lambda state: setattr(state.pose.position, 'z', -1.0), 'altitude'),
            (lambda state: setattr(state.pose.orientation, 'w', 3.0), 'orientation')):
        code, text = refused(change)
        assert code == results.RESULT_OPERATION_FAILED and word in text


def test_who_follows_anothers_clock_resets_its_state_only(make, package):
    msg, srv = package
    node = make('-p', 'use_sim_time:=true', '-p', 'publish_clock:=false')
    scopes, features = srv.ResetSimulation.Request, msg.SimulatorFeatures
    can = node.call('get_simulator_features').features.features
    assert features.SIMULATION_RESET_STATE in can and features.SIMULATION_RESET_TIME not in can
    node.call('step_simulation', steps=3)
    before = node.flight.snapshot
    for scope in (scopes.SCOPE_DEFAULT, scopes.SCOPE_TIME, scopes.SCOPE_ALL):
        answer = node.call('reset_simulation', scope=scope)
        assert result(answer) == msg.Result.RESULT_FEATURE_UNSUPPORTED
        assert '/clock' in answer.result.error_message and node.flight.snapshot is before
    assert result(node.call('reset_simulation', scope=scopes.SCOPE_STATE)) == msg.Result.RESULT_OK
    assert node.flight.snapshot.time_ns == before.time_ns
    assert not np.array_equal(node.flight.snapshot.body.position_N, before.body.position_N)


def test_another_version_is_warned_of_and_offers_nothing(flown, package, monkeypatch, capfd):
    """Before 1.0 the results had other names."""
    monkeypatch.delattr(package[0].Result, 'RESULT_OK')
    monkeypatch.setattr(flown, 'offered', {})
    optional.open_services(flown)
    assert not flown.offered
    said = capfd.readouterr().err
    assert 'not of version 1' in said and 'RESULT_OK' in said
