# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Parameters of the simulator: each acts, in flight where it may change, or says why not."""

import array
import functools
import math
import time
from dataclasses import fields, replace

import numpy as np
import pytest

pytest.importorskip('rclpy', reason='rclpy is not installed')

import rclpy
from processes import free_domain
from rclpy.parameter import Parameter
from sensor_msgs.msg import Joy

from poststall_sim import topics
from poststall_sim.aircraft import ConfigError
from poststall_sim.failures import Kind
from poststall_sim.ros import declaration, flight_setup
from poststall_sim.ros.air_settings import AirSettings
from poststall_sim.ros.parameters import SimulatorSettings
from poststall_sim.ros.simulator import SimulatorNode
from poststall_sim.state import Controls
from poststall_sim.weather import Shear, ShearLaw

pytestmark = [pytest.mark.ros, pytest.mark.timeout(300)]

COARSE = replace(SimulatorSettings(), uvlm_chordwise=1, initial_altitude=500.0)


LISTS = (Parameter.Type.BYTE_ARRAY, Parameter.Type.BOOL_ARRAY, Parameter.Type.INTEGER_ARRAY,
         Parameter.Type.DOUBLE_ARRAY, Parameter.Type.STRING_ARRAY)


@pytest.fixture
def node_with():
    """Return what makes a paused simulator here, with coarse panels, of parameters by name."""
    context, nodes = rclpy.Context(), []
    context.init(args=[], domain_id=free_domain())

    def make(**parameters):
        given = {'uvlm.chordwise': 1, 'start_paused': True, 'reset.time': True, **parameters}
        nodes.append(SimulatorNode(
            context=context, use_global_arguments=False, parameter_overrides=[
                Parameter(name, value=value) for name, value in given.items()]))
        return nodes[-1]
    yield make
    for node in nodes:
        node.destroy_node()
    context.try_shutdown()


def told(node, **parameters):
    """Set parameters and return what the node says to each."""
    return node.set_parameters([
        Parameter(name, value=value) for name, value in parameters.items()])


def pulled(seconds=1.5, **given):
    """Return a flight into the stall, elevator up and no throttle, with other parameters."""
    flight = flight_setup.flight_from_settings(
        replace(COARSE, **given), AirSettings(), [].append)
    deflections = flight.trim.deflections.copy()
    deflections[1] = -0.5
    while flight.snapshot.time < seconds:
        flight.step(Controls(deflections, 0.0))
    assert flight.paused_reason is None
    return flight


def apart(one, other):
    """Return how far two flights have come apart [m]."""
    return np.linalg.norm(one.snapshot.body.position_N - other.snapshot.body.position_N)


@pytest.mark.parametrize('names', [(), ('elevator', 'throttle')])
def test_names_are_texts_also_where_there_are_none_and_nobody_sets_them(names):
    """Of an empty list rclpy would make one of bytes."""
    context = rclpy.Context()
    context.init(args=[], domain_id=free_domain())
    node = rclpy.create_node('named', context=context, parameter_overrides=[
        Parameter('surfaces', value=7)])
    declaration.declare_names(node, 'surfaces', names, 'what they are')
    value, said = node.get_parameter('surfaces'), node.describe_parameter('surfaces')
    assert value.type_ is Parameter.Type.STRING_ARRAY and value.value == list(names)
    assert (said.type, said.read_only, said.description) == (
        Parameter.Type.STRING_ARRAY.value, True, 'what they are')
    assert not told(node, surfaces=['rudder'])[0].successful
    node.destroy_node()
    context.try_shutdown()


# ---------------------------------------------------------------- each of them changes the flight


@pytest.mark.parametrize(('given', 'beside'), [
    ({'uvlm_core': 0.5}, {}),
    ({'decambering_angle_form': 'linear'}, {}),
    ({'decambering_start': 'attached'}, {'decambering_closure': 'local'}),
    ({'surface_limits_deg': (10.0,)}, {}),
])
def test_a_parameter_changes_the_flight(given, beside):
    """By more than what is left to the tolerance of the closure, 1e-5 rad."""
    one = pulled(**beside)
    assert apart(one, pulled(**beside)) == 0.0
    assert 1e-3 < apart(one, pulled(**beside, **given)) < 10.0


def test_where_the_search_starts_is_refused_where_it_changes_nothing():
    with pytest.raises(ConfigError, match='decambering.start: attached is for decambering.closure '
                       'local'):
        flight_setup.aero_settings(replace(COARSE, decambering_start='attached'))
    with pytest.raises(ConfigError, match='separation lag is for .* exact angles'):
        flight_setup.aero_settings(replace(
            COARSE, decambering_angle_form='linear', separation='lag'))


# ---------------------------------------------------------------------------- without any effect

IDLE = {'decambering.ell': (3.0, {'decambering_closure': 'local'}),
        'decambering.scheme': ('A', {}), 'decambering.relaxation': (0.3, {}),
        'uvlm.free_rows': (3, {}), 'uvlm.free_every': (7, {}),
        'separation.lag': (9.0, {}), 'separation.relaxation': (9.0, {}),
        'separation.delay': (0.0, {'separation': 'lag'})}
"""Parameters that need others to have an effect: a value, and what it changes nothing beside."""
OF_NAME = {field.metadata['name']: field for field in fields(SimulatorSettings)}


@pytest.fixture(scope='module')
def plain():
    """Return a function of parameters that gives a short flight, each flown once."""
    return functools.cache(lambda beside: pulled(0.25, **dict(beside)))


@pytest.mark.parametrize('name', IDLE)
def test_what_is_without_effect_changes_nothing_and_says_so(name, plain):
    value, beside = IDLE[name]
    field = OF_NAME[name]
    given = {**beside, field.name: value}
    one, other = plain(tuple(beside.items())), pulled(0.25, **given)
    for key in ('position_N', 'velocity_B', 'rates_B', 'q_NB'):
        assert np.array_equal(getattr(one.snapshot.body, key), getattr(other.snapshot.body, key))
    needed = replace(COARSE, **given).idle
    assert needed.keys() == {name} and replace(COARSE, **beside).idle == {}
    assert f'without effect but under {needed[name]}' in field.metadata['description']


def test_every_parameter_that_needs_others_is_in_the_table_and_those_are_there():
    assert IDLE.keys() == {name for name, field in OF_NAME.items() if field.metadata['under']}
    for name in IDLE:
        for other, values in OF_NAME[name].metadata['under'].items():
            assert set(values) <= set(OF_NAME[other].metadata['choices'])


def test_what_was_set_without_effect_is_said_at_the_start_in_diagnostics_and_when_it_becomes_so(
        node_with, capfd):
    node = node_with(**{'decambering.scheme': 'A', 'decambering.tolerance': 1e-4})
    warned, = [line for line in capfd.readouterr().err.splitlines() if 'without effect' in line]
    assert warned.endswith(
        'without effect here: decambering.scheme, which needs decambering.closure local')

    def said():
        return node.health.settings(node.flight, node.settings.idle).values[
            'parameters_without_effect']
    assert said() == 'decambering.scheme'
    assert told(node, **{'decambering.enabled': False})[0].successful
    assert 'decambering.tolerance, which needs decambering.enabled true' in capfd.readouterr().err
    assert said() == 'decambering.scheme, decambering.tolerance'
    node_with()
    assert 'without effect' not in capfd.readouterr().err


# ------------------------------------------------------------------------------ frames and files


@pytest.mark.parametrize(('given', 'message'), [
    ({'frames_base': 'map'}, 'must be two frames'),
    ({'frames_map': 'left/base_link', 'frames_prefix': 'left/'}, 'must be two frames'),
    ({'frames_base': 'map_ned'}, 'must be two frames, and two more'),
    ({'frames_map': 'base_link_frd'}, 'must be two frames, and two more'),
    ({'frames_map': '/map'}, 'no slash at its beginning'),
    ({'frames_prefix': 'left '}, 'no space'),
    ({'flight_file': 'flight.txt'}, 'set it to the path of a .npz file'),
])
def test_frames_and_files_that_are_none_are_refused_at_the_start(given, message):
    with pytest.raises(ConfigError, match=message):
        flight_setup.flight_from_settings(replace(COARSE, **given), AirSettings(), [].append)


def test_an_empty_frame_is_refused(node_with):
    for name in ('frames.map', 'frames.base'):
        for value in ('', '  '):
            with pytest.raises(ConfigError, match=f'parameter {name}: must not be empty'):
                node_with(**{name: value})


# ------------------------------------------------------------------------- what is published


def test_a_switch_takes_its_topics_away_and_a_rate_of_0_too(node_with):
    def published(**parameters):
        node = node_with(**parameters)
        return {topic for topic in topics.PUBLISHED if any(
            publisher.topic_name == node.resolve_topic_name(topic.name)
            for publisher in node.publishers)}

    default = published()
    assert default == {topic for topic in topics.PUBLISHED if topic.by_default} & default
    everything = published(publish_ned=True)
    assert {topic.name for topic in everything - default} == {'odom_ned', 'wrench_frd'}
    least = published(publish_tf=False, publish_markers=False)
    assert default - least == {topic for topic in default if topic.switch} >= {topics.MARKERS}
    assert 'strips' in {topic.name for topic in least}
    off = published(**{'publish_ned': True, 'rates.ned': 0.0})
    assert off == default


# -------------------------------------------------------------------------------- in flight


CHANGES = {
    'real_time_factor': (3.0, -1.0), 'flight_file': ('other.npz', 'other.txt'),
    'step_count': (7, 0), 'reset.time': (False, None), 'command.source': ('sum', 'nobody'),
    'command.timeout': (2.0, -1.0), 'command.on_timeout': ('trim', 'fly'),
    'command.deadband': (0.2, -0.1), 'decambering.enabled': (False, None),
    'failures': (['rudder:float'], ['rudder:loose']), 'engine_failures': ('engine_1', 'engine_9'),
    'wind.velocity': ([1.0, 2.0, 0.0], [1.0, 2.0]), 'wind.shear.law': ('power', 'linear'),
    'wind.shear.exponent': (0.2, 3.0), 'wind.shear.roughness': (0.1, 1.0),
    'wind.shear.reference_height': (10.0, 0.5),
    'wind.gust.velocity': ([0.0, 0.0, 1.0], [math.nan]),
    'wind.gust.length': (20.0, 0.0), 'wind.gust.distance': (1.0, -1.0),
    'wind.gust.shape': ('rise', 'fall'), 'wind.turbulence.intensity': ('light', 'rough'),
    'wind.turbulence.sigma': (0.5, math.nan), 'wind.turbulence.model': ('von_karman', 'none'),
    'wind.turbulence.seed': (3, -1), 'joy.deadband': (0.1, 1.0), 'joy.scale.aileron': (0.1, 2.0),
    'joy.scale.elevator': (0.1, 2.0), 'joy.scale.rudder': (0.1, -2.0),
    'joy.scale.throttle': (0.5, 3.0)}


def test_every_writable_parameter_is_changed_in_flight_or_refused_with_a_reason(node_with):
    node = node_with()
    names = [name for name in node._parameters
             if not node.describe_parameter(name).read_only
             and name not in ('use_sim_time', 'start_type_description_service')]
    assert set(names) == set(CHANGES)
    for name, (value, wrong) in CHANGES.items():
        before = node.get_parameter(name).value
        result, = told(node, **{name: value})
        assert result.successful, (name, result.reason)
        node.advance(2)
        for bad in [[True]] if wrong is None else [wrong, [True]]:   # out of range, of no type
            result, = told(node, **{name: bad})
            assert not result.successful and len(result.reason) > 10, name
        node.advance(1)
        assert told(node, **{name: before})[0].successful, name
    assert node.flight.paused_reason is None


@pytest.mark.parametrize('empty', [
    Parameter('failures', value=[]), Parameter('failures', Parameter.Type.STRING_ARRAY, [])])
def test_an_empty_list_of_failures_is_none(node_with, empty):
    """ROS takes it for a list of another type; it is what a user would write."""
    node = node_with(failures=['rudder:float'])
    result, = node.set_parameters([empty])
    assert result.successful, result.reason
    assert not node.flight.failures and list(node.get_parameter('failures').value) == ['']
    assert not node_with(failures=[]).flight.failures


def test_turbulence_that_there_cannot_be_is_refused_and_the_node_goes_on(node_with):
    """Near the ground its horizontal part is twice the vertical: of 80 m/s, beyond all fields."""
    node = node_with(**{'initial.altitude': 5.0, 'initial.airspeed': 14.0})
    result, = told(node, **{'wind.turbulence.sigma': 80.0})
    assert not result.successful and 'intensity must be 0 to 100 m/s' in result.reason
    assert node.air.turbulence_sigma == 0.0 and node.flight.weather.turbulence is None


# ------------------------------------------------------------------------------- flight files


def test_after_loading_a_flight_the_parameters_say_what_it_flies_with(node_with, tmp_path, capfd):
    """And it goes on to the bit: nothing of them is set anew."""
    path = str(tmp_path / 'flight.npz')
    one = node_with(**{
        'wind.velocity': [3.0, -1.0, 0.5], 'wind.shear.law': 'logarithmic',
        'wind.shear.roughness': 0.1, 'wind.shear.reference_height': 20.0, 'flight_file': path,
        'wind.turbulence.intensity': 'moderate', 'wind.turbulence.model': 'von_karman',
        'wind.turbulence.seed': 4, 'engine_failures': 'engine_1', 'failures': ['rudder:stuck=-5']})
    one.advance(5)
    assert one.operations.save()[0]
    one.advance(40)

    other = node_with(flight_file=path, failures=['elevator:float'])
    capfd.readouterr()
    assert other.operations.load()[0]
    assert 'elevator' not in capfd.readouterr().err   # which does not fail in this flight
    said = {name: other.get_parameter(name).value for name in (
        'engine_failures', 'wind.shear.law', 'wind.shear.roughness', 'wind.shear.reference_height',
        'wind.turbulence.model', 'wind.turbulence.seed')}
    assert said == {name: one.get_parameter(name).value for name in said}
    assert list(other.get_parameter('failures').value) == ['rudder:stuck=-5']
    assert list(other.get_parameter('wind.velocity').value) == [3.0, -1.0, 0.5]
    assert other.air.turbulence(150.0) == one.flight.weather.turbulence
    assert other.flight.weather.shear == Shear(ShearLaw.LOGARITHMIC, 0.1, 20.0)
    assert other.flight.failed_engines == {'engine_1'}
    assert {each.kind for each in other.flight.failures.values()} == {Kind.STUCK}
    other.advance(40)
    for name in ('position_N', 'velocity_B', 'rates_B', 'q_NB'):
        assert np.array_equal(getattr(other.flight.snapshot.body, name),
                              getattr(one.flight.snapshot.body, name)), name

    # What is set now acts on it, and on nothing else of it.
    assert told(other, **{'wind.velocity': [0.0, 0.0, 0.0]})[0].successful
    assert not other.flight.weather.wind_N.any()
    assert other.flight.weather.turbulence == one.flight.weather.turbulence
    # And a calm flight is as calm afterwards, by its parameters too.
    calm = node_with(flight_file=str(tmp_path / 'calm.npz'))
    assert calm.operations.save()[0]
    assert told(one, flight_file=str(tmp_path / 'calm.npz'))[0].successful
    assert one.operations.load()[0] and one.flight.weather.uniform
    assert one.get_parameter('wind.turbulence.sigma').value == 0.0
    assert one.get_parameter('wind.shear.law').value == 'none'
    assert one.get_parameter('engine_failures').value == '' and not one.flight.failed_engines


def test_an_engine_that_failures_turn_off_is_well_again_in_a_loaded_flight_too(
        node_with, tmp_path):
    node = node_with(flight_file=str(tmp_path / 'off.npz'), failures=['engine_1:off'])
    assert node.flight.failed_engines == {'engine_1'}
    assert node.operations.save()[0] and node.operations.load()[0]
    assert node.get_parameter('engine_failures').value == ''
    assert list(node.get_parameter('failures').value) == ['engine_1:off']
    assert node.flight.failed_engines == {'engine_1'}
    assert told(node, failures=[''])[0].successful and not node.flight.failed_engines


def test_turbulence_of_another_altitude_flies_on_and_it_is_said_that_no_parameter_has_it(
        node_with, tmp_path, capfd):
    path = str(tmp_path / 'flight.npz')
    low = node_with(**{'flight_file': path, 'initial.altitude': 60.0,
                       'wind.turbulence.sigma': 1.0})
    assert low.operations.save()[0]
    high = node_with(**{'flight_file': path, 'initial.altitude': 900.0})
    assert high.operations.load()[0]
    assert high.flight.weather.turbulence == low.flight.weather.turbulence
    assert 'a weather that wind.turbulence' in capfd.readouterr().err


def test_a_flight_of_another_atmosphere_is_refused(node_with, tmp_path):
    path = str(tmp_path / 'flight.npz')
    assert node_with(**{'flight_file': path, 'atmosphere.density': 1.0}).operations.save()[0]
    node = node_with(flight_file=path)
    done, text = node.operations.load()
    assert not done and 'density=1.0' in text and 'here it is' in text
    assert node.flight.model.atmosphere.density is None


@pytest.mark.parametrize('name', [
    'rates.state', 'rates.views', 'rates.path', 'sensors.imu.rate', 'sensors.gps.rate',
    'real_time_factor'])
def test_a_rate_of_nearly_nothing_is_refused_in_one_line(node_with, name):
    """Its period leaves the range of numbers; 0 is off."""
    with pytest.raises(ConfigError) as caught:
        node_with(**{name: 1e-300})
    assert str(caught.value) == f'parameter {name}: must be 0 or at least 0.001, got 1e-300'
    with pytest.raises(ConfigError, match='must be from 1 to'):
        node_with(**{'rates.clock': 1e-300})


def test_a_factor_of_nearly_nothing_is_refused_in_flight_while_time_is_owed(node_with):
    """The wall time of what is owed would be beyond all numbers."""
    node = node_with(start_paused=False)
    node._wake()
    time.sleep(0.002)
    result, = told(node, real_time_factor=1e-306)
    assert not result.successful and 'must be 0 or at least 0.001' in result.reason
    assert told(node, real_time_factor=1e-3)[0].successful


def test_lists_without_elements_are_refused_or_mean_the_default(node_with):
    """As they come over the wire, where the type of an empty list is known."""
    node = node_with()
    for kind in LISTS:
        value = array.array({'INTEGER_ARRAY': 'q', 'DOUBLE_ARRAY': 'd'}[kind.name]) if kind in (
            Parameter.Type.INTEGER_ARRAY, Parameter.Type.DOUBLE_ARRAY) else []
        for name in ('joy.deadband', 'real_time_factor', 'step_count', 'command.source',
                     'reset.time', 'wind.velocity', 'flight_file', 'dt'):
            result, = node.set_parameters([Parameter(name, kind, value)])
            assert not result.successful and result.reason, (kind, name)
        result, = node.set_parameters([Parameter('failures', kind, value)])
        assert result.successful and not node.flight.failures


def test_of_a_stick_that_is_refused_no_button_acts(node_with):
    node = node_with(**{'joy.enabled': True})
    pause = node.settings.joy_pause
    down, up = ([int(pressed and index == pause) for index in range(8)] for pressed in (1, 0))

    def hear(buttons, *axes):
        node.inbox._on_joy(Joy(axes=axes, buttons=buttons))

    hear(up, *[0.0] * 8)
    hear(down, *[math.nan] * 8)
    hear(down)
    assert node.paused and sum(node.health.refused.values()) == 2
    hear(up, *[0.0] * 8)
    hear(down, *[0.0] * 8)
    assert not node.paused


def test_what_is_said_once_is_not_said_again_at_a_jump(node_with, monkeypatch):
    node, made = node_with(), []
    emit = node._outbox.emit
    monkeypatch.setattr(node._outbox, 'emit', lambda topic, values: (
        made.append(topic), emit(topic, values)))
    for operation in (node.operations.reset, node.operations.trim, node.operations.zero_time):
        assert operation()[0]
    assert topics.CLOCK in made
    assert not [topic.name for topic in made if topic.rate is topics.Rate.ONCE]
